"""The pipeline's own work: order, what it merges, what it keeps of the times."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from kerfwright import __version__, pipeline
from kerfwright.capture.camera import Camera
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.errors import CaptureError, OptionError, StageError
from kerfwright.identify.types import Parts
from kerfwright.model import Finding, Scale
from kerfwright.output import OutputFolder
from kerfwright.pipeline import ReconstructOptions, Stage, run_stages
from kerfwright.progress import Reporter
from kerfwright.refine import RefineOptions


def capture(origin: str = "assumed") -> Capture:
    similarity = np.diag([0.002, 0.002, 0.002, 1.0])
    similarity[:3, 3] = 1, 2, 3
    return Capture(
        name="stool", views=(), cloud=Cloud(np.zeros((5, 3)), np.zeros((5, 3))),
        scale=Scale(millimetres_per_unit=500, origin=origin), capture_from_world=similarity, notes=("no colours",),
    )


def finding(code: str) -> Finding:
    return Finding(code=code, severity="info", message=code)


def merged(origin: str = "assumed"):
    selection = {
        "candidates": 6, "chosen": 4, "objective": 0.5, "bound": 0.75, "gap": 0.25, "explained": 0.9, "method": "exact",
        "energy": None,
    }  # fmt: skip
    parts = Parts(sheets=(), primitives=(), noise=0.1, notes=("one plane ignored",), selection=selection)
    refined = SimpleNamespace(boards=(), contacts=(), findings=(finding("K200"), finding("K300")))
    return pipeline._model(refined, parts, capture(origin), ReconstructOptions(seed=3))


def test_stages_run_in_order_and_get_what_they_need():
    seen = []

    def step(*arguments):
        seen.append(arguments)
        return len(seen)

    needs = {"a": ("path",), "b": ("a",), "c": ("b", "path", "a")}
    stages = [Stage(name, name, before, step) for name, before in needs.items()]
    reporter, options = Reporter(), ReconstructOptions()
    results = run_stages("here", options, reporter, stages=stages)
    assert seen == [("here", options), (1, options), (2, "here", 1, options)]
    assert results == {"path": "here", "a": 1, "b": 2, "c": 3}
    assert list(reporter.seconds) == ["a", "b", "c"]


def test_a_stage_that_fails_ends_the_run():
    def fails(*_):
        raise StageError("nothing to go on with")

    reached = []
    stages = [Stage("a", "A", (), fails), Stage("b", "B", (), lambda *_: reached.append(1))]
    with pytest.raises(StageError):
        run_stages("here", ReconstructOptions(), Reporter(), stages=stages)
    assert not reached


def test_every_stage_needs_only_what_came_before():
    known = {"path"}
    for stage in pipeline.STAGES:
        assert set(stage.needs) <= known, stage.name
        known.add(stage.name)


class Counted:
    """The pipeline's stages with results of no cost: the capture is read from files of a folder, the others are names.

    `again(options)` runs them and says which were not kept.
    """

    def __init__(self, folder):
        self.folder, self.log = folder / "capture", []
        self.stages = [replace(stage, run=partial(self.work, stage.name)) for stage in pipeline.STAGES]
        self.out = OutputFolder(folder / "out")
        self.folder.mkdir()
        self.put("cameras.txt", "a.jpg")
        self.put("a.jpg", "a")

    def put(self, name, text):
        (self.folder / name).write_text(text)

    def work(self, name, *arguments):
        self.log.append(name)
        options = arguments[-1]
        if name != "capture":
            return name
        camera = Camera("PINHOLE", 4, 3, (5.0, 5.0, 2.0, 1.5))
        names = (self.folder / "cameras.txt").read_text().split()
        views = tuple(View(name, self.folder / name, camera, np.eye(4)) for name in names)
        return replace(capture(), views=views, scale=Scale(millimetres_per_unit=options.millimetres_per_unit or 1000))

    def again(self, **options):
        self.log.clear()
        cache = pipeline.stage_cache(self.folder, self.out)
        run_stages(self.folder, ReconstructOptions(**options), Reporter(), cache, self.stages)
        return " ".join(self.log)


def test_a_stage_is_run_again_only_when_what_it_is_told_or_shown_has_changed(tmp_path):
    counted = Counted(tmp_path)
    assert counted.again() == "capture planes identify assemble refine check"
    assert counted.again() == ""
    assert counted.again(millimetres_per_unit=25.0) == "capture check"
    assert counted.again(length="top:x=420mm") == "capture check", "the capture without a scale was dropped"
    assert counted.again(stock="18", millimetres_per_unit=25.0) == "capture refine check"
    assert counted.again(stock="18", millimetres_per_unit=26.0) == "capture refine check"
    assert counted.again() == "capture refine check"
    assert counted.again(seed=1) == "identify refine check"
    assert counted.again(seed=1, without="seams") == "refine check"


def test_photographs_touch_only_what_is_shown_them(tmp_path):
    counted = Counted(tmp_path)
    counted.again()
    counted.put("b.jpg", "b")
    assert counted.again() == "capture", "no camera names it"
    counted.put("cameras.txt", "a.jpg b.jpg")
    assert counted.again() == "capture identify assemble refine check"
    counted.put("b.jpg", "B")
    assert counted.again() == "capture identify assemble refine", "the model comes from what these found: the same"


def test_a_photograph_that_goes_while_stages_run_is_told(tmp_path):
    counted = Counted(tmp_path)
    counted.again()
    (counted.folder / "a.jpg").unlink()
    with pytest.raises(CaptureError, match=r"a\.jpg: image: No such file"):
        counted.again()


def test_findings_are_merged_in_the_order_of_the_stages():
    assert [f.code for f in merged().findings] == ["K003", "K001", "K002", "K200", "K300"]


def test_an_assumed_scale_is_said_and_a_given_one_is_not():
    found = merged().findings[0]
    assert found.severity == "warning" and found.value == 500 and "--scale" in found.remedy
    assert "K003" not in [f.code for f in merged("given").findings]


def test_the_model_says_where_it_lies_and_what_it_came_from():
    model = merged()
    expected = np.array([[0.002, 0, 0, 1], [0, 0.002, 0, 2], [0, 0, 0.002, 3], [0, 0, 0, 1]])
    np.testing.assert_allclose(model.capture_from_model, expected, rtol=1e-12)
    origin = model.provenance
    assert (origin.version, origin.capture, origin.seed) == (__version__, "stool", 3)
    assert (origin.points, origin.images) == (5, 0)
    assert (origin.choice.chosen, origin.choice.candidates, origin.choice.gap) == (4, 6, 0.25)
    assert origin.options == {
        "up": "z", "millimetres_per_unit": None, "seed": 3, "crop": "auto", "ground": None, "length": "", "markers": "",
        "scale_by_stock": False, "stock": "", "without": "",
    }  # fmt: skip


def refined_with(monkeypatch, options: ReconstructOptions, origin: str = "assumed"):
    """Refinement of one board of 100 x 50 x 17.9 units of half a millimetre, and the stock that each fit was told."""
    from kerfwright import refine
    from kerfwright.model import Quantity
    from simple import board, rectangle

    told = []

    def fit_traced(pieces, parts, capture, settings):
        told.append(settings.stock.sizes)
        made = board(rectangle(100, 50), "shelf").model_copy(update={"thickness": Quantity(value=17.9)})
        return refine.Refined((made,), ())

    monkeypatch.setattr(refine, "trace", lambda *_: ())
    monkeypatch.setattr(refine, "fit_traced", fit_traced)
    found = capture(origin)
    parts = Parts(sheets=(), primitives=(), noise=0.1)
    return pipeline._refine(None, parts, found, options), told


def test_stock_sizes_reach_the_stages_in_their_units(monkeypatch):
    """A working unit of this capture is 0.002 of its units of 500 mm: a millimetre."""
    refined, told = refined_with(monkeypatch, ReconstructOptions(stock="12,18"), "given")
    assert told == [pytest.approx((12.0, 18.0))] and refined.scale_factor is None


def test_nothing_is_snapped_at_an_assumed_scale_or_unasked(monkeypatch):
    assert refined_with(monkeypatch, ReconstructOptions(stock="12,18"))[1] == [()]
    assert refined_with(monkeypatch, ReconstructOptions(), "given")[1] == [()]


def test_measured_lengths_fix_the_scale_before_thicknesses_are_snapped(monkeypatch):
    refined, told = refined_with(monkeypatch, ReconstructOptions(stock="36", length="shelf:x=200mm"))
    assert told == [(), pytest.approx((18.0,))]
    assert refined.scale_factor == pytest.approx(2.0)


def test_what_an_ablation_leaves_out_reaches_segmentation(monkeypatch):
    """One photograph a board and no seams, or none at all; other names are told."""
    from kerfwright.assemble.types import Assembly
    from kerfwright.refine import alternate

    told = []
    monkeypatch.setattr(alternate, "segment_boards", lambda *given: told.append(given[3]) or [])
    monkeypatch.setattr(alternate, "see_through", lambda *_: None)
    monkeypatch.setattr(alternate, "_split", lambda pieces, *_: told.append("split") or pieces)
    parts = SimpleNamespace(spacing=1.0, noise=0.1, sheets=())
    for without in ("multi-view,seams", "segmentation", "constraints"):
        settings = replace(RefineOptions(), **pipeline.left_out(without))
        alternate.traced_pieces(Assembly((), (), ()), parts, capture(), settings)
    assert [(o.max_views, o.use_images) for o in told if o != "split"] == [(1, True), (7, False), (7, True)]
    assert told[-1] == "split" and told.count("split") == 1
    with pytest.raises(OptionError, match="glue"):
        pipeline.left_out("seams,glue")
