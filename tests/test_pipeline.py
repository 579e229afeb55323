"""The pipeline's own work: order, what it merges, what it keeps of the times."""

from types import SimpleNamespace

import numpy as np
import pytest

from kerfwright import __version__, pipeline
from kerfwright.capture.types import Capture, Cloud
from kerfwright.errors import StageError
from kerfwright.identify.types import Parts
from kerfwright.model import Finding, Scale
from kerfwright.pipeline import ReconstructOptions, Stage, run_stages
from kerfwright.progress import Reporter


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
    parts = Parts(sheets=(), primitives=(), noise=0.1, notes=("one plane ignored",))
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
    assert origin.options == {
        "up": "z", "millimetres_per_unit": None, "seed": 3, "crop": "auto", "ground": None, "length": "", "markers": "",
        "scale_by_stock": False,
    }  # fmt: skip
