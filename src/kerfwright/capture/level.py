"""Which way is up for an object whose floor is not in the cloud: from what it would rest on, and its boards."""

from __future__ import annotations

import numpy as np

from kerfwright.capture.frame import rotation_between
from kerfwright.capture.types import Cloud

__all__ = ["up_of_object"]

POINTS = 20_000  # of the cloud; their hull and mean normals are as good
STEEPEST = np.radians(30)  # of the tilt that is put right
AGREE = np.radians(1.5)  # between boards and what the object rests on: a few millimetres of noise under its feet
LEAST_TILT = np.radians(1.5)  # below it photographs, and the stages that align boards, do better
LEAST_TILT_AT_REST = np.radians(3)  # where no board confirms it
BAND = 0.015  # of the object's size above its lowest point: where its feet are looked for
COLUMN = 0.06  # of the object's size: width of the columns whose lowest points are the feet
WINDOWS = np.radians([5.0, 3.0, 2.0])  # about a direction whose normals are averaged, narrower at each round
FEWEST = 0.03  # share of the normals that makes a direction of boards


def up_of_object(cloud: Cloud) -> np.ndarray | None:
    """The unit normal, (3,), that should point up; None where +z is as good or nothing is clear.

    An object rests on the face of its convex hull below its centre. Level or upright boards that agree with that face
    tell its direction more exactly; without such boards the face itself is taken if the tilt is large.
    """
    some = cloud.select(slice(None, None, max(1, len(cloud) // POINTS)))
    rest = _resting_normal(some.points)
    if rest is None:
        return None
    boards = [u for u in (_level_normal(some.normals, rest), _upright_axis(some.normals, rest)) if u is not None]
    agreeing = [u for u in boards if _angle(u, rest) < min(AGREE, float(np.arccos(min(1.0, rest[2]))))]
    if agreeing:
        return agreeing[0] if np.arccos(min(1.0, agreeing[0][2])) > LEAST_TILT else None
    return rest if not boards and np.arccos(min(1.0, rest[2])) > LEAST_TILT_AT_REST else None


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arccos(np.clip(a @ b, -1, 1)))


def _resting_normal(points: np.ndarray) -> np.ndarray | None:
    """Upward normal of the plane under its feet that an object rests on; None if it is steep or unclear."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except QhullError:  # a flat cloud
        return None
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    below = np.flatnonzero(normals[:, 2] < -np.cos(STEEPEST))
    if not len(below):
        return None
    depth = (normals[below] @ points.mean(axis=0) + offsets[below]) / normals[
        below, 2
    ]  # down from the centre to each face
    return _under_feet(points, -normals[below[depth.argmin()]])


def _under_feet(points: np.ndarray, normal: np.ndarray, rounds: int = 4) -> np.ndarray | None:
    """The normal again, as a face of a noisy hull is small: from the lowest point of each column near the ground."""
    size = float(np.ptp(points, axis=0).max())
    for _ in range(rounds):
        turn = rotation_between(normal, np.array([0.0, 0.0, 1.0]))
        x = points @ turn.T
        x = x[x[:, 2] < np.percentile(x[:, 2], 0.02) + BAND * size]
        cell = np.floor((x[:, :2] - x[:, :2].min(axis=0)) / (COLUMN * size)).astype(int) @ [1000, 1]
        order = np.lexsort((x[:, 2], cell))
        feet = x[order[np.flatnonzero(np.r_[True, np.diff(cell[order]) > 0])]]
        feet = feet - feet.mean(axis=0)
        slope, _, rank, spread = np.linalg.lstsq(feet[:, :2], feet[:, 2], rcond=None)
        if rank < 2 or spread[1] < 0.2 * spread[0]:
            return None
        normal = turn.T @ (np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1 + slope @ slope))
    return normal if normal[2] > np.cos(STEEPEST) else None


def _level_normal(normals: np.ndarray, up: np.ndarray) -> np.ndarray | None:
    """Mean normal of the level boards, (3,)."""
    for window in WINDOWS:
        cosine = normals @ up
        level = np.abs(cosine) > np.cos(window)
        if level.mean() < FEWEST:
            return None
        mean = (normals[level] * np.sign(cosine[level])[:, None]).sum(axis=0)
        up = mean / np.linalg.norm(mean)
    return up


def _upright_axis(normals: np.ndarray, up: np.ndarray) -> np.ndarray | None:
    """The direction square to the normals of upright boards, (3,), if these look in two directions."""
    for window in WINDOWS:
        upright = normals[np.abs(normals @ up) < np.sin(window)]
        if len(upright) < FEWEST * len(normals):
            return None
        spread, axes = np.linalg.eigh(upright.T @ upright / len(upright))
        if spread[1] < 0.05:
            return None
        up = axes[:, 0] * np.sign(axes[:, 0] @ up)
    return up
