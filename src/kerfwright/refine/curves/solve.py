"""Fit all unknowns of a closed chain at once: least orthogonal distances, robustly, with equations that hold exactly.

Gauss-Newton steps in the null space of the equations' Jacobian. The null space comes from a rank-revealing
decomposition, so equations may repeat each other, which would make an interior-point solver fail.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kerfwright.refine.curves.feet import assigned, normal_sums
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.shape import Shape, equations
from kerfwright.refine.curves.snap import GuideLine

__all__ = ["Equations", "Fit", "constrained_step", "distances", "normal_equations", "solve", "taken_stock"]

ROBUST = 4.0  # standard errors at which an observation has lost three quarters of its weight (Geman-McClure)
NODE_REACH = 20.0  # mm: how far nodes may move along the boundary before samples must change edges
_SETTLED = 0.02  # chi-square; a structure's price is some hundred times that
_RANK = 1e-9
Equations = Callable[[Shape], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted chain: plain and robust chi-square, signed distances and edges of the samples, covariance of the
    unknowns.
    """

    shape: Shape
    chi2: float
    robust: float
    distance: np.ndarray  # (N,)
    edge: np.ndarray  # (N,)
    covariance: np.ndarray
    violation: float


def distances(shape: Shape, samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance (N,) and edge (N,) of each sample: of its range's edge, or near a node of the neighbour if
    nearer.
    """
    reach = samples.steps(NODE_REACH)
    return assigned(np.array(shape.kinds), shape.edges, np.array(shape.ranges), samples.points, reach)


def solve(
    shape: Shape, samples: Samples, guides: list[GuideLine], extra: Equations | None = None, steps: int = 25
) -> Fit:
    """The best unknowns for the structure of `shape`; `extra` gives more equations than the structure's own."""
    both = _all_equations(guides, extra)
    damping, best = 1e-3, None
    system = normal_equations(shape, samples)
    for _ in range(steps):
        value, jacobian = both(shape)
        step, covariance = constrained_step(*system[:2], value, jacobian, damping)
        limit = 0.2 * samples.length / max(shape.count, 4)
        step *= min(1.0, limit / max(float(np.abs(step[: 2 * shape.count]).max()), 1e-12))
        trial = shape.moved(shape.unknowns + step)
        trial_system = normal_equations(trial, samples)
        merit = _merit(trial_system[2], both(trial)[0], samples)
        if best is None or merit <= best * (1 + 1e-9) + 1e-9:
            shape, system, damping = trial, trial_system, max(damping / 5, 1e-9)
            small = best is not None and best - merit < _SETTLED
            best = merit
            if small:
                break
        else:
            damping *= 8
            if damping > 1e3:
                break
    return _finished(shape, samples, both, covariance)


def _all_equations(guides: list[GuideLine], extra: Equations | None) -> Equations:
    def every(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
        value, jacobian = equations(shape, guides)
        if extra is None:
            return value, jacobian
        more, slope = extra(shape)
        return np.concatenate([value, more]), np.vstack([jacobian, slope])

    return every


def _merit(robust: float, violation: np.ndarray, samples: Samples) -> float:
    return robust + 1e3 * float(np.abs(violation).sum()) / max(float(np.median(samples.sigma)), 1e-6)


def normal_equations(shape: Shape, samples: Samples) -> tuple[np.ndarray, np.ndarray, float]:
    """Normal matrix and right side of the robust least squares, and the robust chi-square."""
    unknowns = len(shape.unknowns)
    normal, right = np.zeros((unknowns, unknowns)), np.zeros(unknowns)
    edge = distances(shape, samples)[1]
    kinds, points = np.array(shape.kinds), samples.points
    blocks, sides, chi2 = normal_sums(kinds, shape.edges, edge, points, samples.sigma, samples.weight, ROBUST)
    for k in range(shape.count):
        columns = shape.columns(k)
        normal[np.ix_(columns, columns)] += blocks[k, : len(columns), : len(columns)]
        right[columns] += sides[k, : len(columns)]
    return normal, right, chi2


def constrained_step(
    normal: np.ndarray, right: np.ndarray, value: np.ndarray, jacobian: np.ndarray, damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """Step that brings the equations to zero in first order and lowers the sum of squares, and the covariance."""
    unknowns = len(right)
    particular, basis = np.zeros(unknowns), np.eye(unknowns)
    if len(value):
        u, s, vt = np.linalg.svd(jacobian, full_matrices=True)
        rank = int((s > _RANK * max(s[0], 1e-12)).sum())
        particular = -vt[:rank].T @ ((u[:, :rank].T @ value) / s[:rank])
        basis = vt[rank:].T
    reduced = basis.T @ normal @ basis
    scale = np.diag(np.maximum(np.diag(reduced), 1e-9))
    move = np.linalg.lstsq(reduced + damping * scale, basis.T @ (right - normal @ particular), rcond=1e-12)[0]
    covariance = basis @ np.linalg.pinv(reduced + 1e-9 * scale, hermitian=True) @ basis.T
    return particular + basis @ move, covariance


def _finished(shape: Shape, samples: Samples, both: Equations, covariance: np.ndarray) -> Fit:
    """Bring the equations to rounding error by least moves, then take stock."""
    for _ in range(8):
        value, jacobian = both(shape)
        if not len(value) or np.abs(value).max() < 1e-13:
            break
        step = np.linalg.lstsq(jacobian, -value, rcond=_RANK)[0]
        shape = shape.moved(shape.unknowns + step)
    return taken_stock(shape, samples, covariance, float(np.abs(both(shape)[0]).max(initial=0.0)))


def taken_stock(shape: Shape, samples: Samples, covariance: np.ndarray, violation: float = 0.0) -> Fit:
    """The fit that a shape is: chi-square, distances, edges of the samples."""
    distance, edge = distances(shape, samples)
    ratio = 1 + (distance / (ROBUST * samples.sigma)) ** 2
    return Fit(
        shape,
        float((samples.weight * distance**2).sum()),
        float((samples.weight * distance**2 / ratio).sum()),
        distance,
        edge,
        covariance,
        violation,
    )
