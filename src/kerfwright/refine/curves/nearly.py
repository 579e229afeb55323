"""Edges that are straight, traced with steps: an eased edge shows two lines, and a boundary that follows one of them
here and the other there has steps as high as the easing, too long for bumps.

From one sharp corner to the next, a boundary that stays that near to one line is that line, unless it bows evenly.
"""

from __future__ import annotations

import numpy as np

from kerfwright.refine.curves.bumps import joined
from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.ranges import LINE
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.shape import Shape, end_turn
from kerfwright.refine.curves.snap import GuideLine
from kerfwright.refine.curves.solve import Fit, solve
from kerfwright.refine.curves.tidy import LEAST_EDGES, is_sound

__all__ = ["with_straight_edges"]

MOST_EDGES = 5  # of such a stretch
BOWED = 0.7  # of the squared distances to the line that an even bow explains: then it is one
QUANTILE = 0.9  # of the distances that must be small; corners are traced round


def with_straight_edges(fit: Fit, samples: Samples, guides: list[GuideLine], options: CurveOptions) -> Fit:
    """The fit with stretches between sharp corners made lines that lie no further than `options.easing` from one."""
    k = 0
    while k < fit.shape.count:
        trial = _straight_from(fit.shape, k, samples, guides, options)
        fit, k = (fit, k + 1) if trial is None else (trial, k)
    return fit


def _straight_from(
    shape: Shape, first: int, samples: Samples, guides: list[GuideLine], options: CurveOptions
) -> Fit | None:
    """The fit with the stretch that begins at a sharp node as one line; None where it is one already, or no line."""
    if not _is_sharp(shape, first, options):
        return None
    count = next((c for c in range(1, MOST_EDGES + 1) if _is_sharp(shape, first + c, options)), 0)
    edges = [(first + i) % shape.count for i in range(count)]
    if not edges or (count == 1 and shape.kinds[first] == LINE) or shape.count - count + 1 < LEAST_EDGES:
        return None
    if any(shape.lines[k] >= 0 for k in edges) or not _is_nearly_straight(shape, edges, samples, options):
        return None
    trial = solve(joined(shape, first, count, samples.count), samples, guides)
    return trial if is_sound(trial.shape, samples) else None


def _is_sharp(shape: Shape, k: int, options: CurveOptions) -> bool:
    return not shape.smooth[k % shape.count] and abs(end_turn(shape, k % shape.count)) > options.sharp_angle


def _is_nearly_straight(shape: Shape, edges: list[int], samples: Samples, options: CurveOptions) -> bool:
    begin, end = shape.ranges[edges[0]][0], shape.ranges[edges[-1]][1] % samples.count
    end += samples.count if end <= begin else 0
    if (end - begin) * samples.spacing < options.straight_length:
        return False
    points = samples.points[np.arange(begin, end + 1) % samples.count]
    centred = points - points.mean(axis=0)
    along, across = np.linalg.svd(centred, full_matrices=False)[2]
    u, away = centred @ along, centred @ across
    if np.quantile(np.abs(away), QUANTILE) > options.easing:
        return False
    left = away - np.polynomial.Polynomial.fit(u, away, 2)(u)
    return bool((left**2).sum() > (1 - BOWED) * (away**2).sum())
