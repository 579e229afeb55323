"""What a structure costs, in degrees of freedom: one scale for dynamic programming and for the search after it.

An edge costs its own freedom and a charge for being there at all: its node could have been anywhere, and some kinds
of cut are likelier than others. Saws cut square: a line along or across the boundary's main direction has no angle to
choose. With these charges the square end of a notch beats a semicircle that fits as well, a round corner beats a
chamfer, one cubic beats two arcs, and an arc needs evidence.
"""

from __future__ import annotations

import numpy as np

__all__ = ["CHEAPEST_LINE", "edge_prices", "is_regular", "line_prices", "main_direction"]

_LINE, CHEAPEST_LINE, _ARC, _CUBIC = 3.5, 2.0, 5.25, 9.0
_LEAST_SHARE = 0.25  # of the boundary that must run along or across a direction to make it the main one
_WINDOW = 0.03  # radians: half the width of the direction's peak
_TOLERANCE = 2.5  # standard errors of a line's angle
_MOST_TILT = 0.25  # radians


def edge_prices() -> np.ndarray:
    """(3,) prices of a line, an arc and a cubic between sharp nodes."""
    return np.array([_LINE, _ARC, _CUBIC])


def main_direction(tangents: np.ndarray) -> float | None:
    """Angle modulo 90 degrees along or across which most of the boundary's tangents (N, 2) run, or None."""
    quarter = np.mod(np.arctan2(tangents[:, 1], tangents[:, 0]), np.pi / 2)
    grid = np.arange(0, np.pi / 2, 0.01)
    apart = np.abs((quarter[None] - grid[:, None] + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    share = (apart < _WINDOW).mean(axis=1)
    if share.max() < _LEAST_SHARE:
        return None
    peak = grid[share.argmax()]
    near = apart[share.argmax()] < 1.5 * _WINDOW
    return float(peak + np.median((quarter[near] - peak + np.pi / 4) % (np.pi / 2) - np.pi / 4))


def is_regular(vectors: np.ndarray, error: np.ndarray, main: float | None) -> np.ndarray:
    """Whether directions (..., 2) are along or across the main one within their standard errors (...), radians."""
    if main is None:
        return np.zeros(vectors.shape[:-1], bool)
    angle = np.arctan2(vectors[..., 1], vectors[..., 0])
    apart = np.abs((angle - main + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    return apart < np.minimum(_TOLERANCE * error + _WINDOW / 3, _MOST_TILT)


def line_prices(vectors: np.ndarray, error: np.ndarray, main: float | None) -> np.ndarray:
    """(...) prices of lines with these directions."""
    return np.where(is_regular(vectors, error, main), CHEAPEST_LINE, _LINE)
