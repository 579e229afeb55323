"""Constraint segments on the raster: what they forbid and where they let the boundary run for nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.refine.segment.grid import Grid

__all__ = ["Limit", "carve", "fill_to_contacts", "limits_of", "margins", "neighbours"]

SLANT = 0.02  # sine of the tilt under which a cut face counts as square
PARALLEL = 0.995
BRIDGE = 80.0  # mm between two segments of one contact that are taken for pieces of one
ON_LINE = 1.0  # mm across, of segments on one line
TOUCHING = ("contact", "corner", "ground")  # origins of segments that the board reaches
PHOTO_SLACK = 3.0  # mm by which an edge that assembly saw in the photographs may be off: the outline tells it exactly


@dataclass(frozen=True, eq=False)
class Limit:
    """A constraint segment in the plane, at the largest extent over the thickness. Material on the left."""

    start: np.ndarray
    end: np.ndarray
    standard_error: float
    touching: bool = True  # the board is known to reach it
    deep: float = np.inf  # the excluded strip ends here: another constraint has material beyond

    @property
    def along(self) -> np.ndarray:
        """Unit vector from start to end."""
        return (self.end - self.start) / np.linalg.norm(self.end - self.start)

    @property
    def inward(self) -> np.ndarray:
        """Unit normal into the material."""
        return np.array([-self.along[1], self.along[0]])

    def local(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Distance along and across (positive into the material) of (..., 2) points, and the segment's length."""
        d = xy - self.start
        return d @ self.along, d @ self.inward, float(np.linalg.norm(self.end - self.start))


def limits_of(segments: Sequence[ConstraintSegment], thickness: float, reach: float) -> list[Limit]:
    """The segments of one board as limits: slanted ones moved to their largest extent, open corners closed, depths set.

    A gap of up to `reach` mm to where a segment meets a neighbour's line is closed, or corners stay open.
    """
    segments = [s for s in segments if np.linalg.norm(s.end - s.start) > 0]
    flat = [_widest(s, segments, thickness) for s in segments]
    joined = [*(_extended(limit, flat, reach) for limit in flat), *_bridges(segments, flat)]
    return [replace(limit, deep=_depth(limit, joined)) for limit in joined]


def _bridges(segments: Sequence[ConstraintSegment], limits: Sequence[Limit]) -> list[Limit]:
    """The gaps between segments of one contact on one line: the board need not reach it there, but cannot go beyond.

    Contacts come in pieces where the rough outline is ragged.
    """
    found = []
    for limit, follower, gap in _followers(segments, limits):
        if gap < BRIDGE:
            found.append(replace(limit, start=limit.end, end=follower.start, touching=False))
    return found


def _followers(
    segments: Sequence[ConstraintSegment], limits: Sequence[Limit]
) -> list[tuple[Limit, Limit, float]]:
    """Each limit with the next one of its contact on its line, and the gap between the two, mm."""
    pairs = []
    for segment, limit in zip(segments, limits, strict=True):
        ahead = []
        for other_segment, other in zip(segments, limits, strict=True):
            gap, across, _ = limit.local(other.start)
            same = (other_segment.origin, other_segment.contact) == (segment.origin, segment.contact)
            on_line = abs(across) < ON_LINE and limit.along @ other.along > PARALLEL
            gap -= np.linalg.norm(limit.end - limit.start)
            if other is not limit and same and on_line and gap > 0:
                ahead.append((float(gap), other))
        if ahead:
            gap, follower = min(ahead, key=lambda found: found[0])
            pairs.append((limit, follower, gap))
    return pairs


def _shift(segment: ConstraintSegment, z: float) -> float:
    """How far outward the cut face lies at height z, from where the segment says it is."""
    n = segment.normal
    if n is None or np.hypot(n[0], n[1]) < SLANT:
        return 0.0
    return float(-n[2] * (z - segment.depth) / np.hypot(n[0], n[1]))


def _widest(segment: ConstraintSegment, others: Sequence[ConstraintSegment], thickness: float) -> Limit:
    """The segment where the material reaches furthest: two bevels on one stretch make a pointed end."""
    limit = Limit(segment.start, segment.end, segment.standard_error, segment.origin in TOUCHING)
    if segment.origin == "photo":
        out = PHOTO_SLACK * limit.inward
        return replace(limit, start=limit.start - out, end=limit.end - out)
    if segment.normal is None or abs(segment.normal[2]) < SLANT:
        return limit
    partners = [o for o in others if o is not segment and _same_stretch(limit, o)]
    heights = [0.0, thickness, *np.linspace(0.0, thickness, 65)[1:-1]]
    own = np.array([_shift(segment, z) for z in heights])
    free = own.copy()
    for partner in partners:
        across = -limit.local(np.asarray(partner.start))[1]
        free = np.minimum(free, [across + _shift(partner, z) for z in heights])
    move = -free.max() * limit.inward
    return replace(limit, start=limit.start + move, end=limit.end + move)


def _same_stretch(limit: Limit, other: ConstraintSegment) -> bool:
    direction = (other.end - other.start) / np.linalg.norm(other.end - other.start)
    if direction @ limit.along < PARALLEL:
        return False
    ends, across, length = limit.local(np.stack([other.start, other.end]))
    return bool(ends.min() < length and ends.max() > 0 and abs(across).max() < length)


def _extended(limit: Limit, others: Sequence[Limit], reach: float) -> Limit:
    """Run on to the lines of the neighbours, where these are near."""
    stretch = [0.0, 0.0]
    _, _, length = limit.local(limit.start)
    for other in others:
        cross = float(limit.along @ other.inward)
        if other is limit or abs(cross) < 1 - PARALLEL:
            continue
        at = float((other.start - limit.start) @ other.inward) / cross
        along_other = float((limit.start + at * limit.along - other.start) @ other.along)
        if not -reach <= along_other <= float(np.linalg.norm(other.end - other.start)) + reach:
            continue
        if -reach <= at < 0:
            stretch[0] = max(stretch[0], -at)
        if length < at <= length + reach:
            stretch[1] = max(stretch[1], at - length)
    return replace(limit, start=limit.start - stretch[0] * limit.along, end=limit.end + stretch[1] * limit.along)


def _depth(limit: Limit, others: Sequence[Limit]) -> float:
    """How far the excluded strip reaches: to the next segment with material on its far side."""
    deep = np.inf
    for other in others:
        if limit.along @ other.along > -PARALLEL:
            continue
        ends, across, length = limit.local(np.stack([other.start, other.end]))
        if ends.min() < length and ends.max() > 0 and across.max() < 0:
            deep = min(deep, float(-across.mean()))
    return deep


def fill_to_contacts(mask: np.ndarray, limits: Sequence[Limit], grid: Grid, reach: float) -> np.ndarray:
    """The mask, run on to the segments that the board is known to reach: straight from each, up to `reach` mm."""
    filled = mask.copy()
    for limit in (m for m in limits if m.touching):
        _, _, length = limit.local(limit.start)
        along = np.arange(0, length, grid.pixel / 2)
        deep = np.arange(grid.pixel / 4, reach, grid.pixel / 2)
        xy = limit.start + along[:, None, None] * limit.along + deep[None, :, None] * limit.inward
        held = grid.lookup(mask, xy.reshape(-1, 2), False).reshape(xy.shape[:2])
        first = np.where(held.any(1), held.argmax(1), 0)
        row_column = np.floor((xy - grid.origin) / grid.pixel).astype(int)[np.arange(len(deep)) < first[:, None]]
        inside = (row_column >= 0).all(1) & (row_column < grid.shape[::-1]).all(1)
        filled[row_column[inside, 1], row_column[inside, 0]] = True
    return filled


def margins(limits: Sequence[Limit], width: float) -> Polygon:
    """Strips of `width` mm just past the segments that the board is known to reach."""
    strips = [(limit, width * limit.inward) for limit in limits if limit.touching]
    return shapely.union_all([Polygon([m.start, m.end, m.end - out, m.start - out]) for m, out in strips])


def carve(limits: Sequence[Limit], grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Excluded pixels, and (4, rows, cols) where a step right, down, down-right, down-left crosses a segment."""
    excluded, crossing = np.zeros(grid.shape, bool), np.zeros((4, *grid.shape), bool)
    centres = grid.centres()
    for limit in limits:
        along, across, length = limit.local(centres)
        beside = (along >= 0) & (along <= length)
        excluded |= beside & (across < 0) & (across > -limit.deep)
        for k, (dy, dx) in enumerate(((0, 1), (1, 0), (1, 1), (1, -1))):
            here, there = neighbours(across >= 0, dy, dx)
            near_here, near_there = neighbours(beside, dy, dx)
            view, _ = neighbours(crossing[k], dy, dx)
            view |= (here != there) & near_here & near_there
    return excluded, crossing


def neighbours(values: np.ndarray, dy: int, dx: int) -> tuple[np.ndarray, np.ndarray]:
    """Views of each pixel and its neighbour at (dy, dx)."""
    rows, columns = values.shape
    left = slice(max(0, -dx), columns - max(0, dx))
    right = slice(max(0, dx), columns - max(0, -dx))
    return values[: rows - dy, left], values[dy:, right]
