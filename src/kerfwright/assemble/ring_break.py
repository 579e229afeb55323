"""How much a step in the tone of a face breaks what its wood leads one to expect.

Year rings come back every few millimetres, and next to a joint they pass for a part of its step, which moves it. A
vector autoregression (three colours, Lütkepohl, New Introduction to Multiple Time Series Analysis, 2005, chapter 3)
foretells every sample of the profile across the line from those before it, rings included. A step is then fitted to
what was not foretold, by generalised least squares.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.special import ndtr

__all__ = ["step_evidence"]

ORDER = 10  # samples: a ring or two
RIDGE = 1e-3  # of the profile's variance, on the coefficients
ROUNDS = 4
OUTLYING = 9.0  # Mahalanobis' distance, squared, beyond which a sample counts less: known joints, knots, glints
BLUR = 1.3  # samples, of a step as a photograph shows it
REACH = 40  # samples to either side to which a step is fitted
FAINTEST = 1e-4  # of brightness: what is foretold better was made up by interpolation


def step_evidence(profile: np.ndarray) -> np.ndarray:
    """(U,) by how much a step at every offset makes the profile likelier: twice the logarithm, chi-squared of three.

    profile : (U, 3) logarithms of brightness, NaN where unseen. Zero where too little is seen beside an offset.
    """
    told = np.flatnonzero(np.isfinite(profile[:, 0]))
    evidence = np.zeros(len(profile))
    if len(told) < 2 * REACH + 6 * ORDER:
        return evidence
    first, last = told[0], told[-1] + 1
    at = np.arange(first, last)
    series = np.column_stack([np.interp(at, told, colour) for colour in profile[told].T])
    coefficients, spread = _autoregression(series - np.median(series, axis=0))
    white = np.linalg.inv(np.linalg.cholesky(spread)).T
    new = _unforetold(series, coefficients) @ white
    windows = sliding_window_view(new, 2 * REACH + 1, axis=0).transpose(0, 2, 1).reshape(len(new) - 2 * REACH, -1)
    evidence[first + ORDER + REACH : last - REACH] = ((windows @ _steps(coefficients, white)) ** 2).sum(axis=1)
    return evidence


def _autoregression(series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (3 ORDER, 3), latest sample first, and covariance (3, 3) of what they do not foretell in (U, 3)."""
    before, now = _before(series), series[ORDER:]
    ridge = RIDGE * len(now) * (series.var() + FAINTEST**2) * np.eye(before.shape[1])
    counts = np.ones(len(now))
    for _ in range(ROUNDS):
        weighed = before * counts[:, None]
        coefficients = np.linalg.solve(weighed.T @ before + ridge, weighed.T @ now)
        off = now - before @ coefficients
        spread = (off * counts[:, None]).T @ off / counts.sum() + FAINTEST**2 * np.eye(3)
        far = np.einsum("ui,ui->u", off, np.linalg.solve(spread, off.T).T)
        counts = np.minimum(1.0, OUTLYING / np.maximum(far, 1e-9))
    return coefficients, spread


def _before(series: np.ndarray) -> np.ndarray:
    """(U - ORDER, 3 ORDER) the samples before each one, latest first."""
    return np.concatenate([series[ORDER - k : len(series) - k] for k in range(1, ORDER + 1)], axis=1)


def _unforetold(series: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    return series[ORDER:] - _before(series) @ coefficients


def _steps(coefficients: np.ndarray, white: np.ndarray) -> np.ndarray:
    """(3 (2 REACH + 1), 3) orthonormal: what a step in the middle of a window leaves, that a level does not."""
    at = np.arange(-REACH - ORDER, REACH + 1)
    level, step = (
        np.column_stack([(_unforetold(shape[:, None] * colour, coefficients) @ white).ravel() for colour in np.eye(3)])
        for shape in (np.ones(len(at)), ndtr(at / BLUR))
    )
    levels = np.linalg.qr(level)[0]
    return np.linalg.qr(step - levels @ (levels.T @ step))[0]
