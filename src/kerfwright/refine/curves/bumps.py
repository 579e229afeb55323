"""Bumps of the boundary that are no shape: a stretch that leaves a line and comes back to it, short, shallow, with
easy sides.

Shadows, glue and missed pixels make them. A notch that a saw made has steep sides, however shallow it is, and stays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.ranges import LINE
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.shape import Shape
from kerfwright.refine.curves.snap import GuideLine, is_bump
from kerfwright.refine.curves.solve import Fit, solve

__all__ = ["joined", "without_bumps"]


def without_bumps(
    fit: Fit, samples: Samples, guides: list[GuideLine], options: CurveOptions
) -> tuple[Fit, Samples, list[np.ndarray]]:
    """The fit with bumps taken out of its lines, samples that give no weight to them, and where (2,) each was."""
    places: list[np.ndarray] = []
    while (found := _first_bump(fit.shape, samples, options)) is not None:
        k, count = found
        first, last = fit.shape.ranges[(k + 1) % fit.shape.count][0], fit.shape.ranges[(k + count) % fit.shape.count][1]
        place = samples.points[((first + last) // 2) % samples.count] if last >= first else samples.points[first]
        weight = samples.weight.copy()
        weight[np.arange(first, last if last >= first else last + samples.count) % samples.count] = 0.0
        samples = replace(samples, weight=weight)
        fit = solve(joined(fit.shape, k, count + 2, samples.count), samples, guides)
        places.append(place)
    return fit, samples, places


def _first_bump(shape: Shape, samples: Samples, options: CurveOptions) -> tuple[int, int] | None:
    """The line before a bump and how many edges the bump has."""
    for count in (1, 2, 3, 4):
        for k in range(shape.count):
            if shape.count - count >= 5 and _is_bump_between(shape, k, count, samples, options):
                return k, count
    return None


def _is_bump_between(shape: Shape, k: int, count: int, samples: Samples, options: CurveOptions) -> bool:
    n = shape.count
    a, b = k, (k + count + 1) % n
    if shape.kinds[a] != LINE or shape.kinds[b] != LINE or shape.lines[a] != shape.lines[b]:
        return False
    start, end = shape.node(a), shape.node(a + 1)
    length = float(np.linalg.norm(end - start))
    other = shape.node(b + 1) - shape.node(b)
    if min(length, float(np.linalg.norm(other))) < options.bump_length / 2:
        return False
    direction = (end - start) / length
    normal = np.array([-direction[1], direction[0]])
    away = max(abs(float(normal @ (p - start))) for p in (shape.node(b), shape.node(b + 1)))
    straight = float(direction @ other) / float(np.linalg.norm(other)) > 0.999
    if not straight or away > 0.02 * (length + np.linalg.norm(other)) + 1.0:
        return False
    first, last = shape.ranges[(a + 1) % n][0], shape.ranges[b][0]
    last += samples.count if last < first else 0
    return is_bump(samples, first, last, direction, float(normal @ start), options)


def joined(shape: Shape, first: int, count: int, total: int) -> Shape:
    """Edges first .. first + count - 1 as one line."""
    n = shape.count
    kept = [(first + count + i) % n for i in range(n - count)]
    starts = [first, *kept]
    begin = shape.ranges[first][0]
    end = shape.ranges[(first + count - 1) % n][1] % total
    span = (begin, end if end > begin else end + total)
    kinds = (LINE, *(shape.kinds[k] for k in kept))
    smooth = tuple(shape.smooth[k] and (kinds[i] != LINE or kinds[i - 1] != LINE) for i, k in enumerate(starts))
    unknowns = [*(shape.node(k) for k in starts), *(shape.unknowns[shape.extra(k)] for k in kept)]
    lines = (shape.lines[first], *(shape.lines[k] for k in kept))
    return Shape(np.concatenate(unknowns), kinds, lines, smooth, (span, *(shape.ranges[k] for k in kept)))
