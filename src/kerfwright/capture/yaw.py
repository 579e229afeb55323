"""Turn an object about the vertical so that most of its upright faces look along x and y."""

from __future__ import annotations

import numpy as np

from kerfwright.capture.types import Cloud

__all__ = ["dominant_yaw", "upright_turn"]

UPRIGHT = 0.2  # sine of the largest angle between a normal and the horizontal
BINS = 180  # of half a degree over a quarter turn
FACING = np.cos(np.radians(15))  # of normals of a face along x or y
LAYERS = (
    0.012,
    0.008,
    0.006,
    0.006,
)  # of the object's size: the thickness of a layer about a face, thinner at each round
MOST_LAYERS = 12
POINTS = 1_000_000  # of the cloud, that decide the angle; all of most clouds, so that their order does not
WINDOWS = np.radians([4.0, 2.0, 1.0, 1.0])  # about the peak, narrower at each round


def dominant_yaw(normals: np.ndarray) -> float | None:
    """The angle, radians in [0, pi/2), by which most horizontal normals are turned from x or y; None without any."""
    flat = normals[np.abs(normals[:, 2]) < UPRIGHT]
    if len(flat) == 0:
        return None
    angle = np.arctan2(flat[:, 1], flat[:, 0])
    start = float(np.angle(np.exp(4j * angle).mean())) / 4  # bins begin here, so that they turn with the object
    counts = np.bincount((_quarter(angle - start) / (np.pi / 2) * BINS).astype(int) % BINS, minlength=BINS)
    smooth = (
        counts + (np.roll(counts, 1) + np.roll(counts, -1)) * 2 / 3 + (np.roll(counts, 2) + np.roll(counts, -2)) / 3
    )
    yaw = start + (int(smooth.argmax()) + 0.5) / BINS * np.pi / 2
    for window in WINDOWS:
        away = _quarter(angle - yaw + np.pi / 4) - np.pi / 4
        yaw += float(away[np.abs(away) < window].mean()) if (np.abs(away) < window).any() else 0.0
    return _quarter(yaw)


def _quarter(angle):
    """Angles, radians, in [0, pi/2)."""
    return angle % (np.pi / 2)


def straightened(cloud: Cloud, yaw: float) -> float:
    """The angle again, from where points lie instead of their normals, which stereo bends near edges.

    With an angle e missing, a face along x has its points at x = c - e y, one along y at y = c + e x.
    """
    for width in LAYERS:
        turn = _about_z(-yaw)[:2, :2]
        xy, facing = cloud.points[:, :2] @ turn.T, np.abs(cloud.normals[:, :2] @ turn.T)
        parts = [
            _layer_sums(xy[facing[:, k] > FACING, k], sign * xy[facing[:, k] > FACING, 1 - k], width * cloud.diameter)
            for k, sign in ((0, -1.0), (1, 1.0))
        ]
        product, square = np.sum(parts, axis=0)
        yaw += float(product / square) if square > 0 else 0.0
    return yaw


def _layer_sums(offset: np.ndarray, place: np.ndarray, width: float) -> np.ndarray:
    """Sums of offset times place and of place squared, about their means, over the densest layers of a width."""
    sums = np.zeros(2)
    for low in _densest(offset, width):
        inside = (offset >= low) & (offset < low + width)
        along = place[inside] - place[inside].mean()
        sums += along @ (offset[inside] - offset[inside].mean()), along @ along
    return sums


def _densest(offset: np.ndarray, width: float) -> list[float]:
    """Lower ends of up to MOST_LAYERS layers that do not overlap, the densest first."""
    if not len(offset):
        return []
    step, start = width / 8, float(offset.min())
    counts = np.convolve(np.bincount(((offset - start) / step).astype(int)), np.ones(8, int))[
        7:
    ]  # of eight bins from each on
    found = []
    for _ in range(MOST_LAYERS):
        best = int(counts.argmax())
        if counts[best] < 0.01 * len(offset) or counts[best] <= 0:
            break
        found.append(start + best * step)
        counts[max(0, best - 8) : best + 9] = 0
    return found


def upright_turn(cloud: Cloud) -> np.ndarray:
    """3x3 turn about z: faces along x and y, the longer side along x, the side with more points towards +x."""
    yaw = dominant_yaw(cloud.normals)
    turn = _set_lengthwise(cloud, np.eye(3) if yaw is None else _about_z(-yaw))
    if yaw is None:
        return turn
    some = cloud.select(slice(None, None, max(1, len(cloud) // POINTS)))
    set_lengthwise = Cloud(some.points @ turn.T, some.normals @ turn.T)  # layers begin at the same face in every frame
    return _about_z(-straightened(set_lengthwise, 0.0)) @ turn


def _set_lengthwise(cloud: Cloud, turn: np.ndarray) -> np.ndarray:
    """The turn with quarter turns: the longer side along x, the side with more points towards +x."""
    sides = np.ptp(np.percentile(cloud.points[:, :2] @ turn[:2, :2].T, (0.5, 99.5), axis=0), axis=0)
    if sides[1] > sides[0]:
        turn = _about_z(-np.pi / 2) @ turn
    x = cloud.points[:, :2] @ turn[0, :2]
    low, high = np.percentile(x, (0.5, 99.5))
    return _about_z(np.pi) @ turn if np.median(x) < (low + high) / 2 else turn


def _about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
