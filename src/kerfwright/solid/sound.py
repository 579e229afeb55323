"""Boards that have a solid. Of one whose cut path or bevels make none, the nearest outline that does: one board must
not lose all others, nor what was seen of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import shapely
from shapely.geometry import Polygon

from kerfwright.errors import ModelError
from kerfwright.model import Board, CutPath, Finding, Model
from kerfwright.model.faults import path_problem
from kerfwright.model.geometry import edge_start, path_polygon
from kerfwright.model.plain import polygon_path
from kerfwright.solid.build import board_solid, solid_is_valid

__all__ = ["solid_problem", "with_solids"]

LEFT_OUT = "left out"
STRAIGHT = 0.05  # mm by which the lines of a plain polygon may leave the curves of the path that they stand for


def solid_problem(board: Board) -> str | None:
    """Why the board has no solid: its path, OCCT, or its bevels, which may have lost their edges; None where it has."""
    if problem := path_problem(board.cut_path):
        return problem
    try:
        solid = board_solid(board)
    except ModelError as error:
        return str(error)
    return None if solid_is_valid(solid, thorough=False) else "OCCT calls the solid invalid"


def with_solids(model: Model) -> Model:
    """The model, every board without a solid drawn more plainly, and told (K013); one that has no area is left out.

    Repeats of such a board, and the board that it repeats, are boards of their own from then on.
    """
    problems = {board.name: problem for board in model.boards if (problem := solid_problem(board))}
    if not problems:
        return model
    mended = {b.name: _plainer(b) for b in model.boards if b.name in problems}
    families = {b.same_as or b.name for b in model.boards if b.name in problems}
    boards = []
    for board in model.boards:
        found, _ = mended.get(board.name, (board, ""))
        if found is not None:
            alone = (board.same_as or board.name) in families
            boards.append(found.model_copy(update={"same_as": None, "mirrored": False}) if alone else found)
    told = [_told(name, problem, mended[name][1]) for name, problem in problems.items()]
    model = model.model_copy(update={"boards": tuple(boards), "findings": (*model.findings, *told)})
    gone = [name for name, (board, _) in mended.items() if board is None]
    return _without_contacts_of(model, gone) if gone else model


def _plainer(board: Board) -> tuple[Board | None, str]:
    """The board with the first plainer outline that has a solid, and what it is; None where there is none."""
    for path, bevels, what in _ways(board):
        other = board.model_copy(update={"cut_path": path, "bevels": bevels})
        if solid_problem(other) is None:
            return other, what
    return None, LEFT_OUT


def _ways(board: Board) -> Iterator[tuple[CutPath, tuple, str]]:
    """Outlines and bevels to try, the one that keeps most first."""
    if board.bevels:
        yield board.cut_path, (), "drawn without bevels"
    region = _region(board.cut_path)
    if region is None:
        return
    plain = polygon_path(shapely.make_valid(region), STRAIGHT / 2)
    yield plain, board.bevels, "drawn as a plain polygon"
    yield plain, (), "drawn as a plain polygon without bevels"
    yield CutPath(outer=plain.outer), (), "drawn as a plain polygon without holes and bevels"
    yield polygon_path(region.convex_hull, STRAIGHT / 2), (), "drawn as the hull of its outline"


def _region(path: CutPath) -> Polygon | None:
    """What the path encloses, it may cross itself; None where there is no area."""
    edges = path.outer.edges
    try:
        region = path_polygon(path, STRAIGHT / 2)
    except ValueError:  # an arc whose points lie in one line
        region = shapely.Polygon([edge_start(edge) for edge in edges]) if len(edges) > 2 else shapely.Polygon()
    return region if shapely.make_valid(region).area > 1 else None


def _told(name: str, problem: str, what: str) -> Finding:
    lost = what == LEFT_OUT
    return Finding(
        code="K013", severity="error" if lost else "warning", boards=() if lost else (name,),
        message=f"{name}: it has no solid as it was traced ({problem}), and is {what}",
        remedy="compare it with the object, and photograph its edges from nearer",
    )


def _without_contacts_of(model: Model, names: Sequence[str]) -> Model:
    """The model without the contacts of boards that are gone; bevels count contacts, and are told the new numbers."""
    kept = [k for k, c in enumerate(model.contacts) if c.a not in names and c.b not in names]
    number = {old: new for new, old in enumerate(kept)}
    boards = []
    for board in model.boards:
        bevels = (bevel.model_copy(update={"contact": number.get(bevel.contact)}) for bevel in board.bevels)
        boards.append(board.model_copy(update={"bevels": tuple(bevels)}))
    return model.model_copy(update={"boards": tuple(boards), "contacts": tuple(model.contacts[k] for k in kept)})
