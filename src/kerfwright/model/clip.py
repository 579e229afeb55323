"""Loops without what lies in a convex polygon: exact pieces of their edges, joined along the polygon's sides."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kerfwright.model.cutpath import Circle, Edge, Line, Loop
from kerfwright.model.geometry import edge_points, edge_start
from kerfwright.model.pieces import edge_piece

__all__ = ["ConvexArea", "clipped_loop"]

_PROBES = np.linspace(0, 1, 129)  # where an edge is asked whether it is inside; less than this is no excursion
_HALVINGS = 50  # of a parameter between two probes: down to rounding
SHORTEST = 1e-3  # mm; OCCT makes no edge of less


@dataclass(frozen=True, eq=False)
class ConvexArea:
    """Points x with normals @ x < offsets; `cutting` tells which sides may become edges of a loop."""

    corners: np.ndarray  # (N, 2), counter-clockwise; side k runs from corner k to the next
    cutting: np.ndarray  # (N,) bool

    @property
    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """Outward unit normals (N, 2) and offsets (N,) in mm."""
        along = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
        return normals, (normals * self.corners).sum(axis=1)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """How far points (M, 2) lie inside, mm; below 0 outside."""
        normals, offsets = self.sides
        return (offsets - points @ normals.T).min(axis=1)


def clipped_loop(loop: Loop, area: ConvexArea) -> Loop | None:
    """The loop, material on its left, without the area; None where it does not cross the area's cutting sides."""
    if isinstance(loop.edges[0], Circle):
        return None
    pieces = [piece for edge in loop.edges for piece in _split(edge, area)]
    first = next((k for k, (_, inside) in enumerate(pieces) if not inside), None)
    if first is None or not any(inside for _, inside in pieces):
        return None
    edges: list[Edge] = []
    run: list[Edge] = []
    for piece, inside in [*pieces[first:], *pieces[:first], pieces[first]]:
        if inside:
            run.append(piece)
            continue
        if run:
            chain = _way_round(area, np.array(run[0].start), np.array(run[-1].end))
            if chain is None:
                return None
            edges, run = edges + chain, []
        edges.append(piece)
    return _joined(edges[:-1])


def _split(edge: Edge, area: ConvexArea) -> list[tuple[Edge, bool]]:
    """The edge in pieces, each with whether it lies inside."""
    inside = area.depth(edge_points(edge, _PROBES)) > 0
    changes = np.flatnonzero(inside[1:] != inside[:-1])
    cuts = [0.0, *(_crossing(edge, area, _PROBES[k], _PROBES[k + 1]) for k in changes), 1.0]
    states = [bool(inside[0]), *(bool(inside[k + 1]) for k in changes)]
    return [(edge_piece(edge, a, b), state) for (a, b), state in zip(pairwise(cuts), states, strict=True) if b > a]


def _crossing(edge: Edge, area: ConvexArea, low: float, high: float) -> float:
    """The parameter between two at which the edge enters or leaves the area."""
    before = area.depth(edge_points(edge, np.array([low])))[0] > 0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if (area.depth(edge_points(edge, np.array([middle])))[0] > 0) == before:
            low = middle
        else:
            high = middle
    return high


def _way_round(area: ConvexArea, start: np.ndarray, end: np.ndarray) -> list[Edge] | None:
    """Lines along the area's border, the area on their right; None where a side on the way may not become an edge."""
    normals, offsets = area.sides
    count = len(area.corners)
    at, last = (int(np.abs(offsets - normals @ p).argmin()) for p in (start, end))
    points, sides = [start], [at]
    while at != last or (len(sides) == 1 and _ahead(area, at, start, end) > 0):
        points.append(area.corners[at])  # clockwise: a side is left at the corner where it begins
        at = (at - 1) % count
        sides.append(at)
        if len(sides) > count:
            return None
    if not area.cutting[sides].all():
        return None
    points.append(end)
    kept = [points[0], *(p for p in points[1:-1] if min(np.hypot(*(p - start)), np.hypot(*(p - end))) > SHORTEST)]
    return [Line(start=tuple(map(float, a)), end=tuple(map(float, b))) for a, b in pairwise([*kept, end])]


def _ahead(area: ConvexArea, side: int, start: np.ndarray, end: np.ndarray) -> float:
    """How far along a side, counter-clockwise, one point of it lies beyond another: above 0 the way round is long."""
    along = np.roll(area.corners, -1, axis=0)[side] - area.corners[side]
    return float((end - start) @ along)


def _joined(edges: list[Edge]) -> Loop:
    """The edges as a loop, those of no length dropped, each ending where the next one starts."""
    kept = [e for e in edges if np.hypot(*np.subtract(e.end, e.start)) > SHORTEST]
    onward = [*kept[1:], kept[0]]
    return Loop(edges=tuple(e.model_copy(update={"end": edge_start(n)}) for e, n in zip(kept, onward, strict=True)))
