"""Change the structure of a fitted chain where that pays: smooth a node, merge edges, change an edge's kind.

Dynamic programming prices nodes from free fits of ranges that end at candidate points. Once all unknowns are fitted
together the same price can be put on the real thing, and small changes of structure are tried, the most promising
first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kerfwright.refine.curves.chain import GUIDED, unit_price
from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.prices import CHEAPEST_LINE, edge_prices, line_prices
from kerfwright.refine.curves.ranges import ARC, CUBIC, LINE, fit_range, line_chi2
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.shape import Shape, end_turn
from kerfwright.refine.curves.snap import GuideLine
from kerfwright.refine.curves.solve import Fit, solve
from kerfwright.refine.curves.start import inner_unknowns

__all__ = ["improve", "score"]

MOST_TRIALS = 40
LONGEST_SPLIT = 60.0  # mm: longer curves are no corners
MOST_TURN = 0.7  # radians: a sharp node that turns more is not tried smooth


@dataclass(frozen=True)
class _Move:
    """Edges first .. first + count - 1 (round the loop) become one edge of a kind.

    With no edges node `first` becomes smooth; with `split`, a sample, edge `first` becomes two lines that meet there.
    """

    first: int
    count: int
    kind: int
    gain: float  # estimated
    split: int = -1


def score(fit: Fit, samples: Samples, options: CurveOptions) -> float:
    """Chi-square and the price of the structure: what is minimised."""
    price = charges(fit.shape, samples).sum() - sum(fit.shape.smooth)
    return fit.chi2 + unit_price(samples, options) * float(price)


def charges(shape: Shape, samples: Samples) -> np.ndarray:
    """(n,) prices of the edges, in degrees of freedom."""
    sides = np.roll(shape.nodes, -1, axis=0) - shape.nodes
    length = np.maximum(np.linalg.norm(sides, axis=1), 1e-6)
    independent = np.maximum(length / (2 * samples.correlation), 1.0)
    error = np.sqrt(12 / independent) * float(samples.sigma.mean()) / length
    lines = line_prices(sides, error, samples.main_direction)
    kinds = np.array(shape.kinds)
    return np.where(np.array(shape.lines) >= 0, GUIDED, np.where(kinds == LINE, lines, edge_prices()[kinds]))


def improve(fit: Fit, samples: Samples, guides: list[GuideLine], options: CurveOptions) -> Fit:
    """Take moves that lower the score until none does."""
    best, trials, tried = score(fit, samples, options), 0, set()
    while trials < MOST_TRIALS:
        for move in _moves(fit, samples, options):
            key = _key(fit.shape, move)
            if key in tried or trials >= MOST_TRIALS:
                continue
            tried.add(key)
            trials += 1
            trial = solve(_applied(fit.shape, move, samples), samples, guides, steps=12)
            if score(trial, samples, options) < best - 1e-6:
                fit = settled(trial, samples, guides)
                best = score(fit, samples, options)
                break
        else:
            return fit
    return fit


def settled(fit: Fit, samples: Samples, guides: list[GuideLine]) -> Fit:
    """Fit again with the ranges of the edges moved to where the nodes have gone."""
    return solve(_with_ranges(fit.shape, samples), samples, guides)


def _with_ranges(shape: Shape, samples: Samples) -> Shape:
    starts = []
    reach = samples.steps(25.0)
    for k, (first, _) in enumerate(shape.ranges):
        window = np.arange(first - reach, first + reach + 1)
        gap = np.linalg.norm(samples.points[window % samples.count] - shape.node(k), axis=1)
        starts.append(int(window[gap.argmin()]))
    ranges = []
    for k, start in enumerate(starts):
        stop = starts[(k + 1) % len(starts)]
        while stop <= start:
            stop += samples.count
        ranges.append((start % samples.count, start % samples.count + stop - start))
    turns = sum(stop - start for start, stop in ranges)
    return (
        Shape(shape.unknowns, shape.kinds, shape.lines, shape.smooth, tuple(ranges))
        if turns == samples.count
        else shape
    )


def _key(shape: Shape, move: _Move) -> tuple:
    nodes = tuple(round(shape.ranges[(move.first + i) % shape.count][0] / 8) for i in range(move.count + 1))
    return (nodes, move.kind, move.split >= 0, shape.count)


def _moves(fit: Fit, samples: Samples, options: CurveOptions) -> list[_Move]:
    found = [*_smoothings(fit, samples, options), *_merges(fit, samples, options), *_splits(fit, samples, options)]
    return sorted((m for m in found if m.gain > 0), key=lambda m: (-m.gain, m.first, m.count, m.kind))


def _smoothings(fit: Fit, samples: Samples, options: CurveOptions) -> Iterator[_Move]:
    """Sharp nodes that turn little, one of whose edges is curved."""
    shape, price = fit.shape, unit_price(samples, options)
    for k in range(shape.count):
        curved = shape.kinds[k] != LINE or shape.kinds[k - 1] != LINE
        turn = end_turn(shape, k)
        if not shape.smooth[k] and curved and abs(turn) < MOST_TURN:
            yield _Move(k, 0, -1, price * (1.0 - abs(turn)))


def _merges(fit: Fit, samples: Samples, options: CurveOptions) -> Iterator[_Move]:
    """One, two or three edges as one of any kind, where a free fit of their range promises a lower score."""
    shape, price = fit.shape, unit_price(samples, options)
    now = np.bincount(fit.edge, samples.weight * fit.distance**2, minlength=shape.count)
    charge = charges(shape, samples)
    for count in (1, 2, 3):
        if shape.count - count < 1:
            continue
        for first in range(shape.count):
            edges = [(first + i) % shape.count for i in range(count)]
            if any(shape.lines[k] >= 0 for k in edges):
                continue
            span = _span(shape, first, count, samples.count)
            paid = sum(now[k] + price * charge[k] for k in edges)
            paid -= price * sum(shape.smooth[k] for k in edges[1:])
            for kind in (LINE, ARC, CUBIC):
                if count == 1 and kind == shape.kinds[first]:
                    continue
                gain = (
                    paid
                    - fit_range(samples, *span, kind)
                    - price * _least(kind)
                    + price * _allowance(shape, first, count, samples)
                )
                yield _Move(first, count, kind, gain)


def _splits(fit: Fit, samples: Samples, options: CurveOptions) -> Iterator[_Move]:
    """Short curves that may be corners of two lines: dynamic programming only has the corners that it was offered."""
    shape, price = fit.shape, unit_price(samples, options)
    now = np.bincount(fit.edge, samples.weight * fit.distance**2, minlength=shape.count)
    charge = charges(shape, samples)
    for k, (first, last) in enumerate(shape.ranges):
        at = np.arange(first + 2, last - 1)
        if shape.kinds[k] == LINE or (last - first) * samples.spacing > LONGEST_SPLIT or not len(at):
            continue
        ends = np.full(len(at), first), np.full(len(at), min(last, 2 * samples.count - 1))
        both = line_chi2(samples, ends[0], at) + line_chi2(samples, at, ends[1])
        best = int(both.argmin())
        paid = now[k] + price * (charge[k] - shape.smooth[k] - shape.smooth[(k + 1) % shape.count])
        yield _Move(k, 1, LINE, paid - float(both[best]) - price * 2 * CHEAPEST_LINE, int(at[best]))


def _allowance(shape: Shape, first: int, count: int, samples: Samples) -> float:
    """How much a move may look worse than it is, as its nodes stay where they are in the estimate.

    The nodes of a short curve or of a cubic between smooth nodes can move far for the size of the edge.
    """
    if count > 1 or shape.kinds[first] == LINE:
        return float(count)
    start, stop = shape.ranges[first]
    return 6.0 if shape.kinds[first] == CUBIC or (stop - start) * samples.spacing < LONGEST_SPLIT else 1.0


def _least(kind: int) -> float:
    return CHEAPEST_LINE if kind == LINE else float(edge_prices()[kind])


def _span(shape: Shape, first: int, count: int, total: int) -> tuple[int, int]:
    start = shape.ranges[first][0]
    length = sum(b - a for a, b in (shape.ranges[(first + i) % shape.count] for i in range(count)))
    return start, start + length


def _applied(shape: Shape, move: _Move, samples: Samples) -> Shape:
    """The structure after a move, its unknowns near their best."""
    if move.count == 0:
        smooth = tuple(s or k == move.first for k, s in enumerate(shape.smooth))
        return Shape(shape.unknowns, shape.kinds, shape.lines, smooth, shape.ranges)
    if move.split >= 0:
        return _halved(shape, move, samples)
    n = shape.count
    order = [(move.first + i) % n for i in range(n)]
    kept = order[move.count :]
    starts = [move.first, *kept]
    kinds = (move.kind, *(shape.kinds[k] for k in kept))
    lines = (-1, *(shape.lines[k] for k in kept))
    ranges = (_span(shape, move.first, move.count, samples.count), *(shape.ranges[k] for k in kept))
    smooth = tuple(shape.smooth[k] and not _both_lines(kinds, i) for i, k in enumerate(starts))
    nodes = [shape.node(k) for k in starts]
    inner = [inner_unknowns(move.kind, nodes[0], nodes[1 % len(nodes)], samples, ranges[0])]
    inner += [shape.unknowns[shape.extra(k)].tolist() for k in kept]
    return Shape(np.concatenate([*nodes, *map(np.array, inner)]), kinds, lines, smooth, ranges)


def _both_lines(kinds: tuple[int, ...], i: int) -> bool:
    return kinds[i] == LINE and kinds[i - 1] == LINE


def _halved(shape: Shape, move: _Move, samples: Samples) -> Shape:
    """Edge `move.first` as two lines with a sharp node between them."""
    k, n = move.first, shape.count
    order = [k, -1, *((k + 1 + i) % n for i in range(n - 1))]
    first, last = shape.ranges[k]
    ranges = ((first, move.split), (move.split % samples.count, move.split % samples.count + last - move.split))
    nodes = [shape.node(k), samples.points[move.split % samples.count], *(shape.node(i) for i in order[2:])]
    kinds = (LINE, LINE, *(shape.kinds[i] for i in order[2:]))
    smooth = tuple(i >= 0 and shape.smooth[i] and not _both_lines(kinds, at) for at, i in enumerate(order))
    lines = (-1, -1, *(shape.lines[i] for i in order[2:]))
    inner = [shape.unknowns[shape.extra(i)] for i in order[2:]]
    return Shape(
        np.concatenate([*nodes, *inner]), kinds, lines, smooth, (*ranges, *(shape.ranges[i] for i in order[2:]))
    )
