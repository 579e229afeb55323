"""What a reader of clouds hands over."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kerfwright.capture.parsing import capture_error

__all__ = ["MOST_POINTS", "RawCloud", "bytes_of", "check_count"]

MOST_POINTS = 100_000_000  # 5 GB of coordinates and normals; a cloud of a piece of carpentry needs a hundredth


@dataclass(frozen=True, eq=False)
class RawCloud:
    """Points (N, 3) float64; normals (N, 3) float64 and colours (N, 3) uint8, or None; values are not judged.

    `metres` tells that the format itself has metres for its unit.
    """

    points: np.ndarray
    normals: np.ndarray | None = None
    colours: np.ndarray | None = None
    metres: bool = False


def check_count(count: int, path: Path, field: str) -> None:
    """Refuse more points than memory should be given for."""
    if count > MOST_POINTS:
        raise capture_error(path, field, count, f"at most {MOST_POINTS}: thin the cloud")


def bytes_of(values: np.ndarray) -> np.ndarray:
    """Colours 0 to 255 from whole numbers of 8 or 16 bits, or from real ones of 0 to 1 or 0 to 255."""
    values = np.nan_to_num(np.asarray(values, float))
    top = values.max(initial=0.0)
    factor = 255.0 if top <= 1 else 1.0 if top <= 255 else 255 / 65535
    return np.clip(np.round(values * factor), 0, 255).astype(np.uint8)
