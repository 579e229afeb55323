"""Bumps and bites in straight edges, taken off where the photographs show the straight edge as well.

A shadow beside a board, or a dark place in a corner, makes the mask leave an edge that runs on straight behind it.
Where two straight stretches lie on one line, or end before their corner, the line and the boundary that the mask took
are compared in all views: what lies on the sheet plane steps at one place in all of them, a shadow on the floor does
not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.polygon import orient

__all__ = ["Shown", "straightened"]

STEP = 1.0  # mm between points
TOLERANCE = 1.0  # mm by which points of one straight stretch leave its line
LEAST_RUN = 25.0  # mm; a shorter stretch tells no line
COLLINEAR = 0.9995  # cosine of stretches of one line
ON_LINE = 1.0  # mm across
CORNER = 0.3  # sine of the least angle of a corner
LONGEST = 80.0  # mm of a bump, from stretch to stretch; half of it from stretch to corner
LEAST_DEPTH = 1.5  # mm by which a bump leaves the lines; less is for the exact boundary to find
DEEPEST = 25.0  # mm
PAD = 20.0  # mm of the stretches on both sides that a bump is compared with
AS_CLEAR = 0.85  # of the mask's own edge: the line must be shown about as clearly
USUAL = 0.6  # of the edge beside the bump
LEAST_SHOWN = 0.3  # share of the points that some view shows
AHEAD = 3  # straight stretches ahead that may go on in one line: a bump may have straight sides

# strength of the edge at (N, 2) points of an open line in order, material on the left; NaN where no view shows it
Shown = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class _Bump:
    """A stretch of a ring between two straight ones, and what may take its place."""

    before: np.ndarray  # (N, 2) points of the straight stretch that leads to it
    points: np.ndarray  # of the bump
    after: np.ndarray  # of the straight stretch behind it
    instead: np.ndarray  # the line's points, or those of the corner
    rest: np.ndarray  # of the ring beyond `after`

    def lies_off(self) -> bool:
        """Whether it leaves the lines by more than the exact boundary could find, and by no more than a bump does."""
        line = LineString([self.before[-1], *self.instead, self.after[0]])
        depth = float(shapely.distance(shapely.points(self.points), line).max(initial=0.0))
        return LEAST_DEPTH < depth < DEEPEST

    def without(self) -> np.ndarray:
        """The ring's points with the bump taken off."""
        return np.concatenate([self.before, self.instead, self.after, self.rest])


def straightened(piece: Polygon, shown: Shown) -> Polygon:
    """The piece with bumps of its rings replaced by the line, or the corner, that the photographs show."""
    piece = orient(piece)
    outer, *holes = (_without_bumps(_sampled(ring), shown) for ring in (piece.exterior, *piece.interiors))
    made = Polygon(outer, holes)
    return made if made.is_valid else piece


def _sampled(ring) -> np.ndarray:
    """(N, 2) points at even spacing, the first where the ring is furthest from its middle: at a corner, if it has any.
    """
    count = max(8, round(ring.length / STEP))
    points = shapely.get_coordinates(shapely.line_interpolate_point(ring, np.arange(count) * ring.length / count))
    return np.roll(points, -int(np.linalg.norm(points - points.mean(0), axis=1).argmax()), axis=0)


def _without_bumps(ring: np.ndarray, shown: Shown) -> np.ndarray:
    """One bump after another is taken off, until the photographs speak for all that are left."""
    kept: set[bytes] = set()
    while True:
        bump = next((b for b in _bumps(ring) if b.points.tobytes() not in kept), None)
        if bump is None:
            return ring
        kept.add(bump.points.tobytes())
        if _is_unfounded(bump, shown):
            ring = bump.without()


def _bumps(ring: np.ndarray) -> Iterator[_Bump]:
    runs = _straight_runs(ring)
    for k, (first, last) in enumerate(runs):
        turned = np.roll(ring, -first, axis=0)
        for ahead in range(1, min(AHEAD + 1, len(runs))):
            other_first, other_last = ((i - first) % len(ring) for i in runs[(k + ahead) % len(runs)])
            if other_last < other_first:
                continue
            bump = _bump(*np.split(turned, [last - first + 1, other_first, other_last + 1]), corner=ahead == 1)
            if bump is not None and bump.lies_off():
                yield bump


def _bump(
    before: np.ndarray, points: np.ndarray, after: np.ndarray, rest: np.ndarray, corner: bool
) -> _Bump | None:
    """What lies between two straight stretches that go on in one line or meet in a corner; None when they do neither.

    Stretches that run on past their corner are cut off there.
    """
    if not len(points):
        return None
    instead = _instead(before, after, corner)
    if instead is None or not len(instead):
        return None if instead is None else _Bump(before, points, after, instead, rest)
    ends, starts = (s @ _direction(s) for s in (before, after))
    keep = int((ends < instead[0] @ _direction(before)).sum())
    skip = int((starts <= instead[0] @ _direction(after)).sum())
    if min(keep, len(after) - skip) < LEAST_RUN / STEP / 2:
        return None
    return _Bump(before[:keep], np.concatenate([before[keep:], points, after[:skip]]), after[skip:], instead, rest)


def _direction(stretch: np.ndarray) -> np.ndarray:
    """Unit vector from the first point to the last."""
    return (stretch[-1] - stretch[0]) / np.linalg.norm(stretch[-1] - stretch[0])


def _straight_runs(ring: np.ndarray) -> list[tuple[int, int]]:
    """First and last point of each straight stretch that is long enough, in order."""
    simple = LineString([*ring, ring[0]]).simplify(TOLERANCE)
    corners = shapely.get_coordinates(simple)[:-1]
    at = [int(np.linalg.norm(ring - c, axis=1).argmin()) for c in corners]
    pairs = zip(at, [*at[1:], len(ring) - 1], strict=True)
    return [(i, j) for i, j in pairs if np.linalg.norm(ring[j] - ring[i]) > LEAST_RUN]


def _instead(before: np.ndarray, after: np.ndarray, corner: bool) -> np.ndarray | None:
    """(K, 2) points from one straight stretch to another: none on one line, that of the corner, or None."""
    a, b = _direction(before), _direction(after)
    chord = after[0] - before[-1]
    sine = float(a[0] * b[1] - a[1] * b[0])
    if a @ b > COLLINEAR:
        off = max(abs(float(a[0] * d[1] - a[1] * d[0])) for d in (after[0] - before[0], after[-1] - before[0]))
        length = float(chord @ a)
        return np.zeros((0, 2)) if off < ON_LINE and 0 < length < LONGEST else None
    if not corner or abs(sine) < CORNER:
        return None
    ahead = float(chord[0] * b[1] - chord[1] * b[0]) / sine
    behind = float(chord[0] * a[1] - chord[1] * a[0]) / sine
    near = all(-DEEPEST < d < LONGEST / 2 for d in (ahead, behind))
    return (before[-1] + ahead * a)[None] if near else None


def _is_unfounded(bump: _Bump, shown: Shown) -> bool:
    """Whether the views show the line about as clearly as the bump, and as clearly as its neighbours."""
    pads = bump.before[-int(PAD / STEP):], bump.after[: int(PAD / STEP)]
    line = _dense(np.array([pads[0][-1], *bump.instead, pads[1][0]]))
    new, beside = _strength(pads, line, shown)
    old, _ = _strength(pads, bump.points, shown)
    if np.isfinite(new).mean() < LEAST_SHOWN:
        return False
    founded = np.nanmean(old) if np.isfinite(old).any() else 0.0
    usual = np.nanmean(beside) if np.isfinite(beside).any() else 0.0
    return bool(np.nanmean(new) > max(AS_CLEAR * founded, USUAL * usual))


def _dense(corners: np.ndarray) -> np.ndarray:
    """Points a step apart between the ends of a line, both left out."""
    line = LineString(corners)
    at = np.linspace(0, line.length, max(3, round(line.length / STEP)))[1:-1]
    return shapely.get_coordinates(shapely.line_interpolate_point(line, at))


def _strength(pads: tuple[np.ndarray, np.ndarray], points: np.ndarray, shown: Shown) -> tuple[np.ndarray, np.ndarray]:
    """Strength along points between two pads, and along the pads."""
    found = shown(np.concatenate([pads[0], points, pads[1]]))
    first, last = len(pads[0]), len(pads[0]) + len(points)
    return found[first:last], np.concatenate([found[:first], found[last:]])
