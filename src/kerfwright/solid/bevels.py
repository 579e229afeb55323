"""What a bevel takes away, as convex bodies.

A bevel cuts along its own stretch of the outline only: a half-space would also cut whatever of a non-convex board lies
beyond it. How far the cut runs past the two ends of its stretch follows from the corners there:

- at a convex corner it runs out of the board, as far as the outline stays within the depth of the cut;
- at a reflex corner it stops at the neighbouring cut face, bevelled or square, so that the two meet along one line;
- where the outline goes straight on, it stops square to the stretch.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from kerfwright.errors import ModelError
from kerfwright.model import Bevel, Board, Line
from kerfwright.model.geometry import edge_tangents, sample_loop

__all__ = ["HalfSpace", "bevel_bodies", "polyhedron_faces"]

STRETCH_TOLERANCE = 0.01  # mm between a bevel's stretch and the outline; ten microns is what the solids must hold
SNAP = 1e-4  # mm: a bevel that leaves less of the square edge than this leaves none
OVERCUT = 0.05  # mm by which a cutter stands out of the board, so that no two faces coincide
STRAIGHT = 1e-3  # rad of turn below which two edges go straight on


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Points x with normal @ x >= offset, board frame."""

    normal: np.ndarray  # (3,)
    offset: float


@dataclass(frozen=True, eq=False)
class _Stretch:
    """A bevel's stretch in the sense of the outline: x_in_board = origin + s * along + u * inward, z as it is."""

    origin: np.ndarray  # (2,)
    along: np.ndarray  # (2,)
    length: float
    first: int  # index of the edge that the stretch starts on
    last: int
    at_start: bool  # whether it starts where that edge starts
    at_end: bool

    @property
    def inward(self) -> np.ndarray:
        return np.array([-self.along[1], self.along[0]])

    def local(self, points: np.ndarray) -> np.ndarray:
        """(s, u) of points (N, 2)."""
        return (np.asarray(points) - self.origin) @ np.stack([self.along, self.inward], axis=1)


def bevel_bodies(board: Board) -> list[list[HalfSpace]]:
    """The bodies that the board's bevels cut away from its extruded outline, each an intersection of half-spaces.

    Raises
    ------
    ModelError
        If a bevel's stretch does not lie on a straight edge of the outline.
    """
    stretches = [_stretch(board, k) for k in range(len(board.bevels))]
    return [body for k in range(len(board.bevels)) for body in _bodies(board, stretches, k)]


def _stretch(board: Board, index: int) -> _Stretch:
    bevel = board.bevels[index]
    ends = np.array([bevel.start, bevel.end])
    first, last = (_edge_at(board, p, ends) for p in ends)
    if first is None or last is None:
        raise ModelError(
            f"board {board.name!r}: bevels[{index}]: stretch {bevel.start} {bevel.end} is not on a straight edge "
            "of the outline: give two points of one"
        )
    edges = board.cut_path.outer.edges
    if (ends[1] - ends[0]) @ edge_tangents(edges[first], [0.5])[0] < 0:
        ends, first, last = ends[::-1], last, first
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    at_start = np.hypot(*(ends[0] - edges[first].start)) <= STRETCH_TOLERANCE
    at_end = np.hypot(*(ends[1] - edges[last].end)) <= STRETCH_TOLERANCE
    return _Stretch(ends[0], along / length, length, first, last, bool(at_start), bool(at_end))


def _edge_at(board: Board, point: np.ndarray, ends: np.ndarray) -> int | None:
    """Index of the straight edge that runs along the stretch and holds the point."""
    direction = ends[1] - ends[0]
    length = np.hypot(*direction)
    for k, edge in enumerate(board.cut_path.outer.edges):
        if not isinstance(edge, Line) or length == 0:
            continue
        a, b = np.array(edge.start), np.array(edge.end)
        along = (b - a) / np.hypot(*(b - a))
        s, across = (point - a) @ along, _cross(along, point - a)
        within = -STRETCH_TOLERANCE <= s <= np.hypot(*(b - a)) + STRETCH_TOLERANCE
        parallel = abs(_cross(along, direction)) <= STRETCH_TOLERANCE
        if parallel and within and abs(across) <= STRETCH_TOLERANCE:
            return k
    return None


def _cross(a: np.ndarray, b: np.ndarray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _bodies(board: Board, stretches: list[_Stretch], index: int) -> Iterator[list[HalfSpace]]:
    """One body, or several where a reflex corner's neighbour is itself pointed."""
    stretch, bevel = stretches[index], board.bevels[index]
    plane = _plane(bevel, stretch, board.thickness.value)
    deepest = _depths(plane, stretch, board.thickness.value).max()
    if deepest <= SNAP:
        return
    sides = [*_slab(board.thickness.value), _upright(-stretch.inward, stretch.origin - OVERCUT * stretch.inward, False)]
    ends = [_end(board, stretches, stretch, deepest, at_start) for at_start in (True, False)]
    for start_plane, end_plane in product(*ends):
        yield [plane, *sides, start_plane, end_plane]


def _plane(bevel: Bevel, stretch: _Stretch, thickness: float) -> HalfSpace:
    """The half-space beyond the bevel's plane; an edge that it all but reaches is taken as reached."""
    normal = np.array(bevel.normal) / np.linalg.norm(bevel.normal)
    plane = HalfSpace(normal, float(normal @ bevel.point))
    least = _depths(plane, stretch, thickness).min()
    if abs(least) > SNAP:
        return plane
    return HalfSpace(normal, plane.offset - least * float(normal[:2] @ stretch.inward))


def _depths(plane: HalfSpace, stretch: _Stretch, thickness: float) -> np.ndarray:
    """How deep the plane lies behind the square edge at the stretch's ends, bottom and top, (4,) mm."""
    slope = float(plane.normal[:2] @ stretch.inward)
    if slope >= 0:
        raise ModelError(
            f"bevel normal {plane.normal.round(4).tolist()} points into the board: give the outward normal"
        )
    s, z = np.array(list(product((0, stretch.length), (0, thickness)))).T
    at_edge = (stretch.origin + s[:, None] * stretch.along) @ plane.normal[:2] + z * plane.normal[2]
    return (plane.offset - at_edge) / slope


def _slab(thickness: float) -> list[HalfSpace]:
    up = np.array([0.0, 0, 1])
    return [HalfSpace(up, -OVERCUT), HalfSpace(-up, -thickness - OVERCUT)]


def _upright(normal: np.ndarray, point: np.ndarray, beyond: bool) -> HalfSpace:
    """Half-space bounded by an upright plane through a point: beyond it along the normal, or before it."""
    sign = 1.0 if beyond else -1.0
    n = np.array([*normal, 0.0]) * sign
    return HalfSpace(n, float(n[:2] @ point))


def _end(board: Board, stretches: list[_Stretch], stretch: _Stretch, deepest: float, at_start: bool) -> list[HalfSpace]:
    """What bounds the cut at one end of its stretch: one half-space, or one for each face of a pointed neighbour."""
    corner = stretch.origin if at_start else stretch.origin + stretch.length * stretch.along
    onward = -stretch.along if at_start else stretch.along
    turn = _turn(board, stretch, at_start)
    if turn > STRAIGHT:
        return [_upright(onward, corner + _overrun(board, stretch, deepest, at_start) * onward, False)]
    if turn > -STRAIGHT:
        return [_upright(onward, corner, False)]
    return _neighbour_planes(board, stretches, stretch, at_start)


def _turn(board: Board, stretch: _Stretch, at_start: bool) -> float:
    """Left turn of the outline at the end of the stretch, radians; over the depth of a cut, so that an arc counts."""
    if not (stretch.at_start if at_start else stretch.at_end):
        return 0.0
    edges = board.cut_path.outer.edges
    neighbour = edges[(stretch.first - 1) % len(edges)] if at_start else edges[(stretch.last + 1) % len(edges)]
    if isinstance(neighbour, Line):
        tangent = edge_tangents(neighbour, [0.5])[0]
        return float((-1 if at_start else 1) * np.arcsin(np.clip(_cross(stretch.along, tangent), -1, 1)))
    local = stretch.local(_walk(board, stretch, at_start)[1:2])[0]  # first sample along the curve
    ahead = -local[0] if at_start else local[0] - stretch.length
    return float(np.arctan2(local[1], ahead))


def _walk(board: Board, stretch: _Stretch, at_start: bool) -> np.ndarray:
    """The outline's points (N, 2) from the end of the stretch onward, once round."""
    edges = board.cut_path.outer.edges
    count = len(edges)
    order = [(stretch.last + 1 + k) % count for k in range(count)]
    points = sample_loop(board.cut_path.outer.model_copy(update={"edges": tuple(edges[k] for k in order)}))
    if not at_start:
        return points
    order = [(stretch.first + k) % count for k in range(count)]
    points = sample_loop(board.cut_path.outer.model_copy(update={"edges": tuple(edges[k] for k in order)}))
    return np.concatenate([points[:1], points[:0:-1]])


def _overrun(board: Board, stretch: _Stretch, deepest: float, at_start: bool) -> float:
    """How far past its end the stretch's cut still finds material, mm."""
    s, u = stretch.local(_walk(board, stretch, at_start)).T
    ahead = -s if at_start else s - stretch.length
    deep = u > deepest
    stop = int(deep.argmax()) if deep.any() else len(u)
    reach = ahead[:stop].max()
    if 0 < stop < len(u):
        part = (deepest - u[stop - 1]) / (u[stop] - u[stop - 1])
        reach = max(reach, ahead[stop - 1] + part * (ahead[stop] - ahead[stop - 1]))
    return max(0.0, float(reach)) + OVERCUT


def _neighbour_planes(board: Board, stretches: list[_Stretch], stretch: _Stretch, at_start: bool) -> list[HalfSpace]:
    """The faces that meet the stretch at a reflex corner: the neighbour's bevels, or its square cut."""
    edges = board.cut_path.outer.edges
    index = (stretch.first - 1) % len(edges) if at_start else (stretch.last + 1) % len(edges)
    found = [
        _plane(bevel, other, board.thickness.value)
        for bevel, other in zip(board.bevels, stretches, strict=True)
        if (other.last == index and other.at_end if at_start else other.first == index and other.at_start)
    ]
    tangent = edge_tangents(edges[index], [1.0 if at_start else 0.0])[0]
    square = _upright(
        np.array([tangent[1], -tangent[0]]), np.array(edges[index].end if at_start else edges[index].start), True
    )
    return [p for p in found if abs(p.normal[2]) > 1e-9] or [square]


def polyhedron_faces(body: list[HalfSpace]) -> list[np.ndarray]:
    """The faces of a bounded intersection of half-spaces, each a polygon (N, 3) counter-clockwise seen from outside.

    Every vertex is a point where three of the planes meet and that all half-spaces hold: with less than ten planes,
    trying all triples is the shortest exact way.
    """
    normals = np.array([h.normal for h in body])
    offsets = np.array([h.offset for h in body])
    triples = [t for t in map(list, combinations(range(len(body)), 3)) if abs(np.linalg.det(normals[t])) > 1e-9]
    points = np.array([np.linalg.solve(normals[t], offsets[t]) for t in triples])
    points = points[(points @ normals.T >= offsets - 1e-7).all(axis=1)]
    points = points[np.unique(points.round(6), axis=0, return_index=True)[1]] if len(points) else points
    faces = (_face(points[np.abs(points @ n - o) < 1e-6], n) for n, o in zip(normals, offsets, strict=True))
    return [face for face in faces if len(face) >= 3]


def _face(points: np.ndarray, inward: np.ndarray) -> np.ndarray:
    """Points of one face in order round it, counter-clockwise seen against the inward normal."""
    if len(points) < 3:
        return points
    u = np.cross(inward, np.eye(3)[np.abs(inward).argmin()])
    v = np.cross(u, inward)  # u, v, -inward are right-handed
    spokes = points - points.mean(axis=0)
    return points[np.argsort(np.arctan2(spokes @ v, spokes @ u))]
