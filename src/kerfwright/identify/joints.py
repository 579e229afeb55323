"""Where a board ends on another's sheet plane (paper, Connections; supplement, Inferring Connection Types).

A board b ends on a sheet plane of a when, column by column along the line in which that plane cuts b, the board starts
within reach of the plane on its outer side and does not go on behind a. Columns are counted only where a has wood.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.identify.types import Sheet

LEAST_SURE = 0.3  # of an interface: columns that end where most do

__all__ = ["Joint", "Search", "Trace", "columns", "end_on", "face_plane", "runs_of", "trace_of"]


@dataclass(frozen=True, eq=False)
class Trace:
    """The line in which a plane cuts a board, in the board's plane: m.xy = offset, wood where m.xy > offset, tangent
    along it.

    For a slanted plane it is the line at the height where the board reaches furthest; `slope` is how far it moves a mm
    of height.
    """

    m: np.ndarray  # (2,)
    tangent: np.ndarray  # (2,)
    offset: float
    depth: float  # height z of that line
    slope: float
    normal: np.ndarray  # (3,) outward normal of b's cut face, board frame
    sine: float  # of the angle between the sheets

    def coordinates(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 2) to distance inside the plane and position along the trace."""
        return xy @ self.m - self.offset, xy @ self.tangent

    def place(self, inside: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Back to (N, 2) in the board's plane."""
        return (self.offset + np.asarray(inside))[..., None] * self.m + np.asarray(along)[..., None] * self.tangent


def trace_of(board: Sheet, normal: np.ndarray, offset: float) -> Trace | None:
    """Trace of the world plane normal.x = offset in a board that lies where normal.x > offset; None when nearly
    parallel.
    """
    n = normal @ board.world_from_board[:3, :3]
    d = offset - normal @ board.world_from_board[:3, 3]
    flat = float(np.hypot(n[0], n[1]))
    if flat < 0.17:  # within 10 degrees of parallel there is no line to end on
        return None
    slope = -n[2] / flat
    depth = board.thickness.value if slope < 0 else 0.0
    m = n[:2] / flat
    return Trace(m, np.array([-m[1], m[0]]), d / flat + slope * depth, depth, slope, -n, flat)


@dataclass(frozen=True, eq=False)
class Joint:
    """Board b ends on a face of board a (indices into the sheets)."""

    a: int
    b: int
    face_a: str  # "top" or "bottom"
    trace: Trace  # in b
    intervals: tuple[tuple[float, float], ...]  # along the trace
    gap: float  # median distance of b's rough outline from the plane, mm; negative where it overlaps a
    ends: np.ndarray  # (K, 2) where b's rough outline ends, b's plane

    @property
    def length(self) -> float:
        """mm of the interface."""
        return sum(high - low for low, high in self.intervals)


@dataclass(frozen=True)
class Search:
    """Where a joint is looked for, mm: how far b's outline may be from the plane, how wrong outlines are, how far
    beyond its outline a may have wood, the width of a column, the shortest interface, and by how much b's outline may
    be worse than usual where it is dark.
    """

    reach: float
    slack: float
    cover: float
    step: float
    shortest: float
    ragged: float = 0.0


def end_on(sheets: tuple[Sheet, ...], a: int, b: int, search: Search) -> Joint | None:
    """Whether b ends on a, and where: the better of a's two faces."""
    found = [_end_on_face(sheets, a, b, face, search) for face in ("top", "bottom")]
    found = [j for j in found if j is not None]
    return max(found, key=lambda j: (round(j.length), -abs(j.gap))) if found else None


def _share(along: np.ndarray, flags: np.ndarray, run: tuple[float, float]) -> float:
    inside = (along >= run[0]) & (along <= run[1])
    return float(flags[inside].mean()) if inside.any() else 0.0


def face_plane(sheet: Sheet, face: str) -> tuple[np.ndarray, float]:
    """Outward normal and offset of a sheet plane, world."""
    if face == "top":
        return sheet.normal, float(sheet.normal @ sheet.world_from_board[:3, 3]) + sheet.thickness.value
    return -sheet.normal, -float(sheet.normal @ sheet.world_from_board[:3, 3])


def _end_on_face(sheets: tuple[Sheet, ...], a: int, b: int, face: str, search: Search) -> Joint | None:
    one, other, reach, slack, step = sheets[a], sheets[b], search.reach, search.slack, search.step
    trace = trace_of(other, *face_plane(one, face))
    if trace is None:
        return None
    along, first, last = columns(other.region, trace, step)
    if not len(along):
        return None
    hidden = one.thickness.value / trace.sine + slack
    ends = (first > -hidden) & (first < reach) & (last > np.maximum(first, 0.0) + 2 * slack)
    ends &= _has_wood(one, other, trace, along, search.cover)
    if not ends.any():
        return None
    usual = max(float(np.median(first[ends])), 0.0)
    sure = ends & (first < 2 * usual + slack)  # deeper columns end beside a, not before it
    ends &= first < 2 * usual + max(slack, search.ragged)  # but next to sure ones they are just badly traced
    # an outline that stops far short of the plane is ragged: what lies between two of its columns ends there as well
    runs = runs_of(along, ends, step, search.shortest, joining=max(slack, 2 * step, usual / 2))
    intervals = tuple(run for run in runs if _share(along, sure, run) > LEAST_SURE)
    if not intervals:
        return None
    inside = np.zeros(len(along), bool)
    for low, high in intervals:
        inside |= (along >= low) & (along <= high)
    own = inside & ends
    return Joint(a, b, face, trace, intervals, float(np.median(first[own])), trace.place(first[own], along[own]))


def columns(region: Polygon, trace: Trace, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions along the trace, and where the region starts and stops in each column."""
    ring = np.asarray(region.exterior.coords)
    inside, position = trace.coordinates(ring)
    along = np.arange(position.min() + step / 2, position.max(), step)
    first, last = np.full(len(along), np.inf), np.full(len(along), -np.inf)
    column, at = _crossings(along, inside, position)
    np.minimum.at(first, column, at)
    np.maximum.at(last, column, at)
    seen = first < last
    return along[seen], first[seen], last[seen]


def _crossings(along: np.ndarray, inside: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the edges of a closed ring cross columns: the column's index, and the distance inside the plane."""
    low, high = np.minimum(position[:-1], position[1:]), np.maximum(position[:-1], position[1:])
    start = np.searchsorted(along, low)
    count = np.searchsorted(along, high) - start  # an edge has its lower end, not its upper one
    edge = np.repeat(np.arange(len(count)), count)
    column = start[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    share = (along[column] - position[edge]) / (position[edge + 1] - position[edge])
    return column, inside[edge] + share * (inside[edge + 1] - inside[edge])


def _has_wood(one: Sheet, other: Sheet, trace: Trace, along: np.ndarray, reach: float) -> np.ndarray:
    """Whether a's region reaches each column of b's trace."""
    xy = trace.place(np.zeros(len(along)), along)
    middle = np.c_[xy, np.full(len(xy), other.thickness.value / 2)]
    shift = trace.slope * (other.thickness.value / 2 - trace.depth)
    middle[:, :2] += shift * trace.m
    in_a = one.to_board(other.to_world(middle))
    return shapely.contains_xy(_widened(one.region, reach), in_a[:, 0], in_a[:, 1])


@lru_cache(maxsize=256)
def _widened(region: Polygon, reach: float) -> Polygon:
    """A region with a margin; every other board asks for the same."""
    wide = region.buffer(reach)
    shapely.prepare(wide)
    return wide


def runs_of(
    along: np.ndarray, ends: np.ndarray, step: float, shortest: float, joining: float
) -> tuple[tuple[float, float], ...]:
    """Runs of columns that end on the plane, small gaps joined, short runs dropped."""
    if not ends.any():
        return ()
    places = along[ends]
    breaks = np.flatnonzero(np.diff(places) > max(joining, 1.5 * step))
    starts = np.r_[places[0], places[breaks + 1]]
    stops = np.r_[places[breaks], places[-1]]
    runs = zip(starts, stops, strict=True)
    return tuple((float(a - step / 2), float(b + step / 2)) for a, b in runs if b - a + step >= shortest)
