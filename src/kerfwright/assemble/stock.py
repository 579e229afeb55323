"""One thickness for all boards of one stock: clustered by uncertainty (paper, Thickness Regularization; method.md trap
13).
"""

from __future__ import annotations

import numpy as np

from kerfwright.assemble.options import AssembleOptions
from kerfwright.identify.faces import robust_mean, with_thickness
from kerfwright.identify.types import Sheet
from kerfwright.model import Origin, Quantity

__all__ = ["share_thickness"]

GUESSED = 0.1  # relative difference between a guessed thickness and the stock that it was taken from, as then measured


def share_thickness(sheets: tuple[Sheet, ...], diameter: float, options: AssembleOptions) -> tuple[Sheet, ...]:
    """Sheets whose thicknesses agree within their uncertainty get their robust mean; unseen ones take their twins',
    or the commonest.

    The top sheet plane stays where it is: it was measured, the bottom follows.
    """
    value = np.array([s.thickness.value for s in sheets])
    error = np.array([np.hypot(s.thickness.standard_error or 0, options.thickness_floor * diameter) for s in sheets])
    seen = np.array([s.thickness_seen for s in sheets])
    area = np.array([s.region.area for s in sheets])
    groups = _clusters(np.flatnonzero(seen), value, error, options.thickness_sigmas)
    out = list(sheets)
    for group in groups:
        mean, spread = robust_mean(value[group], error[group])
        origin = Origin.SHARED if len(group) > 1 else Origin.MEASURED
        for k in group:
            out[k] = with_thickness(sheets[k], Quantity(value=mean, standard_error=spread, origin=origin))
    if groups:
        means = np.array([out[g[0]].thickness.value for g in groups])
        common = float(means[np.argmax([area[g].sum() for g in groups])])
        for k in np.flatnonzero(~seen):
            out[k] = with_thickness(sheets[k], _unseen(sheets[k].thickness, means, common))
    return tuple(out)


def _unseen(told: Quantity, means: np.ndarray, common: float) -> Quantity:
    """The thickness of the stock that a board's twin is of; without a twin, of the one that it was guessed to be of, or
    else of what most wood is.
    """
    nearest = float(means[np.argmin(np.abs(means - told.value))])
    if told.origin is not Origin.SHARED:
        value = nearest if abs(nearest - told.value) < GUESSED * told.value else common
        return Quantity(value=value, standard_error=0.3 * value, origin=Origin.INFERRED)
    return Quantity(value=nearest, standard_error=told.standard_error, origin=Origin.SHARED)


def _clusters(members: np.ndarray, value: np.ndarray, error: np.ndarray, sigmas: float) -> list[list[int]]:
    """Agglomerate from the nearest pair on, while means differ by less than their joint uncertainty allows."""
    groups = [[int(k)] for k in members]
    while len(groups) > 1:
        means = np.array([np.average(value[g], weights=error[g] ** -2.0) for g in groups])
        order = np.argsort(means, kind="stable")
        gaps = np.diff(means[order])
        k = int(np.argmin(gaps))
        a, b = groups[order[k]], groups[order[k + 1]]
        if gaps[k] > sigmas * np.hypot(error[a].min(), error[b].min()):
            break
        groups = [g for g in groups if g is not a and g is not b] + [a + b]
    return groups
