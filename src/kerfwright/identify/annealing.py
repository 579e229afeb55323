"""Selection as the paper does it: simulated annealing by Metropolis and Hastings (paper, Part Selection).

Kept for comparison with the exact program of `selection.py`. The energy is the squared distance between the cloud and
the chosen boards, lengths in D. The paper takes the total over all points, with temperatures from 10 to 0.1 over 1000
steps; what these temperatures mean then depends on how many points there are, so the mean is offered too. Parts cost
nothing: a board that explains nothing new stays out only by chance.
"""

from __future__ import annotations

import numpy as np
import shapely

from kerfwright.capture.types import Cloud
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.selection import Evidence, Selection, explained_share, program_value
from kerfwright.identify.slabs import Slab

__all__ = ["select_annealing", "surface_distance"]

NOTHING = 1.0  # squared distance, in D, to an empty set of boards
SAMPLES = 10_000  # points of the cloud that stand for all of it


def select_annealing(cloud: Cloud, slabs: list[Slab], evidence: Evidence, options: IdentifyOptions) -> Selection:
    """The set of candidates at which the walk ends; the same for the same seed."""
    rng = np.random.default_rng(options.seed)
    few = np.sort(rng.choice(len(cloud), min(SAMPLES, len(cloud)), replace=False))
    squared = np.array([surface_distance(s, cloud.points[few]) for s in slabs]) ** 2 / cloud.diameter**2
    points = len(cloud) if options.annealing_energy == "total" else 1
    chosen = _walk(squared, points, evidence, options, rng)
    mean = _mean_energy(squared, chosen)
    picked = [int(k) for k in np.flatnonzero(chosen)]
    return Selection(
        tuple(picked), program_value(evidence, picked), None, explained_share(evidence, picked),
        f"annealing, {options.annealing_energy} energy", {"total": mean * len(cloud), "mean": mean},
    )


def surface_distance(slab: Slab, x_in_world: np.ndarray) -> np.ndarray:
    """Distance of (N, 3) places to the slab's surface, (N,) mm."""
    x = slab.to_board(x_in_world)
    flat = shapely.points(x[:, :2])
    inside = shapely.contains_xy(slab.region, x[:, 0], x[:, 1])
    aside = np.where(inside, -1.0, 1.0) * shapely.distance(slab.region.boundary, flat)
    beyond = np.abs(x[:, 2] - slab.thickness.value / 2) - slab.thickness.value / 2
    deepest = np.maximum(aside, beyond)
    return np.where(deepest < 0, -deepest, np.hypot(np.maximum(aside, 0), np.maximum(beyond, 0)))


def _mean_energy(squared: np.ndarray, chosen: np.ndarray) -> float:
    """Mean squared distance of the points (C, S) to the nearest chosen candidate, in D."""
    return float(squared[chosen].min(axis=0, initial=NOTHING).mean())


def _walk(
    squared: np.ndarray, points: int, evidence: Evidence, options: IdentifyOptions, rng: np.random.Generator
) -> np.ndarray:
    """(C,) bool, the last state; temperatures fall by the same factor at every step."""
    chosen = np.zeros(len(squared), bool)
    energy = points * _mean_energy(squared, chosen)
    for temperature in np.geomspace(*options.annealing_temperatures, options.annealing_steps):
        proposed = _proposal(chosen, evidence, rng)
        if proposed is None:
            continue
        other = points * _mean_energy(squared, proposed)
        if other <= energy or rng.random() < np.exp((energy - other) / temperature):
            chosen, energy = proposed, other
    return chosen


def _proposal(chosen: np.ndarray, evidence: Evidence, rng: np.random.Generator) -> np.ndarray | None:
    """A state to go to, or None where the one drawn is forbidden: half the time one part added or removed, else one
    replaced by one that would be in conflict beside it. Both are as likely as their reverse.
    """
    proposed = chosen.copy()
    if rng.random() < 0.5:
        k = int(rng.integers(len(chosen)))
        proposed[k] = not chosen[k]
    else:
        inside, outside = np.flatnonzero(chosen), np.flatnonzero(~chosen)
        if not len(inside) or not len(outside):
            return None
        leaves, comes = rng.choice(inside), rng.choice(outside)
        proposed[comes] = True
        if not _in_conflict(proposed, evidence):
            return None
        proposed[leaves] = False
    return None if _in_conflict(proposed, evidence) else proposed


def _in_conflict(chosen: np.ndarray, evidence: Evidence) -> bool:
    """Whether some part has more than half of its volume in the union of the others."""
    return bool(evidence.broken(np.flatnonzero(chosen).tolist()))
