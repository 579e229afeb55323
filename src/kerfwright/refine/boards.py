"""From a sheet and its fitted cut path to a board of the model: its own frame, bevels, and where each number comes
from.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.types import Sheet
from kerfwright.model import Arc, Bevel, Board, Circle, CutPath, Line, Origin, Quantity
from kerfwright.model.frames import rows
from kerfwright.model.geometry import transform_path
from kerfwright.refine.types import Fitted, Twin

__all__ = ["to_board", "to_boards"]

ON_SEGMENT = 0.05  # mm; fitted edges lie on their constraint segments to rounding


def to_boards(fitted: Sequence[Fitted]) -> tuple[Board, ...]:
    """The boards of the model. A twin's cut path is that of the first of its kind, or its mirror image, to the bit."""
    out: list[Board] = []
    for board in fitted:
        if board.twin is None:
            out.append(to_board(board.sheet, board.path, board.segments, board.origin, board.notes))
        else:
            out.append(_repeat(board, board.twin, fitted[board.twin.first], out[board.twin.first]))
    return tuple(out)


def _repeat(board: Fitted, twin: Twin, first: Fitted, model: Board) -> Board:
    """A board in the frame that the first of its kind has on it; of a mirror image, x runs the other way."""
    turn, shift = _own_frame(first.path)
    motion = twin.first_from_own
    turn, shift = turn @ motion[:, :2], shift - turn @ motion[:, 2]
    path = model.cut_path
    if twin.mirrored:
        width = max(p[0] for e in path.outer.edges for p in _points_of(e))
        flip = np.array([[-1.0, 0.0, width], [0.0, 1.0, 0.0]])
        path = transform_path(path, flip)
        turn, shift = flip[:, :2] @ turn, flip[:, :2] @ shift - flip[:, 2]
    made = _framed(board.sheet, board.path, path, (turn, shift), board.segments)
    return made.model_copy(update={
        "outline_origin": board.origin, "notes": board.notes, "same_as": first.sheet.name, "mirrored": twin.mirrored,
    })  # fmt: skip


def to_board(
    sheet: Sheet, path: CutPath, segments: tuple[ConstraintSegment, ...], origin: str, notes: tuple[str, ...] = ()
) -> Board:
    """A board with +x along its longest straight edge and the cut path's lower left corner at the origin."""
    turn, shift = _own_frame(path)
    made = _framed(sheet, path, transform_path(path, np.c_[turn, -shift]), (turn, shift), segments)
    return made.model_copy(update={"outline_origin": origin, "notes": notes})


def _framed(
    sheet: Sheet, path: CutPath, own_path: CutPath, frame: tuple[np.ndarray, np.ndarray],
    segments: tuple[ConstraintSegment, ...],
) -> Board:
    """A board in the frame x_in_board = turn @ x_in_sheet - shift; `path` in the sheet's frame, `own_path` in that."""
    turn, shift = frame
    model_from_board = sheet.world_from_board.copy()
    model_from_board[:3, 3] += sheet.world_from_board[:3, :2] @ (turn.T @ shift)
    model_from_board[:3, :2] = sheet.world_from_board[:3, :2] @ turn.T
    bevels = [_bevel(path, s, sheet, turn, shift) for s in segments if s.normal is not None]
    points = len(sheet.top_idx) + len(sheet.bottom_idx) + len(sheet.cut_idx)
    return Board(
        name=sheet.name, model_from_board=rows(model_from_board), thickness=sheet.thickness, cut_path=own_path,
        bevels=tuple(b for b in bevels if b is not None), points=points,
    )


def _own_frame(path: CutPath) -> tuple[np.ndarray, np.ndarray]:
    """2x2 rotation and shift: x_in_board = turn @ x_in_sheet - shift."""
    lines = [e for e in path.outer.edges if isinstance(e, Line)]
    direction = np.array([1.0, 0.0])
    if lines:
        longest = max(lines, key=lambda e: round(np.hypot(e.end[0] - e.start[0], e.end[1] - e.start[1]), 3))
        direction = np.subtract(longest.end, longest.start)
        direction = direction / np.linalg.norm(direction)
    turn = np.array([direction, [-direction[1], direction[0]]])
    corners = np.array([turn @ np.asarray(p) for e in path.outer.edges for p in _points_of(e)])
    return turn, corners.min(axis=0)


def _points_of(edge) -> list:
    if isinstance(edge, Circle):
        c, r = np.asarray(edge.centre), edge.radius
        return [c - r, c + r]
    return [edge.start, edge.mid, edge.end] if isinstance(edge, Arc) else [edge.start, edge.end]


def _bevel(
    path: CutPath, segment: ConstraintSegment, sheet: Sheet, turn: np.ndarray, shift: np.ndarray
) -> Bevel | None:
    """The slanted cut along the edge that lies on the segment; None when no edge follows it."""
    along = segment.end - segment.start
    along = along / np.linalg.norm(along)
    inward = np.array([-along[1], along[0]])
    edges = [
        e for e in path.outer.edges if isinstance(e, Line)
        and all(abs((np.asarray(p) - segment.start) @ inward) < ON_SEGMENT for p in (e.start, e.end))
        and _overlap(e, segment, along) > 1
    ]
    if not edges:
        return None
    ends = sorted((float((np.asarray(p) - segment.start) @ along), p) for e in edges for p in (e.start, e.end))
    place = [turn @ np.asarray(p) - shift for p in (ends[0][1], ends[-1][1])]
    normal = np.array([*(turn @ segment.normal[:2]), segment.normal[2]])
    angle = np.degrees(np.arctan2(segment.normal[2], np.hypot(*segment.normal[:2])))
    middle = (segment.start + segment.end) / 2  # two planes that end a board in a point share a line; there both hold
    point = np.array([*(turn @ middle - shift), segment.depth])
    return Bevel(
        start=tuple(map(float, place[0])), end=tuple(map(float, place[1])), point=tuple(map(float, point)),
        normal=tuple(map(float, normal)), angle=Quantity(value=float(angle), origin=Origin.IMPLIED),
        contact=segment.contact,
    )


def _overlap(edge: Line, segment: ConstraintSegment, along: np.ndarray) -> float:
    own = sorted(float((np.asarray(p) - segment.start) @ along) for p in (edge.start, edge.end))
    return min(own[1], float(np.linalg.norm(segment.end - segment.start))) - max(own[0], 0.0)
