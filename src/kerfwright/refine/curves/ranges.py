"""Best line, circle and cubic for every range between two candidate nodes, from sums that are kept.

Lines and circles come in closed form from running moments (circles: Taubin 1991). Cubics are fitted in one batch to
samples of each range, with a few steps of reparametrisation. Fits are free at their ends: where neighbours meet is the
business of the joins, so that the node of two lines is their intersection, not a point of the boundary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.refine.curves.samples import Samples

__all__ = ["ARC", "CUBIC", "LINE", "RangeFits", "fit_circle", "fit_range", "fit_ranges", "line_chi2"]

LINE, ARC, CUBIC = 0, 1, 2
_OFFSET_GAIN = np.array([4.0, 9.0, 16.0])  # variance of a fitted polynomial at its end: (degree + 1)^2 / n
_ANGLE_GAIN = np.array([12.0, 192.0, 1200.0])  # variance of its slope there, times length^2 / n
_BATCH = 40


@dataclass(frozen=True, eq=False)
class RangeFits:
    """Fits of K x K ranges and three kinds; first axis: node where the range starts, second: where it ends.

    `ends` (K, K, 3, 2, 2): the points of the fit next to both nodes; `tangents` likewise; `curvature` (K, K, 3, 2);
    `offset_variance`, `angle_variance` (K, K, 3) at an end; `length` (K, K) mm; `chi2` (K, K, 3), infinite where
    there is no fit.
    """

    chi2: np.ndarray
    ends: np.ndarray
    tangents: np.ndarray
    curvature: np.ndarray
    offset_variance: np.ndarray
    angle_variance: np.ndarray
    length: np.ndarray


def fit_ranges(samples: Samples, nodes: np.ndarray, allowed: np.ndarray, good_enough: float) -> RangeFits:
    """Fit every allowed range.

    Parameters
    ----------
    samples : Samples
    nodes : (K,) int array
        Sample indices of the candidates, ascending.
    allowed : (K, K) bool array
        Which ranges to fit.
    good_enough : float
        Cubics are tried where neither line nor arc comes below this chi-square.
    """
    start, stop = np.nonzero(allowed)
    first = nodes[start]
    last = nodes[stop] + np.where(nodes[stop] <= first, samples.count, 0)
    pairs = len(start)
    chi2 = np.full((pairs, 3), np.inf)
    ends, tangents = np.zeros((pairs, 3, 2, 2)), np.zeros((pairs, 3, 2, 2))
    curvature = np.zeros((pairs, 3, 2))
    corner = samples.points[np.column_stack([first, last]) % samples.count]
    sums = samples.moments[last + 1 - (last - first >= samples.count)] - samples.moments[first]
    chi2[:, LINE], ends[:, LINE], tangents[:, LINE] = _lines(sums, corner)
    middle = samples.points[((first + last) // 2) % samples.count]
    chi2[:, ARC], ends[:, ARC], tangents[:, ARC], curvature[:, ARC] = _arcs(sums, corner, middle)
    hard = np.flatnonzero((chi2[:, :2].min(axis=1) > good_enough) & (last - first >= samples.steps(25.0)))
    if len(hard):
        parts = _cubics(samples, first[hard], last[hard])
        chi2[hard, CUBIC], ends[hard, CUBIC], tangents[hard, CUBIC], curvature[hard, CUBIC] = parts
    length = (last - first) * samples.spacing
    variance = sums[:, 9] / (last - first + 1)
    count = np.maximum(length / (2 * samples.correlation), 1.0)
    offset_variance = (variance / count)[:, None] * _OFFSET_GAIN
    angle_variance = (variance / count / length**2)[:, None] * _ANGLE_GAIN
    shaped = [_grid(v, start, stop, len(nodes)) for v in (ends, tangents, curvature, offset_variance, angle_variance)]
    full = np.full((len(nodes), len(nodes), 3), np.inf)
    full[start, stop] = chi2
    return RangeFits(full, *shaped, _grid(length, start, stop, len(nodes)))


def _grid(values: np.ndarray, start: np.ndarray, stop: np.ndarray, count: int) -> np.ndarray:
    grid = np.zeros((count, count, *values.shape[1:]))
    grid[start, stop] = values
    return grid


def _central(sums: np.ndarray) -> tuple[np.ndarray, ...]:
    """Weight, mean and central moments xx, xy, yy, xz, yz, zz with z the squared distance from the mean."""
    w = np.maximum(sums[:, 0], 1e-300)
    ex, ey, exx, exy, eyy, exz, eyz, ezz = (sums[:, k] / w for k in range(1, 9))
    m = ex**2 + ey**2
    ez = exx + eyy
    xx, xy, yy = exx - ex**2, exy - ex * ey, eyy - ey**2
    xz = exz - 2 * ex * exx - 2 * ey * exy + m * ex - ex * (ez - m)
    yz = eyz - 2 * ex * exy - 2 * ey * eyy + m * ey - ey * (ez - m)
    zz = ezz + 4 * (ex**2 * exx + ey**2 * eyy) + m**2 - 4 * (ex * exz + ey * eyz) + 2 * m * ez
    zz += 8 * ex * ey * exy - 4 * m * m
    return w, np.column_stack([ex, ey]), xx, xy, yy, xz, yz, zz


def _lines(sums: np.ndarray, corner: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    w, mean, xx, xy, yy, *_ = _central(sums)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    u = np.column_stack([np.cos(angle), np.sin(angle)])
    u *= np.where(((corner[:, 1] - corner[:, 0]) * u).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    small = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)
    along = ((corner - mean[:, None]) * u[:, None]).sum(axis=2)
    ends = mean[:, None] + along[..., None] * u[:, None]
    return w * np.maximum(small, 0), ends, np.repeat(u[:, None], 2, axis=1)


def _taubin(xx: np.ndarray, xy: np.ndarray, yy: np.ndarray, xz: np.ndarray, yz: np.ndarray, zz: np.ndarray):
    """Centre about the mean, squared radius and mean squared distance of Taubin's circle."""
    mz, cov = xx + yy, xx * yy - xy * xy
    a3, a2 = 4 * mz, -3 * mz**2 - zz
    a1 = zz * mz + 4 * cov * mz - xz**2 - yz**2 - mz**3
    a0 = xz * xz * yy + yz * yz * xx - zz * cov - 2 * xz * yz * xy + mz * mz * cov
    root = np.zeros_like(xx)
    for _ in range(12):
        slope = a1 + root * (2 * a2 + 3 * root * a3)
        step = (a0 + root * (a1 + root * (a2 + root * a3))) / np.where(slope == 0, 1e-300, slope)
        root = np.where(np.abs(step) < np.abs(mz), root - step, root)
    det = root**2 - root * mz + cov
    det = np.where(np.abs(det) < 1e-12, 1e-12, det)
    a = (xz * (yy - root) - yz * xy) / det / 2
    b = (yz * (xx - root) - xz * xy) / det / 2
    r2 = a**2 + b**2 + mz
    algebraic = zz - 4 * a * xz - 4 * b * yz - 2 * mz * mz + 4 * a * a * xx + 8 * a * b * xy + 4 * b * b * yy + mz**2
    return np.column_stack([a, b]), r2, np.maximum(algebraic, 0) / (4 * r2)


def fit_circle(samples: Samples) -> tuple[np.ndarray, float, float]:
    """Centre, radius and chi-square of the circle through the whole loop."""
    w, mean, *moments = _central(samples.moments[samples.count][None])
    centre, r2, mse = _taubin(*moments)
    centre, radius = (mean + centre)[0], float(np.sqrt(r2[0]))
    return centre, radius, float(w[0] * mse[0])


def line_chi2(samples: Samples, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Chi-square of the best free lines over samples first .. last, all below 2N."""
    sums = samples.moments[last + 1] - samples.moments[first]
    return _lines(sums, samples.points[np.column_stack([first, last]) % samples.count])[0]


def fit_range(samples: Samples, first: int, last: int, kind: int) -> float:
    """Chi-square of the best free edge of a kind over samples first .. last (which may exceed N)."""
    at = np.array([first % samples.count]), np.array([first % samples.count + last - first])
    if kind == CUBIC:
        return float(_cubics(samples, *at)[0][0])
    sums = samples.moments[at[1] + 1 - (last - first >= samples.count)] - samples.moments[at[0]]
    corner = samples.points[np.column_stack(at) % samples.count]
    if kind == LINE:
        return float(_lines(sums, corner)[0][0])
    middle = samples.points[((at[0] + at[1]) // 2) % samples.count]
    return float(_arcs(sums, corner, middle)[0][0])


def _arcs(sums: np.ndarray, corner: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, ...]:
    w, mean, *moments = _central(sums)
    shift, r2, mse = _taubin(*moments)
    centre, radius = mean + shift, np.sqrt(r2)
    chord = corner[:, 1] - corner[:, 0]
    bow = middle - corner.mean(axis=1)
    ccw = chord[:, 0] * bow[:, 1] - chord[:, 1] * bow[:, 0] < 0
    sign = np.where(ccw, 1.0, -1.0)
    spoke = corner - centre[:, None]
    spoke /= np.maximum(np.linalg.norm(spoke, axis=2, keepdims=True), 1e-12)
    tangents = sign[:, None, None] * np.stack([-spoke[..., 1], spoke[..., 0]], axis=2)
    flat = radius > 20 * np.linalg.norm(chord, axis=1)
    chi2 = np.where(flat | ~np.isfinite(mse), np.inf, w * mse)
    return (
        chi2,
        centre[:, None] + radius[:, None, None] * spoke,
        tangents,
        np.repeat((sign / radius)[:, None], 2, axis=1),
    )


def _cubics(samples: Samples, first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, ...]:
    """Free cubics by batch least squares: by points with moving parameters, then, where that pays, by normal
    distances.
    """
    at = first[:, None] + np.rint(np.linspace(0, 1, _BATCH) * (last - first)[:, None]).astype(int)
    points, weight = samples.points[at % samples.count], samples.weight[at % samples.count]
    weight = weight * ((last - first + 1) / _BATCH)[:, None]
    t = np.repeat(np.linspace(0, 1, _BATCH)[None], len(first), axis=0)
    for _ in range(3):
        control = _solve_cubics(points, weight, t)
        t = _closer(control, points, t)
    control = _solve_cubics(points, weight, t)
    chi2 = _normal_chi2(control, points, weight, t)
    near = np.flatnonzero(chi2 < 20 + 10 * (last - first) * samples.spacing / (2 * samples.correlation))
    for _ in range(4):
        t[near] = _closer(control[near], points[near], t[near])
        control[near] = _tangent_step(control[near], points[near], weight[near], t[near])
    t[near] = _closer(control[near], points[near], t[near])
    chi2[near] = _normal_chi2(control[near], points[near], weight[near], t[near])
    ends = control[:, [0, 3]]
    tangents = control[:, [1, 3]] - control[:, [0, 2]]
    tangents /= np.maximum(np.linalg.norm(tangents, axis=2, keepdims=True), 1e-12)
    return chi2, ends, tangents, _end_curvature(control)


def _velocity(control: np.ndarray, t: np.ndarray) -> np.ndarray:
    s, t, d = (1 - t)[..., None], t[..., None], np.diff(control, axis=1)[:, None]
    return 3 * (s * s * d[:, :, 0] + 2 * s * t * d[:, :, 1] + t * t * d[:, :, 2])


def _left(vectors: np.ndarray) -> np.ndarray:
    unit = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
    return np.stack([-unit[..., 1], unit[..., 0]], axis=-1)


def _normal_chi2(control: np.ndarray, points: np.ndarray, weight: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Chi-square of the distances across the curve; those along it are only a matter of parameters."""
    gap = points - _basis(t) @ control
    across = (gap * _left(_velocity(control, t))).sum(axis=2)
    return (weight * across**2).sum(axis=1)


def _tangent_step(control: np.ndarray, points: np.ndarray, weight: np.ndarray, t: np.ndarray) -> np.ndarray:
    """One Gauss-Newton step on distances across the curve, with a weak hold along it."""
    basis, normal = _basis(t), _left(_velocity(control, t))
    across = (basis[..., None] * normal[:, :, None, :]).reshape(*t.shape, 8)
    gap = points - basis @ control
    weighted = across * weight[..., None]
    matrix = weighted.transpose(0, 2, 1) @ across
    right = (weighted.transpose(0, 2, 1) @ (gap * normal).sum(axis=2)[..., None])[..., 0]
    held = (basis * weight[..., None]).transpose(0, 2, 1) @ basis
    for d in range(2):
        matrix[:, d::2, d::2] += 1e-3 * held
    matrix += 1e-9 * np.trace(matrix, axis1=1, axis2=2)[:, None, None] * np.eye(8)
    return control + np.linalg.solve(matrix, right[..., None])[..., 0].reshape(-1, 4, 2)


def _basis(t: np.ndarray) -> np.ndarray:
    s = 1 - t
    return np.stack([s**3, 3 * s * s * t, 3 * s * t * t, t**3], axis=-1)


def _solve_cubics(points: np.ndarray, weight: np.ndarray, t: np.ndarray) -> np.ndarray:
    basis = _basis(t)
    weighted = (basis * weight[..., None]).transpose(0, 2, 1)
    normal = weighted @ basis
    normal += 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(4)
    return np.linalg.solve(normal, weighted @ points)


def _closer(control: np.ndarray, points: np.ndarray, t: np.ndarray) -> np.ndarray:
    """One Gauss-Newton step of each parameter towards the foot of its point, then stretched to 0 .. 1."""
    velocity = _velocity(control, t)
    gap = points - _basis(t) @ control
    t = t + (gap * velocity).sum(axis=2) / np.maximum((velocity**2).sum(axis=2), 1e-9)
    t = np.maximum.accumulate(t, axis=1)
    low, high = t[:, :1], t[:, -1:]
    return (t - low) / np.maximum(high - low, 1e-9)


def _end_curvature(control: np.ndarray) -> np.ndarray:
    first, second = np.diff(control, axis=1), np.diff(control, 2, axis=1)
    return np.stack([_turn(first[:, 0], second[:, 0]), _turn(first[:, 2], second[:, 1])], axis=1) * (2 / 3)


def _turn(d: np.ndarray, dd: np.ndarray) -> np.ndarray:
    return (d[:, 0] * dd[:, 1] - d[:, 1] * dd[:, 0]) / np.maximum(np.linalg.norm(d, axis=1), 1e-9) ** 3
