"""From a sheet and its fitted cut path to a board of the model: its own frame, bevels, and where each number comes
from.
"""

from __future__ import annotations

import numpy as np

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.types import Sheet
from kerfwright.model import Arc, Bevel, Board, Circle, CutPath, Line, Origin, Quantity
from kerfwright.model.frames import rows
from kerfwright.model.geometry import transform_path

__all__ = ["to_board"]

ON_SEGMENT = 0.05  # mm; fitted edges lie on their constraint segments to rounding


def to_board(
    sheet: Sheet, path: CutPath, segments: tuple[ConstraintSegment, ...], origin: str, notes: tuple[str, ...] = ()
) -> Board:
    """A board with +x along its longest straight edge and the cut path's lower left corner at the origin."""
    turn, shift = _own_frame(path)
    model_from_board = sheet.world_from_board.copy()
    model_from_board[:3, 3] += sheet.world_from_board[:3, :2] @ (turn.T @ shift)
    model_from_board[:3, :2] = sheet.world_from_board[:3, :2] @ turn.T
    bevels = [_bevel(path, s, sheet, turn, shift) for s in segments if s.normal is not None]
    points = len(sheet.top_idx) + len(sheet.bottom_idx) + len(sheet.cut_idx)
    return Board(
        name=sheet.name, model_from_board=rows(model_from_board), thickness=sheet.thickness,
        cut_path=transform_path(path, np.c_[turn, -shift]),
        bevels=tuple(b for b in bevels if b is not None), outline_origin=origin, points=points, notes=notes,
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
    point = np.array([*(turn @ segment.start - shift), segment.depth])
    return Bevel(
        start=tuple(map(float, place[0])), end=tuple(map(float, place[1])), point=tuple(map(float, point)),
        normal=tuple(map(float, normal)), angle=Quantity(value=float(angle), origin=Origin.IMPLIED),
        contact=segment.contact,
    )


def _overlap(edge: Line, segment: ConstraintSegment, along: np.ndarray) -> float:
    own = sorted(float((np.asarray(p) - segment.start) @ along) for p in (edge.start, edge.end))
    return min(own[1], float(np.linalg.norm(segment.end - segment.start))) - max(own[0], 0.0)
