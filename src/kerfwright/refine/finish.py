"""Cut paths, boards and contacts out of the outlines of an assembly."""

from __future__ import annotations

from shapely.geometry import Polygon

from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.capture.types import Capture, Cloud
from kerfwright.errors import StageError
from kerfwright.identify.outlines import constrained_region
from kerfwright.model import CutPath, Finding
from kerfwright.model.geometry import edge_length
from kerfwright.model.plain import SHORTEST, polygon_path
from kerfwright.refine.boards import to_boards
from kerfwright.refine.constrain import to_loops
from kerfwright.refine.curves import CurveOptions, fit_curves
from kerfwright.refine.eased import Stereo, moved_to_cut_faces, stereo_of
from kerfwright.refine.options import Refined, RefineOptions
from kerfwright.refine.twins import with_twins
from kerfwright.refine.types import Fitted, Outline
from kerfwright.refine.unsure import less_sure_at_contacts

__all__ = ["finished"]

SMOOTHED = "spurs of the boundary were left out: it was too rough to fit as traced"


def finished(outlines: tuple[Outline, ...], assembly: Assembly, capture: Capture, options: RefineOptions) -> Refined:
    """Fit every cut path on its constraint segments."""
    diameter, curves = capture.cloud.diameter, CurveOptions(use_relations=options.use_constraints)
    step = options.boundary_step * diameter
    stereo = stereo_of(assembly.sheets, capture.cloud)
    fitted = with_twins(
        [_fitted(k, outline, assembly, capture.cloud, stereo, step, curves) for k, outline in enumerate(outlines)],
        curves,
    )
    boards = to_boards(fitted)
    findings = [
        Finding(code="K010", severity="warning", message=f"{board.name}: {note}", boards=(board.name,))
        for board in boards for note in board.notes
    ]
    return Refined(boards, assembly.contacts, (*assembly.findings, *findings))


def _fitted(
    number: int, outline: Outline, assembly: Assembly, cloud: Cloud, stereo: Stereo, step: float, curves: CurveOptions
) -> Fitted:
    sheet, segments, diameter = assembly.sheets[number], assembly.constraints[number], cloud.diameter
    region = constrained_region(sheet.region, segments, diameter / 6, diameter / 20)
    attempts = [(region, ()), (_smoothed(region, segments, diameter), (SMOOTHED,))]
    problem = ""
    for shape, remarks in attempts:
        loops = moved_to_cut_faces(to_loops(shape, outline, segments, step), sheet, segments, cloud, stereo)
        loops = less_sure_at_contacts(loops, number, assembly, diameter)
        try:
            fit = fit_curves(loops, segments, curves)
            _refuse_short_edges(fit.path)
        except StageError as error:
            problem = str(error)
            continue
        return Fitted(sheet, segments, loops, fit.path, outline.origin, (*fit.notes, *remarks))
    notes = (f"the cut path is a plain polygon: {problem}",)
    return Fitted(sheet, segments, loops, polygon_path(region, step), outline.origin, notes)


def _smoothed(region: Polygon, segments: tuple[ConstraintSegment, ...], diameter: float) -> Polygon:
    """The region without spurs and notches that are narrower than any cut; its corners stay."""
    reach = diameter / 150
    smooth = region
    for step in (-reach, 2 * reach, -reach):
        smooth = smooth.buffer(step, join_style="mitre")
    smooth = max(getattr(smooth, "geoms", [smooth]), key=lambda p: p.area)
    return constrained_region(smooth, segments, diameter / 6, diameter / 20)


def _refuse_short_edges(path: CutPath) -> None:
    """Raise StageError when a fitted edge has no length."""
    short = [e for loop in (path.outer, *path.holes) for e in loop.edges if edge_length(e) < SHORTEST]
    if short:
        raise StageError(f"cut path: edges: {len(short)} have no length: the boundary is too rough there")
