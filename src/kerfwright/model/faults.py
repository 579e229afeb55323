"""What a model must not say: contradictions that no solid and no file could express.

`faults` lists them all; reading a model file refuses the first, and the checker reports every one as a finding.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kerfwright.errors import shown
from kerfwright.model.cutpath import Circle, CutPath, Loop
from kerfwright.model.geometry import (
    edge_end,
    edge_length,
    edge_points,
    edge_start,
    path_polygon,
    sample_loop,
    signed_area,
)
from kerfwright.model.types import Board, Model

__all__ = ["Fault", "faults", "path_problem"]

# Names become file names, STEP labels and spreadsheet cells: one rule that is safe in all of them. Letters of any
# script; exporters write them as each format can carry them.
_MARKS = " _.-"
_LONGEST = 100
JOIN_TOLERANCE = 1e-4  # mm between an edge's end and the next one's start; a thousand times what OCCT closes by itself
LARGEST = 1e6  # mm; a board of a kilometre is a slip of units, and OCCT fails on far larger ones
RIGID_TOLERANCE = 1e-6  # of a pose's turn from an orthonormal one: a micrometre on a metre


@dataclass(frozen=True)
class Fault:
    """One contradiction: its finding code, the field, what was found there, and what to do."""

    code: str
    field: str
    found: str
    remedy: str
    boards: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.field}: {self.found}: {self.remedy}"


@np.errstate(all="ignore")  # numbers too large to be true fail the checks as infinity or NaN
def faults(model: Model) -> tuple[Fault, ...]:
    """Every contradiction of the model, in the order of its fields."""
    return (
        *_name_faults(model),
        *(f for i, b in enumerate(model.boards) for f in _board_faults(i, b)),
        *_reference_faults(model),
    )


def _name_faults(model: Model) -> Iterator[Fault]:
    first: dict[str, int] = {}
    for i, board in enumerate(model.boards):
        field = f"boards[{i}].name"
        if not _is_safe(board.name):
            yield Fault(
                "K101",
                field,
                shown(repr(board.name)),
                f"use up to {_LONGEST} letters, digits, space, _ . -, and begin with a letter or digit",
                (board.name,),
            )
        if (known := first.setdefault(unicodedata.normalize("NFKC", board.name).casefold(), i)) != i:
            yield Fault(
                "K102",
                field,
                shown(repr(board.name)),
                f"boards[{known}] has this name already: give each its own, case apart",
                (board.name,),
            )


def _is_safe(name: str) -> bool:
    """Letters with their accents and digits (Unicode categories L, M, N) and a few marks; nothing that hides."""
    kinds = [unicodedata.category(c)[0] for c in name]
    sound = all(kind in "LMN" or c in _MARKS for kind, c in zip(kinds, name, strict=True))
    return sound and len(name) <= _LONGEST and kinds[0] in "LN" and name[-1] not in " ."


def _board_faults(index: int, board: Board) -> Iterator[Fault]:
    where = f"boards[{index}] {shown(repr(board.name))}"
    if not 0 < board.thickness.value <= LARGEST:
        wanted = "above 0" if board.thickness.value <= 0 else f"of {LARGEST:g} mm at most"
        yield Fault(
            "K103", f"{where}.thickness", f"{board.thickness.value:g} mm", f"give a thickness {wanted}", (board.name,)
        )
    if problem := _pose_problem(np.array(board.model_from_board)):
        yield Fault(
            "K104", f"{where}.model_from_board", problem, "give a turn and a shift, nothing else", (board.name,)
        )
    for field, code, found, remedy in _path_problems(board.cut_path):
        yield Fault(code, f"{where}.cut_path.{field}", found, remedy, (board.name,))
    for k, bevel in enumerate(board.bevels):
        if np.linalg.norm(bevel.normal) < 1e-9:
            yield Fault(
                "K107",
                f"{where}.bevels[{k}].normal",
                str(bevel.normal),
                "give the outward normal of the cut face",
                (board.name,),
            )


def _pose_problem(pose: np.ndarray) -> str | None:
    turn = pose[:3, :3]
    if np.abs(pose[:3, 3]).max() > LARGEST:
        return f"its shift is beyond {LARGEST:g} mm"
    if not np.allclose(pose[3], (0, 0, 0, 1), atol=RIGID_TOLERANCE):
        return f"last row {pose[3].tolist()} is not 0 0 0 1"
    if not np.allclose(turn @ turn.T, np.eye(3), atol=RIGID_TOLERANCE):
        return "its turn stretches or shears"
    return "its turn mirrors" if np.linalg.det(turn) < 0 else None


@np.errstate(all="ignore")
def path_problem(path: CutPath) -> str | None:
    """The first thing that is wrong with a cut path; None for a sound one."""
    return next((f"{field}: {found}" for field, _, found, _ in _path_problems(path)), None)


def _path_problems(path: CutPath) -> Iterator[tuple[str, str, str, str]]:
    """(field, code, found, remedy) of what is wrong with a cut path."""
    loops = (("outer", path.outer, 1), *((f"holes[{k}]", hole, -1) for k, hole in enumerate(path.holes)))
    sound = True
    for field, loop, sense in loops:
        problem = _loop_problem(loop) or _sense_problem(loop, sense)
        if problem:
            sound = False
            yield field, *problem
    if sound and not path_polygon(path).is_valid:
        yield "holes", "K106", "holes cross each other or the outline", "move or drop holes"


def _loop_problem(loop: Loop) -> tuple[str, str, str] | None:
    """(code, found, remedy) of an open, degenerate or self-crossing loop."""
    import shapely

    if any(isinstance(e, Circle) for e in loop.edges) and len(loop.edges) > 1:
        return "K105", "a circle beside other edges", "a circle is the only edge of its loop"
    for k, edge in enumerate(loop.edges):
        try:
            length = edge_length(edge)
        except ValueError:
            return "K105", f"edge {k} is an arc whose three points lie in one line", "make it a line"
        if length < JOIN_TOLERANCE:
            return "K105", f"edge {k} has no length", "drop it"
        after = loop.edges[(k + 1) % len(loop.edges)]
        gap = float(np.hypot(*np.subtract(edge_start(after), edge_end(edge))))
        if gap > JOIN_TOLERANCE:
            return "K105", f"open by {gap:.4g} mm after edge {k}", "end each edge where the next one starts"
    if max(np.abs(edge_points(edge, np.linspace(0, 1, 9))).max() for edge in loop.edges) > LARGEST:
        return "K105", f"reaches beyond {LARGEST:g} mm", "give millimetres, near the board's own origin"
    points = sample_loop(loop)
    if len(points) < 3:
        return "K105", f"{len(loop.edges)} edges enclose nothing", "give three edges or more, or a curve"
    if not shapely.is_simple(shapely.linearrings(points)):
        return "K106", f"crosses itself near {_crossing(points)}", "redraw the path without crossings"
    return None


def _crossing(points: np.ndarray) -> str:
    """Where a ring crosses itself, for people."""
    import shapely

    reason = shapely.is_valid_reason(shapely.polygons(points))
    found = re.search(r"\[(\S+) (\S+)\]", reason)
    return f"({float(found[1]):.2f}, {float(found[2]):.2f})" if found else reason


def _sense_problem(loop: Loop, sense: int) -> tuple[str, str, str] | None:
    if sense * signed_area(loop) > 0:
        return None
    return "K105", "runs the wrong way round", "outer loops run counter-clockwise, holes clockwise"


def _reference_faults(model: Model) -> Iterator[Fault]:
    """Names and numbers that point nowhere."""
    names = {board.name for board in model.boards}
    for field, name in _named(model):
        if name not in names:
            yield Fault("K108", field, shown(repr(name)), "no board has this name")
    for field, index in _numbered(model):
        if not 0 <= index < len(model.contacts):
            yield Fault("K108", field, str(index), f"the model has {len(model.contacts)} contacts, counted from 0")
    for k, contact in enumerate(model.contacts):
        if contact.a == contact.b:
            yield Fault("K108", f"contacts[{k}]", shown(repr(contact.a)), "a board cannot touch itself", (contact.a,))


def _named(model: Model) -> Iterator[tuple[str, str]]:
    for k, contact in enumerate(model.contacts):
        yield f"contacts[{k}].a", contact.a
        yield f"contacts[{k}].b", contact.b
    for k, board in enumerate(model.boards):
        if board.same_as is not None:
            yield f"boards[{k}] {shown(repr(board.name))}.same_as", board.same_as
    for k, step in enumerate(model.build_steps):
        for name in step.boards:
            yield f"build_steps[{k}].boards", name


def _numbered(model: Model) -> Iterator[tuple[str, int]]:
    for k, connector in enumerate(model.connectors):
        yield f"connectors[{k}].contact", connector.contact
    for i, board in enumerate(model.boards):
        for k, bevel in enumerate(board.bevels):
            if bevel.contact is not None:
                yield f"boards[{i}] {shown(repr(board.name))}.bevels[{k}].contact", bevel.contact
