"""The floor in a cloud: the lowest large level plane, reaching beyond what stands on it on most sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.capture.types import Cloud

__all__ = ["Floor", "find_floor"]

ROUGH_POINTS = 60_000  # enough to find the floor; all points then fit it
COLUMNS = 48  # a side of the grid in which the lowest points are looked for
MIN_UPWARD = (
    0.5  # cosine of the largest angle between a floor point's normal and up: the tilt that is put right, and noise
)
TRIALS = 500  # planes through three lowest points; with a fifth of them on the floor one in 125 hits
ROUGH = 0.004  # of the cloud's size: what counts as on a trial plane before the noise is known
MOST_BELOW = 0.02  # share of the points that may lie under the floor: reflections and strays
FEWEST_AROUND = 0.03  # share of the points that lie on the floor around the object
SECTORS = 36  # directions round the object in which the floor is looked for
SECTORS_AROUND = 0.6  # share of the directions in which the floor goes on beyond the object
BEYOND = 1.08  # how far, as a factor of the object's own reach; a plinth ends with its object


@dataclass(frozen=True, eq=False)
class Floor:
    """The plane normal @ x = offset, unit normal up; noise is the standard deviation of its points across it."""

    normal: np.ndarray
    offset: float
    noise: float

    def heights(self, points: np.ndarray) -> np.ndarray:
        """Signed distances above the floor, (N,)."""
        return points @ self.normal - self.offset


def find_floor(cloud: Cloud, centres: np.ndarray, generator: np.random.Generator) -> Floor | None:
    """Find the floor, tilted by up to 45 degrees or so, if the cloud has one.

    Parameters
    ----------
    cloud : in a frame where +z is roughly up, any unit
    centres : centres of the views, (M, 3); the floor lies below most of them
    """
    thin = cloud.select(slice(None, None, max(1, len(cloud) // ROUGH_POINTS)))
    lowest = _lowest_in_columns(thin)
    if len(lowest) < 3:
        return None
    size = float(np.ptp(np.percentile(thin.points, (1, 99), axis=0), axis=0).max())
    trial = _best_trial(thin.points[lowest], ROUGH * size, generator)
    floor = None if trial is None else _refined(thin, *trial, ROUGH * size)
    if floor is None or not _is_floor(floor, thin, centres):
        return None
    return _refined(cloud, floor.normal, floor.offset, 8 * floor.noise, rounds=2)


def _lowest_in_columns(cloud: Cloud) -> np.ndarray:
    """Indices of the lowest upward-facing point of each column of a grid: on the floor, wherever that is seen."""
    upward = np.flatnonzero(cloud.normals[:, 2] > MIN_UPWARD)
    if not len(upward):
        return upward
    xy = cloud.points[upward, :2]
    low, high = np.percentile(xy, (0.5, 99.5), axis=0)
    cell = np.clip((xy - low) / max((high - low).max(), np.finfo(float).tiny) * COLUMNS, -1, COLUMNS).astype(int)
    order = np.lexsort((cloud.points[upward, 2], cell[:, 1], cell[:, 0]))
    key = cell[order, 0] * (COLUMNS + 2) + cell[order, 1]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    tenth = first + np.diff(np.r_[first, len(key)]) // 10  # the very lowest may be a stray
    return upward[order[tenth]]


def _best_trial(
    points: np.ndarray, tolerance: float, generator: np.random.Generator
) -> tuple[np.ndarray, float] | None:
    """Normal and offset of the plane through three of the points that has the most of them on it and few below."""
    triples = points[generator.integers(0, len(points), (TRIALS, 3))]
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals *= (np.sign(normals[:, 2]) / np.maximum(length, np.finfo(float).tiny))[:, None]
    offsets = np.einsum("ni,ni->n", normals, triples[:, 0])
    heights = points @ normals.T - offsets
    on = (np.abs(heights) < tolerance).sum(axis=0)
    below = (heights < -tolerance).sum(axis=0)
    score = np.where((normals[:, 2] > MIN_UPWARD), on - below, -1)
    best = int(score.argmax())
    return (normals[best], float(offsets[best])) if score[best] >= 3 else None


def _refined(cloud: Cloud, normal: np.ndarray, offset: float, tolerance: float, rounds: int = 6) -> Floor | None:
    """Least squares through what lies near the plane, nearer at each round, down to four times the noise."""
    noise = tolerance
    for _ in range(rounds):
        heights = cloud.points @ normal - offset
        on = np.flatnonzero((np.abs(heights) < tolerance) & (cloud.normals @ normal > MIN_UPWARD))
        if len(on) < 3:
            return None
        centre = cloud.points[on].mean(axis=0)
        _, _, axes = np.linalg.svd(np.cov((cloud.points[on] - centre).T), hermitian=True)
        normal = axes[2] * np.sign(axes[2] @ normal)
        offset = float(normal @ centre)
        noise = 1.4826 * float(np.median(np.abs(cloud.points[on] @ normal - offset)))
        tolerance = min(tolerance, max(4 * noise, tolerance / 4))
    return Floor(normal, offset, noise)


def _is_floor(floor: Floor, cloud: Cloud, centres: np.ndarray) -> bool:
    """Whether little lies below, the cameras above, and the plane goes on around what stands on it."""
    heights = floor.heights(cloud.points)
    size = float(np.ptp(cloud.points, axis=0).max())
    above = heights > 8 * floor.noise + 1e-3 * size
    if (heights < -(8 * floor.noise + 1e-3 * size)).mean() > MOST_BELOW or not above.any():
        return False
    if len(centres) and (floor.heights(centres) > 0).mean() < 0.9:
        return False
    on = (np.abs(heights) < 4 * floor.noise) & (cloud.normals @ floor.normal > MIN_UPWARD)
    return _goes_around(cloud.points[on], cloud.points[above], floor.normal)


def _goes_around(on: np.ndarray, above: np.ndarray, normal: np.ndarray) -> bool:
    """Compare, direction by direction, how far the plane and what stands on it reach from its middle."""
    x_axis = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    axes = np.stack([x_axis, np.cross(normal, x_axis)], axis=1) / np.linalg.norm(x_axis)
    centre = np.median(above @ axes, axis=0)
    object_reach, object_sector = _polar(above @ axes - centre)
    floor_reach, floor_sector = _polar(on @ axes - centre)
    reach = np.zeros(SECTORS)
    for k in range(SECTORS):
        inside = object_reach[object_sector == k]
        reach[k] = np.percentile(inside, 99) if len(inside) else 0.0
    outside = floor_reach > BEYOND * reach[floor_sector]
    around = (
        np.bincount(floor_sector[outside], minlength=SECTORS) > 0.2 * FEWEST_AROUND * (len(on) + len(above)) / SECTORS
    )
    return bool(outside.sum() > FEWEST_AROUND * (len(on) + len(above)) and around.mean() >= SECTORS_AROUND)


def _polar(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    angle = np.arctan2(xy[:, 1], xy[:, 0])
    return np.hypot(*xy.T), np.minimum(((angle / (2 * np.pi) + 0.5) * SECTORS).astype(int), SECTORS - 1)
