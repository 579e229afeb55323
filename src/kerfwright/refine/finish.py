"""Cut paths, boards and contacts out of the outlines of an assembly."""

from __future__ import annotations

from itertools import pairwise

import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.capture.types import Capture
from kerfwright.errors import StageError
from kerfwright.model import Board, CutPath, Finding, Line, Loop
from kerfwright.model.geometry import edge_length
from kerfwright.refine.boards import to_board
from kerfwright.refine.constrain import constrained_region, to_loops
from kerfwright.refine.curves import fit_curves
from kerfwright.refine.options import Refined, RefineOptions
from kerfwright.refine.types import BoundaryLoop, Outline

__all__ = ["finished"]

SHORTEST = 1e-3  # mm; OCCT makes no edge of less


def finished(outlines: tuple[Outline, ...], assembly: Assembly, capture: Capture, options: RefineOptions) -> Refined:
    """Fit every cut path on its constraint segments."""
    boards, findings = [], []
    for number, outline in enumerate(outlines):
        board, notes = _board(number, outline, assembly, capture.cloud.diameter, options)
        boards.append(board)
        findings += [Finding(
            code="K010", severity="warning", message=f"{board.name}: {note}", boards=(board.name,)
        ) for note in notes]
    return Refined(tuple(boards), assembly.contacts, (*assembly.findings, *findings))


def _board(
    number: int, outline: Outline, assembly: Assembly, diameter: float, options: RefineOptions
) -> tuple[Board, tuple[str, ...]]:
    sheet, segments = assembly.sheets[number], assembly.constraints[number]
    region = constrained_region(sheet.region, segments, diameter / 6, diameter / 20)
    loops = to_loops(region, outline, segments, options.boundary_step * diameter)
    path, notes = _cut_path(loops, region, segments, options.boundary_step * diameter)
    return to_board(sheet, path, segments, outline.origin, notes), notes


def _cut_path(
    loops: tuple[BoundaryLoop, ...], region: Polygon, segments: tuple[ConstraintSegment, ...], tolerance: float
) -> tuple[CutPath, tuple[str, ...]]:
    """The fitted cut path; a polygon, and a note that says so, for a boundary too rough to fit."""
    try:
        fit = fit_curves(loops, segments)
    except StageError as error:
        return polygon_path(region, tolerance), (f"the cut path is a plain polygon: {error}",)
    short = [e for loop in (fit.path.outer, *fit.path.holes) for e in loop.edges if edge_length(e) < SHORTEST]
    if short:
        return polygon_path(region, tolerance), (
            f"the cut path is a plain polygon: {len(short)} fitted edges have no length",
        )
    return fit.path, fit.notes


def polygon_path(region: Polygon, tolerance: float) -> CutPath:
    """A polygon's rings as lines, simplified to a tolerance in mm."""
    plain = orient(shapely.set_precision(region.simplify(tolerance), 10 * SHORTEST).buffer(0))
    plain = max(getattr(plain, "geoms", [plain]), key=lambda p: p.area)
    loops = []
    for ring in (plain.exterior, *plain.interiors):
        points = [tuple(map(float, p)) for p in ring.coords]
        loops.append(Loop(edges=tuple(Line(start=a, end=b) for a, b in pairwise(points))))
    return CutPath(outer=loops[0], holes=tuple(loops[1:]))
