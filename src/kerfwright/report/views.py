"""Which photographs show the object best, and at what size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from kerfwright.capture.types import View

__all__ = ["best_views", "scaled"]

ENOUGH_POINTS = 5000  # to tell how much of an object a photograph shows
# Parameters of a camera model that are lengths in pixels; the others are lens distortion.
_PIXEL_LENGTHS = frozenset(("f", "fx", "fy", "cx", "cy"))


def best_views(views: Sequence[View], points: np.ndarray, count: int = 4) -> list[View]:
    """Views that show most of the points (N, 3), as far apart in direction as can be; in the capture's order."""
    some = points[:: max(1, len(points) // ENOUGH_POINTS)]
    share = np.array([_share_shown(view, some) for view in views])
    candidates = np.flatnonzero((share > 0) & (share >= 0.9 * share.max(initial=0)))
    if not len(candidates):
        return []
    directions = np.array([views[k].centre - points.mean(axis=0) for k in candidates])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    chosen = [int(share[candidates].argmax())]
    while len(chosen) < min(count, len(candidates)):
        nearest = (directions @ directions[chosen].T).max(axis=1)
        chosen.append(int(nearest.argmin()))
    return [views[k] for k in sorted(candidates[chosen])]


def _share_shown(view: View, points: np.ndarray) -> float:
    """Share of the points in the frame, times that of the frame they fill: whole and large is best."""
    pixels, depth = view.project(points)
    size = np.array([view.camera.width, view.camera.height])
    inside = (depth > 0) & ((pixels >= 0) & (pixels < size)).all(axis=1)
    if not inside.any():
        return 0.0
    filled = float(np.prod(np.ptp(pixels[inside], axis=0) / size))
    return float(inside.mean()) * filled**0.25


def scaled(view: View, photo: np.ndarray, width: int) -> tuple[View, np.ndarray]:
    """The view and its photograph at no more than `width` pixels across."""
    import cv2

    from kerfwright.capture.camera import CAMERA_MODELS, Camera

    camera = view.camera
    if camera.width <= width:
        return view, photo
    height = round(camera.height * width / camera.width)
    across, down = width / camera.width, height / camera.height
    names = CAMERA_MODELS[camera.model]
    params = tuple(
        p * (down if name in ("fy", "cy") else across) if name in _PIXEL_LENGTHS else p
        for name, p in zip(names, camera.params, strict=True)
    )
    small = Camera(camera.model, width, height, params)
    return replace(view, camera=small), cv2.resize(photo, (width, height), interpolation=cv2.INTER_AREA)
