"""Turn an object about the vertical so that most of its upright faces look along x and y."""

from __future__ import annotations

import numpy as np

from kerfwright.capture.types import Cloud

__all__ = ["dominant_yaw", "upright_turn"]

UPRIGHT = 0.2  # sine of the largest angle between a normal and the horizontal
BINS = 180  # of half a degree over a quarter turn
WINDOWS = np.radians([4.0, 2.0, 1.0, 1.0])  # about the peak, narrower at each round


def dominant_yaw(normals: np.ndarray) -> float | None:
    """The angle, radians in [0, pi/2), by which most horizontal normals are turned from x or y; None without any."""
    flat = normals[np.abs(normals[:, 2]) < UPRIGHT]
    if len(flat) == 0:
        return None
    angle = np.arctan2(flat[:, 1], flat[:, 0]) % (np.pi / 2)
    counts = np.bincount((angle / (np.pi / 2) * BINS).astype(int) % BINS, minlength=BINS)
    smooth = counts + (np.roll(counts, 1) + np.roll(counts, -1)) * 2 / 3 + (np.roll(counts, 2) + np.roll(counts, -2)) / 3
    yaw = (int(smooth.argmax()) + 0.5) / BINS * np.pi / 2
    for window in WINDOWS:
        away = (angle - yaw + np.pi / 4) % (np.pi / 2) - np.pi / 4
        yaw += float(away[np.abs(away) < window].mean()) if (np.abs(away) < window).any() else 0.0
    return yaw % (np.pi / 2)


def upright_turn(cloud: Cloud) -> np.ndarray:
    """3x3 turn about z: faces along x and y, the longer side along x, the side with more points towards +x."""
    yaw = dominant_yaw(cloud.normals)
    turn = _about_z(-(yaw or 0.0))
    sides = np.ptp(np.percentile(cloud.points[:, :2] @ turn[:2, :2].T, (0.5, 99.5), axis=0), axis=0)
    if sides[1] > sides[0]:
        turn = _about_z(-np.pi / 2) @ turn
    x = cloud.points[:, :2] @ turn[0, :2]
    low, high = np.percentile(x, (0.5, 99.5))
    return _about_z(np.pi) @ turn if np.median(x) < (low + high) / 2 else turn


def _about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
