"""The only place that knows the order of the stages.

Each stage is a pure function from what the stages before it made, plus its options, to one frozen result. STAGES says
which needs which; modules are imported when their stage runs, because some take seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kerfwright import __version__
from kerfwright.cache import NO_CACHE, StageCache, folder_hash, program_hash
from kerfwright.errors import OptionError, shown
from kerfwright.output import OutputFolder
from kerfwright.progress import Reporter

if TYPE_CHECKING:
    import numpy as np

    from kerfwright.assemble import Stock
    from kerfwright.assemble.types import Assembly
    from kerfwright.capture.types import Capture
    from kerfwright.identify.types import Parts, Planes
    from kerfwright.model import Finding, Model
    from kerfwright.refine import Refined

__all__ = [
    "LEFT_OUT", "STAGES", "ReconstructOptions", "Reconstruction", "Stage", "left_out", "reconstruct", "run_stages",
    "stage_cache",
]


# Units that the object's largest side has inside the stages; their lengths are millimetres at that size.
WORKING_SIZE = 500.0

# What refinement can do without, to see what it is good for (paper, Ablations): what RefineOptions then says.
LEFT_OUT: dict[str, dict[str, Any]] = {
    "segmentation": {"use_images": False},
    "multi-view": {"views_a_board": 1},
    "constraints": {"use_constraints": False},
    "seams": {"use_seams": False},
}


@dataclass(frozen=True)
class ReconstructOptions:
    """What a user may choose; everything else is the stages' own options.

    Attributes
    ----------
    up : axis of the capture that points up: x, y, z, -x, -y or -z.
    millimetres_per_unit : scale of the capture; None takes the unit of the file, or assumes metres.
    seed : of the one random generator.
    crop : auto, none, or the box to keep; see `kerfwright.capture.crop_options`.
    ground : height of the floor along the up axis in capture units; None looks for it.
    length : measured lengths that give the scale, semicolons between them; see `kerfwright.scaling.parse_lengths`.
    markers : markers that give the scale; see `kerfwright.capture.markers.parse_markers`.
    scale_by_stock : take the scale at which most boards are of a stock thickness.
    stock : thicknesses to snap to where the scale is known; see `kerfwright.stock.parse_stock`. Empty: none.
    without : parts of refinement to leave out, of LEFT_OUT, commas between them: for benchmarks.
    """

    up: str = "z"
    millimetres_per_unit: float | None = None
    seed: int = 0
    crop: str = "auto"
    ground: float | None = None
    length: str = ""
    markers: str = ""
    scale_by_stock: bool = False
    stock: str = ""
    without: str = ""


@dataclass(frozen=True)
class Stage:
    """One step: `run(*results of needs, options)` gives its result.

    Attributes
    ----------
    share : its usual part of the time.
    told : the options that it is told, all others being as if not given; None: all.
    seen : what it is shown of the capture, given the options it is told; such a stage reads the photographs.
    """

    name: str
    text: str
    needs: tuple[str, ...]
    run: Callable[..., Any]
    share: float = 1.0
    told: Callable[[ReconstructOptions], ReconstructOptions] | None = None
    seen: Callable[[Capture, ReconstructOptions], Capture] | None = None


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """The model, and what it was made from, in the stages' working units."""

    model: Model
    capture: Capture
    parts: Parts

    @property
    def capture_in_model(self) -> Capture:
        """The capture with the model's frame and millimetres for its world: to draw the two together."""
        import numpy as np

        from kerfwright.capture.frame import moved

        model_from_capture = np.linalg.inv(np.array(self.model.capture_from_model))
        return moved(self.capture, model_from_capture @ self.capture.capture_from_world)


def reconstruct(
    capture: Path | str,
    options: ReconstructOptions | None = None,
    reporter: Reporter | None = None,
    cache: StageCache = NO_CACHE,
) -> Reconstruction:
    """Reconstruct the boards of a capture.

    Parameters
    ----------
    capture : folder with images, cameras and a cloud; see docs/formats.md.
    options : None for the defaults.
    reporter : told of every stage; keeps their times.
    cache : where stages that have run before find their results; see `stage_cache`.

    Raises
    ------
    KerfwrightError when the capture cannot be used or a stage finds nothing to go on with.
    """
    results = run_stages(Path(capture), options or ReconstructOptions(), reporter or Reporter(), cache)
    return Reconstruction(model=results["check"], capture=results["capture"], parts=results["identify"])


def stage_cache(capture: Path, out: OutputFolder) -> StageCache:
    """The cache in an output folder, for this capture."""
    return StageCache(out.cache, program_hash, lambda: folder_hash(capture, leave_out=out.path))


def run_stages(
    path: Path,
    options: ReconstructOptions,
    reporter: Reporter,
    cache: StageCache = NO_CACHE,
    stages: Sequence[Stage] | None = None,
) -> dict[str, Any]:
    """Run the stages in order; returns every stage's result by name. "path" is the capture's folder."""
    results: dict[str, Any] = {"path": path}
    stages = STAGES if stages is None else stages
    reporter.plan({stage.name: stage.share for stage in stages} | AFTERWARDS)
    for stage in stages:
        with reporter.stage(stage.name, stage.text):
            results[stage.name], kept = _result(stage, results, options, cache)
            if kept:
                reporter.reuse(stage.name)
    cache.prune()
    return results


def _result(stage: Stage, results: dict[str, Any], options: ReconstructOptions, cache: StageCache) -> tuple[Any, bool]:
    """The stage's result, and whether it was kept; its key is made of nothing but what the stage is told and shown."""
    told = stage.told(options) if stage.told else options
    given = {name: results[name] for name in stage.needs}
    if not stage.seen:
        return cache.get(stage.name, stage.needs, partial(stage.run, *given.values(), told), lambda: repr(told))
    seen = given["capture"] = stage.seen(given["capture"], told)
    needs = [name for name in stage.needs if name != "capture"]
    run = partial(stage.run, *given.values(), told)
    return cache.get(stage.name, needs, run, lambda: f"{told} {_content_hash(seen)}")


def _content_hash(capture: Capture) -> str:
    from kerfwright.capture.content import content_hash

    return content_hash(capture)


def _told(*names: str) -> Callable[[ReconstructOptions], ReconstructOptions]:
    """Only these options."""
    return lambda options: ReconstructOptions(**{name: getattr(options, name) for name in names})


def _told_refine(options: ReconstructOptions) -> ReconstructOptions:
    """Lengths give a scale, which refinement needs only to snap thicknesses."""
    return _told("seed", "without", *(("stock", "length") if options.stock else ()))(options)


def _seen(capture: Capture, options: ReconstructOptions) -> Capture:
    """Without scale and place, but where thicknesses are snapped to millimetres."""
    from kerfwright.capture.content import unscaled

    return capture if options.stock else unscaled(capture)


def _seen_cloud(capture: Capture, options: ReconstructOptions) -> Capture:
    """Without the photographs, so that another one leaves what comes from the cloud alone."""
    from dataclasses import replace

    return replace(_seen(capture, options), views=())


def _capture(path: Path, options: ReconstructOptions) -> Capture:
    from kerfwright.capture import PrepareOptions, crop_options, open_capture, prepare
    from kerfwright.capture.photos import lightened

    opened = open_capture(path, up=options.up, millimetres_per_unit=options.millimetres_per_unit)
    if options.markers:
        opened = _scaled_by_markers(opened, options.markers)
    prepared = prepare(opened, PrepareOptions(**crop_options(options.crop), ground=options.ground))
    return _in_working_units(lightened(prepared))


def _scaled_by_markers(capture: Capture, text: str) -> Capture:
    from dataclasses import replace

    from kerfwright.capture.markers import marker_scale, parse_markers

    return replace(capture, scale=marker_scale(capture.views, parse_markers(text)))


def _in_working_units(capture: Capture) -> Capture:
    """The capture resized so that the object is WORKING_SIZE long: an assumed scale must not set a tolerance.

    What limits every stage, noise and pixels, grows with the object that fills the photographs.
    """
    import numpy as np

    from kerfwright.capture.frame import moved, similarity
    from kerfwright.capture.steady import snapped

    working = moved(capture, similarity(WORKING_SIZE / capture.cloud.diameter, np.eye(3), np.zeros(3)))
    return snapped(working, WORKING_SIZE)


def _planes(capture: Capture, options: ReconstructOptions) -> Planes:
    from kerfwright.identify import planes_of

    return planes_of(capture.cloud)


def _identify(planes: Planes, capture: Capture, options: ReconstructOptions) -> Parts:
    from kerfwright.identify import IdentifyOptions, identify

    return identify(capture, IdentifyOptions(seed=options.seed), planes)


def _assemble(parts: Parts, capture: Capture, options: ReconstructOptions) -> Assembly:
    from kerfwright.assemble import AssembleOptions, assemble

    return assemble(parts, capture, AssembleOptions())


def _refine(assembly: Assembly, parts: Parts, capture: Capture, options: ReconstructOptions) -> Refined:
    from dataclasses import replace

    from kerfwright.refine import RefineOptions, fit_traced, trace
    from kerfwright.stock import scale_is_known

    settings = replace(RefineOptions(seed=options.seed), **left_out(options.without))
    pieces = trace(assembly, parts, capture, settings)
    if not options.stock or not scale_is_known(capture.scale, options.length):
        return fit_traced(pieces, parts, capture, settings)
    factor = None
    if options.length:
        factor = _length_factor(_model(fit_traced(pieces, parts, capture, settings), parts, capture, options), options)
    settings = replace(settings, stock=_working_stock(capture, options.stock, factor))
    return replace(fit_traced(pieces, parts, capture, settings), scale_factor=factor)


def left_out(without: str) -> dict[str, Any]:
    """Fields of RefineOptions for what is left out. Raises OptionError for a name that LEFT_OUT has not."""
    names = [name for name in without.split(",") if name]
    unknown = [name for name in names if name not in LEFT_OUT]
    if unknown:
        raise OptionError(f"--without: {shown(unknown[0])}: not known: take some of {', '.join(LEFT_OUT)}")
    return {field: value for name in names for field, value in LEFT_OUT[name].items()}


def _length_factor(model: Model, options: ReconstructOptions) -> float:
    from kerfwright.scaling import length_factor, parse_lengths

    return length_factor(model, parse_lengths(options.length.split(";")))


def _working_stock(capture: Capture, stock: str, factor: float | None) -> Stock:
    """Stock sizes in the stages' working units; `factor` makes the capture's millimetres those of measured lengths."""
    from kerfwright.assemble import Stock
    from kerfwright.stock import parse_stock

    unit = (factor or 1.0) / _world_from_model(capture)[0, 0]
    scale = capture.scale
    error = 0.0 if factor is not None else (scale.standard_error or 0.0) / scale.millimetres_per_unit
    return Stock(tuple(size.value / unit for size in parse_stock(stock)), error)


def _check(refined: Refined, parts: Parts, capture: Capture, options: ReconstructOptions) -> Model:
    from kerfwright.solid import CheckOptions, check
    from kerfwright.solid.sound import with_solids
    from kerfwright.solid.trim import fitted_together

    model = _scaled_by_boards(_model(refined, parts, capture, options), options, refined.scale_factor)
    model = fitted_together(with_solids(_with_stock(model, options)))
    return model.model_copy(update={"findings": (*model.findings, *check(model, CheckOptions()))})


STAGES: tuple[Stage, ...] = (
    Stage("capture", "Reading the capture", ("path",), _capture, 0.02,
          _told("up", "millimetres_per_unit", "crop", "ground", "markers")),
    Stage("planes", "Finding planes in the cloud", ("capture",), _planes, 0.05, _told(), _seen_cloud),
    Stage("identify", "Finding the boards", ("planes", "capture"), _identify, 0.25, _told("seed"), _seen),
    Stage("assemble", "Finding how the boards meet", ("identify", "capture"), _assemble, 0.1, _told(), _seen),
    Stage("refine", "Tracing cut paths in the photographs", ("assemble", "identify", "capture"), _refine, 0.35,
          _told_refine, _seen),
    Stage("check", "Building solids and checking them", ("refine", "identify", "capture"), _check, 0.13),
)  # fmt: skip
AFTERWARDS = {"write": 0.1}  # writing is no stage, but takes its part of the time


def _model(refined: Refined, parts: Parts, capture: Capture, options: ReconstructOptions) -> Model:
    """Gather what the stages found, their findings in the stages' order."""
    from dataclasses import asdict

    import numpy as np

    from kerfwright.model import Choice, Model, Provenance
    from kerfwright.model.frames import rows
    from kerfwright.model.resize import resized_board, resized_contact

    world_from_model = _world_from_model(capture)
    model_from_world = np.linalg.inv(world_from_model)
    provenance = Provenance(
        version=__version__, capture=capture.name, images=len(capture.views), points=len(capture.cloud),
        seed=options.seed, options=asdict(options),
        choice=parts.selection and Choice(**{name: parts.selection[name] for name in Choice.model_fields}),
    )
    notes = [_remark("K001", text) for text in capture.notes] + [_remark("K002", text) for text in parts.notes]
    return Model(
        name=capture.name, scale=capture.scale, provenance=provenance,
        boards=tuple(resized_board(b, model_from_world) for b in refined.boards),
        contacts=tuple(resized_contact(c, model_from_world) for c in refined.contacts),
        findings=(*_scale_finding(capture), *notes, *refined.findings),
        capture_from_model=rows(capture.capture_from_world @ world_from_model),
    )


def _with_stock(model: Model, options: ReconstructOptions) -> Model:
    """The model with snapped thicknesses named, and told which are not."""
    from kerfwright.stock import labelled, parse_stock, scale_is_known, unsnapped_findings

    sizes = parse_stock(options.stock)
    boards = labelled(model.boards, sizes)
    told = unsnapped_findings(boards, sizes, scale_is_known(model.scale, options.length))
    return model.model_copy(update={"boards": boards, "findings": (*model.findings, *told)})


def _scaled_by_boards(model: Model, options: ReconstructOptions, factor: float | None = None) -> Model:
    """The model at the scale that its boards give, where that was asked for."""
    from kerfwright.scaling import parse_lengths, scaled_by_lengths, scaled_by_stock

    if options.length:
        return scaled_by_lengths(model, parse_lengths(options.length.split(";")), factor)
    return scaled_by_stock(model) if options.scale_by_stock else model


def _world_from_model(capture: Capture) -> np.ndarray:
    """4x4 from the model's millimetres to the working units of the stages."""
    import numpy as np

    units_of_capture = float(np.cbrt(np.linalg.det(capture.capture_from_world[:3, :3])))
    scale = 1.0 / (units_of_capture * capture.scale.millimetres_per_unit)
    return np.diag([scale, scale, scale, 1.0])


def _remark(code: str, text: str) -> Finding:
    from kerfwright.model import Finding

    return Finding(code=code, severity="info", message=text)


def _scale_finding(capture: Capture) -> tuple[Finding, ...]:
    """Nobody should cut wood to an assumed scale unknowingly."""
    from kerfwright.model import Finding

    if capture.scale.origin != "assumed":
        return ()
    return (Finding(
        code="K003", severity="warning", value=capture.scale.millimetres_per_unit,
        message=f"the scale is assumed: 1 capture unit = {capture.scale.millimetres_per_unit:g} mm",
        remedy="measure one board and give --length or --scale before you cut",
    ),)
