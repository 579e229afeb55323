"""Edges that are straight, traced with steps: an eased edge shows two lines, and a boundary that follows one of them
here and the other there has steps as high as the easing, too long for bumps.

From one sharp corner to the next, a boundary that stays that near to one line is that line, unless it bows evenly.
Where it runs on two levels, the outer one is where the board ends; a line between the two would run aslant.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kerfwright.refine.curves.bumps import joined
from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.ranges import LINE
from kerfwright.refine.curves.samples import LEAST_WEIGHT, Samples
from kerfwright.refine.curves.shape import Shape, end_turn
from kerfwright.refine.curves.snap import GuideLine
from kerfwright.refine.curves.solve import Fit, solve
from kerfwright.refine.curves.tidy import LEAST_EDGES, is_sound

__all__ = ["with_straight_edges"]

MOST_EDGES = 5  # of such a stretch
BOWED = 0.7  # of the squared distances to the line that an even bow explains: then it is one
QUANTILE = 0.9  # of the distances that must be small; corners are traced round
CHORD = 12.0  # mm to both sides of a place, over which its direction is taken
LEVEL_SIGMAS = 2.0  # standard errors of a place by which it may lie off its level
LEVEL_SHARE, INNER_SHARE = 0.35, 0.15  # of a stretch that the outer level must hold, and the inner one


def with_straight_edges(
    fit: Fit, samples: Samples, guides: list[GuideLine], options: CurveOptions
) -> tuple[Fit, Samples]:
    """The fit with stretches between sharp corners made lines that lie no further than `options.easing` from one, and
    samples that give next to no weight to what of them lies on the inner of two levels.
    """
    k = 0
    while k < fit.shape.count:
        trial = _straight_from(fit.shape, k, samples, guides, options)
        is_settled = trial is None or trial[0].shape.count == fit.shape.count
        fit, samples = trial or (fit, samples)
        k += is_settled
    return fit, samples


def _straight_from(
    shape: Shape, first: int, samples: Samples, guides: list[GuideLine], options: CurveOptions
) -> tuple[Fit, Samples] | None:
    """The fit with the stretch that begins at a sharp node as one line; None where it is no line, or one already that
    does not lie between two levels.
    """
    if not _is_sharp(shape, first, options):
        return None
    count = next((c for c in range(1, MOST_EDGES + 1) if _is_sharp(shape, first + c, options)), 0)
    edges = [(first + i) % shape.count for i in range(count)]
    if not edges or shape.count - count + 1 < LEAST_EDGES:
        return None
    if any(shape.lines[k] >= 0 for k in edges):
        return None
    stretch = _stretch(shape, edges, samples)
    if not _is_nearly_straight(stretch, samples, options):
        return None
    told, is_line = _on_outer_level(stretch, samples), count == 1 and shape.kinds[first] == LINE
    if is_line and told is samples:
        return None
    trial = solve(shape if is_line else joined(shape, first, count, samples.count), told, guides)
    return (trial, told) if is_sound(trial.shape, told) else None


def _stretch(shape: Shape, edges: list[int], samples: Samples) -> np.ndarray:
    """Indices of the samples of edges in turn."""
    begin, end = shape.ranges[edges[0]][0], shape.ranges[edges[-1]][1] % samples.count
    end += samples.count if end <= begin else 0
    return np.arange(begin, end + 1) % samples.count


def _on_outer_level(stretch: np.ndarray, samples: Samples) -> Samples:
    """Samples that give next to no weight to the inner of two levels that a stretch runs on, if it does.

    The wood lies to the left of a boundary, so that the outer level is the one furthest to the right.
    """
    along = samples.directions(CHORD)[stretch]
    along = np.median(along, axis=0) / np.linalg.norm(np.median(along, axis=0))
    height = samples.points[stretch] @ np.array([along[1], -along[0]])
    width = LEVEL_SIGMAS * float(np.median(samples.sigma[stretch]))
    ordered = np.sort(height)
    held = np.searchsorted(ordered, ordered + width) - np.searchsorted(ordered, ordered - width)
    levels = ordered[held >= LEVEL_SHARE * len(ordered)]
    if not len(levels):
        return samples
    near = ordered[np.abs(ordered - levels[-1]) < 2 * width]
    outer = float(np.median(near))
    inner = height < outer - 2 * width
    if inner.mean() < INNER_SHARE:
        return samples
    weight = samples.weight.copy()
    weight[stretch[np.abs(height - outer) > 2 * width]] *= LEAST_WEIGHT
    return replace(samples, weight=weight)


def _is_sharp(shape: Shape, k: int, options: CurveOptions) -> bool:
    return not shape.smooth[k % shape.count] and abs(end_turn(shape, k % shape.count)) > options.sharp_angle


def _is_nearly_straight(stretch: np.ndarray, samples: Samples, options: CurveOptions) -> bool:
    if (len(stretch) - 1) * samples.spacing < options.straight_length:
        return False
    points = samples.points[stretch]
    centred = points - points.mean(axis=0)
    along, across = np.linalg.svd(centred, full_matrices=False)[2]
    u, away = centred @ along, centred @ across
    if np.quantile(np.abs(away), QUANTILE) > options.easing:
        return False
    left = away - np.polynomial.Polynomial.fit(u, away, 2)(u)
    return bool((left**2).sum() > (1 - BOWED) * (away**2).sum())
