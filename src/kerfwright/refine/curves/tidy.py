"""Nodes that are of no use in a fitted chain: of edges too short for any saw, and between lines that run straight on.

Moves of structure look at chi-square alone; an arc of a millimetre in a corner may lower it, and relations may lay two
lines on one. Neither is a cut of its own.
"""

from __future__ import annotations

import numpy as np

from kerfwright.refine.curves.chain import SPIKE
from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.ranges import LINE
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.shape import Shape, end_turn
from kerfwright.refine.curves.snap import GuideLine
from kerfwright.refine.curves.solve import Fit, solve, taken_stock

__all__ = ["FARTHEST", "do_cross", "is_sound", "without_edges", "without_slivers", "without_straight_nodes"]

SLIVER = 0.8  # of the shortest edge; dynamic programming offers none below either
STRAIGHT = 1e-6  # radians: lines that relations made collinear
LEAST_EDGES = 3
FARTHEST = 30.0  # mm between a node and the boundary, which may lack a corner
SHARPEST = 0.1  # sine of the angle between lines below which their crossing is nowhere near


def without_slivers(fit: Fit, samples: Samples, guides: list[GuideLine], options: CurveOptions) -> Fit:
    """The fit with edges too short to be cut taken out, shortest first: their neighbours meet in a corner."""
    needed: set[tuple[int, int]] = set()
    while fit.shape.count > LEAST_EDGES:
        k = _shortest(fit.shape, SLIVER * options.shortest_edge, needed)
        if k is None:
            break
        trial = solve(without_edges(fit.shape, k, 1, samples.count), samples, guides)
        if is_sound(trial.shape, samples) or not is_sound(fit.shape, samples):
            fit = trial
        else:
            needed.add(fit.shape.ranges[k])
    return fit


def _shortest(shape: Shape, least: float, needed: set[tuple[int, int]]) -> int | None:
    """The shortest edge below `least` that is on no guide line and not known to be needed."""
    length = np.linalg.norm(np.roll(shape.nodes, -1, axis=0) - shape.nodes, axis=1)
    short = [k for k in range(shape.count) if length[k] < least and shape.lines[k] < 0]
    return min((k for k in short if shape.ranges[k] not in needed), key=lambda k: (length[k], k), default=None)


def is_sound(shape: Shape, samples: Samples) -> bool:
    """Whether the path neither turns back at a node, which no saw can cut, nor leaves the boundary for a node far off.

    A smooth arc between two lines that are nearly one can do both at no cost of chi-square.
    """
    if any(abs(end_turn(shape, k)) > SPIKE for k in range(shape.count)):
        return False
    gap = np.linalg.norm(samples.points[None] - shape.nodes[:, None], axis=2).min(axis=1)
    return bool(gap.max() < FARTHEST) and all(_runs_on(shape, k, samples) for k in range(shape.count))


def _runs_on(shape: Shape, k: int, samples: Samples) -> bool:
    """Whether a line runs the way that its stretch of the boundary does."""
    if shape.kinds[k] != LINE:
        return True
    first, last = shape.ranges[k]
    chord = samples.points[last % samples.count] - samples.points[first % samples.count]
    return float(chord @ (shape.node(k + 1) - shape.node(k))) > 0


def without_edges(shape: Shape, first: int, count: int, total: int) -> Shape:
    """The chain of `total` samples whose edges before and after edges first .. first + count - 1 meet in a sharp node.
    """
    n = shape.count
    order = [(first + count + i) % n for i in range(n - count)]  # the edge after the gap first, the one before it last
    after, before = order[0], order[-1]
    gap = sum(b - a for a, b in (shape.ranges[(first + i) % n] for i in range(count)))
    ranges = {i: shape.ranges[i] for i in order}
    ranges[before] = (ranges[before][0], ranges[before][1] + gap // 2)
    start, length = ranges[before][1] % total, gap - gap // 2 + ranges[after][1] - ranges[after][0]
    ranges[after] = (start, start + length)
    nodes = [_meeting(shape, before, after), *(shape.node(i) for i in order[1:])]
    inner = [shape.unknowns[shape.extra(i)] for i in order]
    return Shape(
        np.concatenate([*nodes, *inner]), tuple(shape.kinds[i] for i in order), tuple(shape.lines[i] for i in order),
        (False, *(shape.smooth[i] for i in order[1:])), tuple(ranges[i] for i in order),
    )  # fmt: skip


def _meeting(shape: Shape, before: int, after: int) -> np.ndarray:
    """Where the lines before and after a gap cross, or its middle."""
    a, b = shape.node(before + 1), shape.node(after)
    if do_cross(shape, before, after):
        u, v = _direction(shape, before), _direction(shape, after)
        return a + u * np.linalg.solve(np.column_stack([u, -v]), b - a)[0]
    return (a + b) / 2


def do_cross(shape: Shape, before: int, after: int) -> bool:
    """Whether two edges are lines at a clear angle."""
    if not shape.kinds[before] == shape.kinds[after] == LINE:
        return False
    u, v = _direction(shape, before), _direction(shape, after)
    return bool(abs(u[0] * v[1] - u[1] * v[0]) > SHARPEST)


def _direction(shape: Shape, k: int) -> np.ndarray:
    chord = shape.node(k + 1) - shape.node(k)
    return chord / max(float(np.linalg.norm(chord)), 1e-9)


def without_straight_nodes(fit: Fit, samples: Samples) -> Fit:
    """The fit with lines that lie on one line as one edge each."""
    shape = fit.shape
    while shape.count > LEAST_EDGES and (k := _straight_node(shape)) is not None:
        merged, kept = _merged(shape, k)
        fit = taken_stock(merged, samples, fit.covariance[np.ix_(kept, kept)], fit.violation)
        shape = merged
    return fit


def _straight_node(shape: Shape) -> int | None:
    for k in range(shape.count):
        known = {shape.lines[k], shape.lines[k - 1]} - {-1}
        if shape.kinds[k] == shape.kinds[k - 1] == LINE and len(known) < 2 and abs(end_turn(shape, k)) < STRAIGHT:
            return k
    return None


def _merged(shape: Shape, k: int) -> tuple[Shape, np.ndarray]:
    """The chain without node k, and which unknowns it keeps."""
    n, before = shape.count, (k - 1) % shape.count
    span = shape.ranges[before][0], shape.ranges[before][1] + shape.ranges[k][1] - shape.ranges[k][0]
    ranges = [span if i == before else r for i, r in enumerate(shape.ranges)]
    lines = list(shape.lines)
    lines[before] = max(lines[before], lines[k])
    left = [i for i in range(n) if i != k]
    kept = np.array([i for i in range(len(shape.unknowns)) if i not in (2 * k, 2 * k + 1)])
    return Shape(
        shape.unknowns[kept], tuple(shape.kinds[i] for i in left), tuple(lines[i] for i in left),
        tuple(shape.smooth[i] for i in left), tuple(ranges[i] for i in left),
    ), kept  # fmt: skip
