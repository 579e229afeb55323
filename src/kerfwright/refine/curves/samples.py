"""A boundary as evenly spaced samples with weights that know how few of them are independent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation, binary_opening

from kerfwright.errors import StageError
from kerfwright.refine.curves.prices import main_direction
from kerfwright.refine.types import BoundaryLoop

__all__ = ["Samples", "resample"]

MOST_SAMPLES = 2400
RUN_ON = 3.0  # correlation lengths
LEAST_WEIGHT = 0.05  # of a doubted sample, where only the others shall speak


@dataclass(frozen=True, eq=False)
class Samples:
    """A closed boundary at even spacing along itself, mm.

    `weight` (N,) turns squared distances (mm2) into chi-square of effective observations: spacing / (2 l sigma^2)
    with the correlation length l. `doubted` (N,): what was traced there may be another edge.
    """

    points: np.ndarray  # (N, 2)
    sigma: np.ndarray  # (N,)
    weight: np.ndarray  # (N,)
    spacing: float
    correlation: float
    doubted: np.ndarray

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.points)

    @property
    def length(self) -> float:
        """Perimeter."""
        return self.count * self.spacing

    @property
    def observations(self) -> float:
        """Effective number of independent observations."""
        return max(self.length / (2 * self.correlation), 3.0)

    def steps(self, millimetres: float) -> int:
        """Millimetres along the boundary as a number of samples, at least one."""
        return max(1, round(millimetres / self.spacing))

    @cached_property
    def moments(self) -> np.ndarray:
        """(2N + 1, 10) running sums, twice round, of w, wx, wy, wxx, wxy, wyy, wxz, wyz, wzz, ws2 with z = x^2 +
        y^2.
        """
        x, y = self.points.T
        z = x**2 + y**2
        rows = np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y, x * z, y * z, z * z]) * self.weight[:, None]
        rows = np.column_stack([rows, self.sigma**2])
        return np.vstack([np.zeros(10), np.cumsum(np.vstack([rows, rows]), axis=0)])

    @cached_property
    def main_direction(self) -> float | None:
        """Angle modulo 90 degrees along or across which most of the boundary runs."""
        return main_direction(self.directions(12.0))

    @cached_property
    def without_doubt(self) -> Samples:
        """The same with next to no weight where the boundary is doubted."""
        weight = np.where(self.doubted, LEAST_WEIGHT * self.weight, self.weight)
        return replace(self, weight=weight) if self.doubted.any() else self

    def directions(self, reach: float) -> np.ndarray:
        """(N, 2) unit directions along the boundary from chords over +- `reach` mm."""
        k = self.steps(reach)
        chord = np.roll(self.points, -k, axis=0) - np.roll(self.points, k, axis=0)
        return chord / np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-12)


def resample(loop: BoundaryLoop, correlation_length: float, doubtful: float = np.inf) -> Samples:
    """Samples about 1/5 of the correlation length apart, or as far as the boundary's own points if these are closer.

    Those are doubted whose standard error is beyond `doubtful` times the usual one.

    Raises
    ------
    StageError
        If the loop has fewer than three different points, or a point or standard error makes no sense.
    """
    given, errors = np.asarray(loop.points, float), np.broadcast_to(loop.standard_error, len(loop.points))
    if not np.isfinite(given).all():
        raise StageError("boundary loop: points: found values that are not finite: give mm in the board frame")
    if not np.all(errors > 0) or not np.isfinite(errors).all():
        raise StageError(
            "boundary loop: standard_error: found values that are not above 0: give mm across the boundary"
        )
    points, sigma = _distinct(given, errors)
    if len(points) < 3:
        raise StageError(f"boundary loop: points: {len(points)} different ones found: a loop needs at least 3")
    steps = np.linalg.norm(np.diff(np.vstack([points, points[:1]]), axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    native = float(np.median(steps))
    spacing = max(length[-1] / MOST_SAMPLES, min(max(native, correlation_length / 20), correlation_length / 5))
    count = max(12, round(length[-1] / spacing))
    at = np.arange(count) * length[-1] / count
    closed, closed_sigma = np.vstack([points, points[:1]]), np.append(sigma, sigma[0])
    even = np.column_stack([np.interp(at, length, closed[:, k]) for k in range(2)])
    even_sigma = np.interp(at, length, closed_sigma)
    correlation = max(correlation_length, native / 2)
    weight = length[-1] / count / (2 * correlation * even_sigma**2)
    doubted = _spread(even_sigma > doubtful * np.median(even_sigma), correlation / (length[-1] / count))
    return Samples(even, even_sigma, weight, length[-1] / count, correlation, doubted)


def _spread(doubted: np.ndarray, correlation: float) -> np.ndarray:
    """Stretches that are doubted, without those shorter than twice the correlation length (in samples), run on beyond
    their ends: where one leaves the true edge is not known, and beside it a constraint segment was run on too far.
    """
    near, far = max(1, round(correlation)), max(1, round(RUN_ON * correlation))
    wide = np.pad(doubted, 4 * far, mode="wrap")
    lasting = binary_opening(binary_closing(wide, np.ones(near + 1)), np.ones(2 * near + 1))
    return binary_dilation(lasting, np.ones(2 * far + 1))[4 * far : -4 * far]


def _distinct(points: np.ndarray, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Without points that repeat the one before."""
    keep = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1) > 1e-9
    return points[keep], sigma[keep]
