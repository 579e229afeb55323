"""From a polygon good to a pixel to boundary points good to a fraction, each with its standard error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from kerfwright.refine.segment.constraints import Limit
from kerfwright.refine.segment.edges import EdgeScan, clearness, trace, view_offsets
from kerfwright.refine.segment.options import SegmentOptions
from kerfwright.refine.types import BoundaryLoop

__all__ = ["Chain", "chain_of", "loops_of", "open_chain", "registration", "settle", "snap"]

SMOOTH = 2.0  # mm along the boundary over which normals are averaged
HUBER = 0.5  # mm
LEAST_POINTS = 30  # boundary points that tell how a view lies
PRIOR_POINTS = 40  # boundary points that the poses' own say is worth against the edges
CLOUD_WINDOW = 3.0  # mm, along and across, in which cut-face points speak for a boundary point
CLOUD_ERROR = 0.4  # mm that stereo drifts by, whatever the number of points
CLOUD_LEAST = 6


@dataclass(frozen=True, eq=False)
class Chain:
    """All rings of one piece: points in order, outward unit normals, and the ring that each belongs to (0: outer)."""

    points: np.ndarray  # (N, 2)
    normals: np.ndarray  # (N, 2)
    ring: np.ndarray  # (N,)

    def moved(self, offsets: np.ndarray) -> np.ndarray:
        """(N, 2) points moved outward by (N,) offsets."""
        return self.points + offsets[:, None] * self.normals


def chain_of(piece: Polygon, step: float) -> Chain:
    """Points `step` apart, outer ring counter-clockwise, holes clockwise, with smoothed normals."""
    from shapely.geometry.polygon import orient

    piece = orient(piece)
    found = [_resampled(ring, step) for ring in (piece.exterior, *piece.interiors)]
    points, normals = (np.concatenate([f[k] for f in found]) for k in (0, 1))
    return Chain(points, normals, np.repeat(np.arange(len(found)), [len(f[0]) for f in found]))


def _resampled(ring, step: float) -> tuple[np.ndarray, np.ndarray]:
    count = max(16, round(ring.length / step))
    corners = np.asarray(ring.coords)[:, :2]
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.arange(count) / count * length[-1]
    points = np.column_stack([np.interp(at, length, corners[:, k]) for k in (0, 1)])
    reach = max(1, round(SMOOTH / step))
    tangent = sum(np.roll(points, -s, 0) - np.roll(points, s, 0) for s in range(1, reach + 1))
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-9)[:, None]
    return points, np.column_stack([tangent[:, 1], -tangent[:, 0]])


def open_chain(points: np.ndarray) -> Chain:
    """(N, 2) points of an open line, material on its left, as a chain."""
    reach = round(SMOOTH)
    ends = np.pad(points, ((reach, reach), (0, 0)), mode="edge")
    tangent = ends[2 * reach:] - ends[: -2 * reach]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-9)[:, None]
    return Chain(points, np.column_stack([tangent[:, 1], -tangent[:, 0]]), np.zeros(len(points), int))


def registration(chain: Chain, scans: Sequence[EdgeScan]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How each view lies against the others.

    Returns
    -------
    (V, 2) shift, mm in the plane; (V,) what remains after it, mm (NaN: unknown); (V,) how clearly the view shows the
    boundary that all have in common, against the other views at the same places (NaN: too few places).
    """
    path = trace(scans, chain.ring)
    offset, weight = (np.array(a) for a in zip(*(view_offsets(s, path) for s in scans), strict=True))
    mean = np.ma.median(np.ma.array(offset, mask=weight <= 0), axis=0).filled(0.0)
    shared = (weight > 0).sum(0) >= 3
    found = [_shift(chain.normals[u], (o - mean)[u], w[u]) for o, w in zip(offset, weight, strict=True)
             for u in [shared & (w > 0)]]
    return np.array([f[0] for f in found]), np.array([f[1] for f in found]), _agreement(scans, path)


def _agreement(scans: Sequence[EdgeScan], path: np.ndarray) -> np.ndarray:
    """(V,) clearness of each view's boundary over that of the others, where it and two others show it."""
    weight = np.array([s.weight for s in scans])
    clear = np.array([clearness(s, path) for s in scans])
    rest, rest_weight = clear.sum(0) - clear, weight.sum(0) - weight
    others = ((weight > 0).sum(0) - (weight > 0) >= 2) & (weight > 0)
    usual = np.where(others, weight * rest / np.maximum(rest_weight, 1e-9), 0).sum(1)
    enough = (others.sum(1) >= LEAST_POINTS) & (usual > 0)
    return np.where(enough, np.where(others, clear, 0).sum(1) / np.maximum(usual, 1e-9), np.nan)


def _shift(normals: np.ndarray, residual: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, float]:
    """The translation whose component along the normals is the residual, robustly; none from too few points."""
    if len(residual) < LEAST_POINTS:
        return np.zeros(2), float("nan")
    shift, ridge = np.zeros(2), PRIOR_POINTS * weight.mean() * np.eye(2)
    for _ in range(4):
        robust = weight / np.maximum(abs(residual - normals @ shift) / HUBER, 1)
        shift = np.linalg.solve(normals.T @ (robust[:, None] * normals) + ridge, normals.T @ (robust * residual))
    return shift, float(np.median(abs(residual - normals @ shift)))


def settle(
    chain: Chain, scans: Sequence[EdgeScan], cut_points: np.ndarray, pixel: float, options: SegmentOptions
) -> tuple[np.ndarray, np.ndarray]:
    """(N,) offset of each boundary point and its standard error, from the photographs and the cloud's cut faces."""
    path = trace(scans, chain.ring) if scans else np.zeros(len(chain.points))
    by_views = [(*view_offsets(s, path), _spread(s)) for s in scans]
    photo, photo_error = _mean_over_views(by_views, path, pixel)
    cloud, cloud_error = _cloud_offsets(chain, cut_points, path)
    weights = np.stack([photo_error**-2, cloud_error**-2])
    total = weights.sum(0)
    return (weights * np.stack([photo, cloud])).sum(0) / total, np.sqrt(1 / total + options.correlated_error**2)


def _spread(scan: EdgeScan) -> float:
    """Error of one view's edge at one point, mm: blur and poses are good to about half a photo pixel."""
    return 2.0 * float(scan.offsets[1] - scan.offsets[0])


def _mean_over_views(by_views, path: np.ndarray, pixel: float) -> tuple[np.ndarray, np.ndarray]:
    """Weighted mean of the views' offsets; its error from their spread, never below what one view is good for."""
    if not by_views:
        return path, np.full(len(path), 2 * pixel)
    offset, weight = (np.array([v[k] for v in by_views]) for k in (0, 1))
    total = weight.sum(0)
    mean = np.where(total > 0, (offset * weight).sum(0) / np.maximum(total, 1e-9), path)
    variance = (weight * (offset - mean) ** 2).sum(0) / np.maximum(total, 1e-9)
    effective = total**2 / np.maximum((weight**2).sum(0), 1e-9)
    error = np.sqrt((variance + by_views[0][2] ** 2) / np.maximum(effective, 1))
    return mean, np.where(total > 0, error, 2 * pixel)


def _cloud_offsets(chain: Chain, cut_points: np.ndarray, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Median offset of the cut-face points (M, 2) about each boundary point; an infinite error where there are few."""
    from scipy.spatial import cKDTree

    offset, error = path.copy(), np.full(len(path), np.inf)
    if len(cut_points) < CLOUD_LEAST:
        return offset, error
    at = chain.moved(path)
    for i, near in enumerate(cKDTree(cut_points).query_ball_point(at, CLOUD_WINDOW)):
        if len(near) < CLOUD_LEAST:
            continue
        across = (cut_points[near] - at[i]) @ chain.normals[i]
        middle = np.median(across)
        spread = 1.4826 * np.median(abs(across - middle))
        offset[i], error[i] = path[i] + middle, np.sqrt(CLOUD_ERROR**2 + (1.25 * spread) ** 2 / len(near))
    return offset, error


def snap(
    points: np.ndarray, error: np.ndarray, normals: np.ndarray, limits: Sequence[Limit], near: float
) -> tuple[np.ndarray, np.ndarray]:
    """Points that run along a constraint segment within `near` mm are put on it, with its standard error."""
    points, error = points.copy(), error.copy()
    for limit in limits:
        along, across, length = limit.local(points)
        on = (along >= 0) & (along <= length) & (abs(across) < near) & (normals @ -limit.inward > 0.7)
        points[on] -= across[on, None] * limit.inward
        error[on] = limit.standard_error
    return points, error


def loops_of(chain: Chain, points: np.ndarray, error: np.ndarray) -> tuple[BoundaryLoop, ...]:
    """The chain's rings as boundary loops, the outer first."""
    return tuple(
        BoundaryLoop(points[chain.ring == k], error[chain.ring == k], is_hole=k > 0) for k in np.unique(chain.ring)
    )
