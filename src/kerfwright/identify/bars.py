"""Boards of which the cloud shows little more than both ends: rails under a seat, bars through a row of slats.

Two small plane patches that face away from each other, far apart, with one outline seen along the line between them,
are the two ends of a bar. Its sheet planes are those across the smaller side of that outline.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon, box

from kerfwright.capture.types import Capture
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.photo_edges import Photos, sweep_edge
from kerfwright.identify.thickness import ThicknessHypothesis
from kerfwright.identify.types import Primitive

__all__ = ["Bar", "find_bars"]

FACING = np.cos(np.radians(10.0))  # ends are cut square, and stereo tilts small patches
SLENDER = 2.5  # a bar is at least this many times as long as its outline is wide
SAME_OUTLINE = 0.5  # intersection over union of the two ends
CLEAR_EDGE = 2.5  # contrast of a sweep that tells where a side lies
PLACES = 40  # along a side
EXTENT = (4.0, 96.0)  # percentiles of a patch's points between which its outline lies


@dataclass(frozen=True, eq=False)
class Bar:
    """A slab between two ends; x_in_world = world_from_board @ x_in_board, +z across the smaller side."""

    world_from_board: np.ndarray
    thickness: ThicknessHypothesis
    region: Polygon
    ends: tuple[int, int]  # the planes


@dataclass(frozen=True, eq=False)
class _Ends:
    """Two end patches seen along the axis: outlines low .. high across the axes `side` and `across`."""

    axes: np.ndarray  # (3, 3) rows: side, along, across
    middle: np.ndarray  # (3,)
    low: np.ndarray  # (2,) mm about the middle, by side and across
    high: np.ndarray  # (2,)
    length: float


def find_bars(
    capture: Capture, planes: Sequence[Primitive], photos: Photos, fringe: float, options: IdentifyOptions,
) -> list[Bar]:
    """Bars between pairs of end patches, in the order of the patches; fringe: mm by which stereo widens a silhouette.
    """
    diameter, points = capture.cloud.diameter, capture.cloud.points
    least, most = options.min_thickness * diameter, options.max_thickness * diameter
    small = [k for k, p in enumerate(planes) if least < _side(points[p.point_idx]) < most]
    directions = [p.normal for p in sorted(planes, key=lambda p: -len(p.point_idx))]
    found = []
    for i, one in enumerate(small):
        for other in small[i + 1 :]:
            ends = _ends(planes[one], planes[other], points, directions)
            if ends is None:
                continue
            ends, error = _sharpened(ends, photos, fringe)
            if (ends.high - ends.low).min() > least:
                found.append(_bar(ends, error, (one, other)))
    return found


def _side(points: np.ndarray) -> float:
    """The larger extent of a patch, mm."""
    spread = points - points.mean(axis=0)
    main = np.linalg.svd(spread[:: max(1, len(spread) // 500)], full_matrices=False)[2][0]
    return float(np.ptp(np.percentile(spread @ main, EXTENT)))


def _ends(one: Primitive, other: Primitive, points: np.ndarray, directions: list[np.ndarray]) -> _Ends | None:
    if one.normal @ other.normal > -FACING:
        return None
    way = one.centroid - other.centroid
    length = float(np.linalg.norm(way))
    if length < 1e-6 or way @ one.normal < FACING * length:
        return None
    along = _nearest(way / length, directions, 3.0)
    across = next((d for d in directions if abs(d @ along) < 0.05), None)
    if across is None:
        return None
    side = np.cross(along, across)
    axes = np.array([side / np.linalg.norm(side), along, np.cross(side, along)])
    axes[2] /= np.linalg.norm(axes[2])
    middle = (one.centroid + other.centroid) / 2
    outlines = []
    for patch in (one, other):
        x = (points[patch.point_idx] - middle) @ axes[[0, 2]].T
        outlines.append(np.percentile(x, EXTENT, axis=0))
    boxes = [box(*o[0], *o[1]) for o in outlines]
    widest = max(float((o[1] - o[0]).max()) for o in outlines)
    both = boxes[0].intersection(boxes[1]).area / max(boxes[0].union(boxes[1]).area, 1e-9)
    if both < SAME_OUTLINE or length < SLENDER * widest:
        return None
    low, high = np.mean([o[0] for o in outlines], axis=0), np.mean([o[1] for o in outlines], axis=0)
    return _Ends(axes, middle, low, high, float(way @ along))


def _nearest(direction: np.ndarray, known: list[np.ndarray], degrees: float) -> np.ndarray:
    """The first of the known directions, either way, that is within some degrees of one; itself if none is."""
    for other in known:
        if abs(other @ direction) > np.cos(np.radians(degrees)):
            return other * np.sign(other @ direction)
    return direction


def _sharpened(ends: _Ends, photos: Photos, fringe: float) -> tuple[_Ends, float]:
    """The outline's sides where the photographs of both ends show them, and the standard error of its smaller side."""
    low, high, errors = ends.low.copy(), ends.high.copy(), []
    for axis in (0, 1):
        for values, sign in ((low, -1.0), (high, 1.0)):
            shift, error = _side_shift(ends, axis, float(values[axis]), sign, photos, fringe)
            values[axis] += shift
            errors.append((axis, error))
    thin = int((high - low)[1] <= (high - low)[0])
    error = float(np.hypot(*(e for axis, e in errors if axis == thin)))
    return _Ends(ends.axes, ends.middle, low, high, ends.length), error


def _side_shift(
    ends: _Ends, axis: int, value: float, sign: float, photos: Photos, fringe: float
) -> tuple[float, float]:
    """How far a side of the outline lies from where the cloud's percentile puts it, and its standard error, mm."""
    other = 1 - axis
    span = ends.high[other] - ends.low[other]
    at = np.linspace(ends.low[other] + 0.15 * span, ends.high[other] - 0.15 * span, PLACES)
    direction, rest = ends.axes[[0, 2]][axis], ends.axes[[0, 2]][other]
    step = fringe / 60
    offsets = np.arange(-fringe, fringe, step)
    sweeps = []
    for end in (-0.5, 0.5):
        base = ends.middle + end * ends.length * ends.axes[1]
        places = base + value * direction + at[:, None] * rest
        sight = np.array([view.centre for view in photos.views]).reshape(-1, 3) - base
        facing = np.sign(end) * sight @ ends.axes[1] > 0.3 * np.linalg.norm(sight, axis=1)
        visible = np.repeat(facing[:, None], len(places), axis=1)
        sweep = sweep_edge(photos, places, sign * direction, offsets, visible, smoothing=1.5 * step)
        if sweep is not None and sweep.contrast > CLEAR_EDGE:
            sweeps.append(sweep)
    if not sweeps:
        return 0.0, fringe / 2
    best = max(sweeps, key=lambda s: s.contrast)
    return sign * best.best, best.standard_error


def _bar(ends: _Ends, error: float, planes: tuple[int, int]) -> Bar:
    """The slab, with +z across the smaller side of the outline."""
    size, centre = ends.high - ends.low, (ends.high + ends.low) / 2
    thin = int(size[1] <= size[0])
    side, along, across = ends.axes
    z = across if thin else side
    middle = ends.middle + centre[0] * side + centre[1] * across
    frame = np.eye(4)
    frame[:3, :3] = np.stack([np.cross(along, z), along, z], axis=1)
    frame[:3, 3] = middle - size[thin] / 2 * z
    half = size[1 - thin] / 2
    thickness = ThicknessHypothesis(float(size[thin]), max(error, 1e-3), "ends", float(size.prod()))
    return Bar(frame, thickness, box(-half, -ends.length / 2, half, ends.length / 2), planes)
