"""The rim of a region: its outline moved onto the cut faces that the cloud shows.

The outline of the points on a sheet plane is a few millimetres off, for stereo widens silhouettes. Points on the cut
faces lie on the true boundary; seen along the sheet normal they are samples of the cut path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.types import Neighbourhood

__all__ = ["CutPoints", "Rim", "cut_points", "outline_samples", "trace_rim"]


WINDOW_VALUES = 1_000_000  # sorted at once, to bound memory


@dataclass(frozen=True, eq=False)
class Rim:
    """Places along a region's rings, board frame mm, in order along each ring."""

    places: np.ndarray  # (N, 2), moved onto the cut faces where `seen`
    outward: np.ndarray  # (N, 2) unit normals away from the wood
    ring: np.ndarray  # (N,) 0 for the outer ring, then the holes
    seen: np.ndarray  # (N,) bool: cut-face points back the place
    error: np.ndarray  # (N,) standard error across the rim


@dataclass(frozen=True, eq=False)
class CutPoints:
    """Cloud points on the cut faces of a slab: index, nearest rim sample, offset beyond it along its normal, depth
    below the top.
    """

    idx: np.ndarray
    sample: np.ndarray
    offset: np.ndarray
    depth: np.ndarray


def outline_samples(piece: Polygon, spacing: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places every `spacing` along all rings, outward normals, and the ring number of each."""
    places, normals, rings = [], [], []
    for number, ring in enumerate([piece.exterior, *piece.interiors]):
        at = np.arange(0, ring.length, spacing)
        xy, ahead, behind = (
            shapely.get_coordinates(shapely.line_interpolate_point(ring, (at + shift) % ring.length))
            for shift in (0, 3 * spacing, -3 * spacing)
        )
        tangent = ahead - behind
        turn = 1.0 if ring.is_ccw == (number == 0) else -1.0
        normal = turn * np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
        places.append(xy)
        normals.append(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12))
        rings.append(np.full(len(at), number))
    return np.concatenate(places), np.concatenate(normals), np.concatenate(rings)


def cut_points(
    frame: np.ndarray, samples: tuple[np.ndarray, np.ndarray, np.ndarray], cloud: Cloud, around: Neighbourhood,
    deepest: float, width: float,
) -> CutPoints:
    """Points that face outward beside the outline, from a little above the sheet plane down to `deepest` below it.

    frame: world_from_top, z = 0 on the sheet plane. width: how far off the outline they may lie, mm.
    """
    places, outward, _ = samples
    height = cloud.points @ frame[:3, 2] - frame[:3, 3] @ frame[:3, 2]
    idx = np.flatnonzero((height > -deepest) & (height < width))  # few of the cloud: the rest is done on them alone
    normal = around.normals[idx] @ frame[:3, :3]
    upright = np.abs(normal[:, 2]) < 0.5
    idx, normal = idx[upright], normal[upright]
    x = (cloud.points[idx] - frame[:3, 3]) @ frame[:3, :3]
    low, high = places.min(axis=0) - width, places.max(axis=0) + width
    distance, nearest = np.full(len(x), np.inf), np.zeros(len(x), int)
    boxed = np.flatnonzero(((x[:, :2] > low) & (x[:, :2] < high)).all(axis=1))
    distance[boxed], nearest[boxed] = cKDTree(places).query(x[boxed, :2], distance_upper_bound=width)
    near = np.flatnonzero(np.isfinite(distance))
    facing = (normal[near, :2] * outward[nearest[near]]).sum(axis=1) > 0.6
    idx, x, nearest = idx[near][facing], x[near][facing], nearest[near][facing]
    return CutPoints(idx, nearest, ((x[:, :2] - places[nearest]) * outward[nearest]).sum(axis=1), -x[:, 2])


def trace_rim(
    frame: np.ndarray, piece: Polygon, cloud: Cloud, around: Neighbourhood, depth: float, *,
    spacing: float, width: float,
) -> Rim:
    """The outline with every stretch that has cut-face points moved onto their median.

    depth: how far below the sheet plane cut faces are trusted, mm; the fringe at the plane itself is left out.
    """
    samples = outline_samples(piece, spacing)
    cut = cut_points(frame, samples, cloud, around, depth, width)
    inner = (cut.depth > 0.15 * depth) & (cut.depth < 0.9 * depth)
    window = max(1, round(2 * around.spacing / spacing))
    shift, count, spread = _window_medians(cut.sample[inner], cut.offset[inner], len(samples[0]), window)
    seen = count >= 5
    moved = samples[0] + np.where(seen, shift, 0.0)[:, None] * samples[1]
    error = np.where(seen, np.maximum(spread, around.noise) / np.sqrt(np.maximum(count / 5, 1)), width / 2)
    return Rim(moved, samples[1], samples[2], seen, error)


def _window_medians(
    sample: np.ndarray, value: np.ndarray, size: int, window: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Median, count and robust spread of values in a window of samples about each sample."""
    order = np.argsort(sample, kind="stable")
    sample, value = sample[order], value[order]
    start = np.searchsorted(sample, np.arange(size) - window)
    stop = np.searchsorted(sample, np.arange(size) + window, side="right")
    count = stop - start
    median, spread = np.zeros(size), np.zeros(size)
    some = np.flatnonzero(count)
    for rows in np.array_split(some, max(1, int(count[some].max(initial=0) * len(some) // WINDOW_VALUES))):
        own = _padded(value, start[rows], count[rows])
        median[rows] = _row_medians(own, count[rows])
        spread[rows] = 1.4826 * _row_medians(np.abs(own - median[rows, None]), count[rows])
    return median, count, spread


def _padded(value: np.ndarray, start: np.ndarray, count: np.ndarray) -> np.ndarray:
    """(R, M) the runs value[start : start + count], filled up with infinity."""
    at = np.arange(count.max(initial=0))
    inside = at < count[:, None]
    return np.where(inside, value[np.where(inside, start[:, None] + at, 0)], np.inf)


def _row_medians(padded: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Median of the first `count` values of every row."""
    ordered = np.sort(padded, axis=1)
    rows = np.arange(len(ordered))
    return (ordered[rows, (count - 1) // 2] + ordered[rows, count // 2]) / 2
