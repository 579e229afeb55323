"""Colour mixtures: how likely a colour is inside and outside of a board, in one view of one side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.refine.segment._pixels import nearest_centres

__all__ = ["Mixture", "fit_mixture", "same_surface", "with_shade"]

FLOOR_VARIANCE = 2.0  # LAB units squared: sensor noise and JPEG; keeps flat colours from becoming spikes
UNIFORM = np.log(1e-7)  # density of an unforeseen colour: LAB holds about 1e6 to 1e7 cubic units
EM_STEPS = 6
SHADES = (0.85, 0.72)  # of L + 16: light down to .6 and .37
SHADE_SHARE = 0.05  # prior share of the inside in each shade
SAME_VARIANCE = 16.0  # LAB units squared: one point seen by two views, after exposure was evened out
SAME_SHARE = 0.1  # prior share of colours inside that the mixture doesn't know


@dataclass(frozen=True, eq=False)
class Mixture:
    """Gaussians with full covariance in LAB."""

    weights: np.ndarray  # (k,)
    means: np.ndarray  # (k, 3)
    whitening: np.ndarray  # (k, 3, 3), inverse Cholesky factors of the covariances

    def log_density(self, colours: np.ndarray) -> np.ndarray:
        """(N, 3) to (N,), all colours and components in one product."""
        return np.logaddexp(_logsumexp(self._joint(colours)), np.float32(UNIFORM))

    def _joint(self, colours: np.ndarray) -> np.ndarray:
        """(k, N) log of weight times density."""
        k = len(self.weights)
        stacked = self.whitening.reshape(3 * k, 3)
        offset = np.einsum("kij,kj->ki", self.whitening, self.means).reshape(3 * k)
        z = stacked.astype(np.float32) @ colours.astype(np.float32).T - offset.astype(np.float32)[:, None]
        z *= z
        squared = z[0::3] + z[1::3] + z[2::3]
        log_det = np.log(np.abs(np.linalg.det(self.whitening)))
        constant = np.log(self.weights) + log_det - 1.5 * np.log(2 * np.pi)
        return constant.astype(np.float32)[:, None] - np.float32(0.5) * squared


def _logsumexp(values: np.ndarray) -> np.ndarray:
    top = values.max(0)
    return top + np.log(np.exp(values - top).sum(0))


def with_shade(mixture: Mixture) -> Mixture:
    """The mixture and darker copies of it: corners of furniture lie in the shade, and that is where clouds have gaps.

    Less light scales all three of L + 16, a and b by the cube root of its loss (CIE 15, above the linear toe).
    """
    light = np.array([16.0, 0, 0])
    copies = [(1 - SHADE_SHARE * len(SHADES), 1.0), *((SHADE_SHARE, s) for s in SHADES)]
    return Mixture(
        np.concatenate([share * mixture.weights for share, _ in copies]),
        np.concatenate([(mixture.means + light) * s - light for _, s in copies]),
        np.concatenate([mixture.whitening] * len(copies)),
    )


def same_surface(colours: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(N,) log density of (N, 3) colours if of one surface point with the other views' mean (NaN: none).

    Only what lies on the sheet plane keeps its colour from view to view: a knot does, a dark patch of carpet doesn't.
    """
    squared = ((colours - others) ** 2).sum(1) / SAME_VARIANCE
    log_density = np.log(SAME_SHARE) - 0.5 * squared - 1.5 * np.log(2 * np.pi * SAME_VARIANCE)
    return np.where(np.isfinite(squared), log_density, -np.inf).astype(np.float32)


def fit_mixture(
    colours: np.ndarray, components: int, samples: int, rng: np.random.Generator, rows: np.ndarray | None = None
) -> Mixture | None:
    """A mixture of (N, 3) colours, or of some rows of them, by k-means and a few steps of EM on a sample; None of too
    few.
    """
    count = len(colours) if rows is None else len(rows)
    if count < 10 * components:
        return None
    picked = rng.choice(count, min(samples, count), replace=False)
    picked = colours[picked if rows is None else rows[picked]].astype(np.float32)
    mixture = _mixture(picked, _one_hot(_nearest(picked, components)))
    for _ in range(EM_STEPS):
        joint = mixture._joint(picked)
        mixture = _mixture(picked, np.exp(joint - _logsumexp(joint)).T)
    return mixture


def _nearest(colours: np.ndarray, components: int) -> np.ndarray:
    """k-means, from centres at the quantiles of lightness: repeatable without a random start."""
    order = np.argsort(colours[:, 0], kind="stable")
    centres = colours[order[((np.arange(components) + 0.5) / components * len(colours)).astype(int)]].astype(float)
    return nearest_centres(colours, centres, 8)


def _one_hot(labels: np.ndarray) -> np.ndarray:
    return (labels[:, None] == np.unique(labels)).astype(np.float32)


def _mixture(colours: np.ndarray, shares: np.ndarray) -> Mixture:
    """Maximum likelihood with shares (N, k) of each colour in each component; empty components go."""
    mass = shares.sum(0)
    shares, mass = shares[:, mass > 3], mass[mass > 3]
    means = shares.T @ colours / mass[:, None]
    products = (colours[:, :, None] * colours[:, None, :]).reshape(-1, 9)
    second = (shares.T @ products).reshape(-1, 3, 3) / mass[:, None, None]
    covariance = second - means[:, :, None] * means[:, None, :] + FLOOR_VARIANCE * np.eye(3)
    whitening = np.linalg.inv(np.linalg.cholesky(covariance.astype(np.float64)))
    return Mixture((mass / mass.sum()).astype(np.float64), means.astype(np.float64), whitening)
