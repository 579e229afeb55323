"""Change the structure of a fitted chain where that pays: smooth a node, merge edges, change an edge's kind.

Dynamic programming prices nodes from free fits of ranges that end at candidate points. Once all unknowns are fitted
together the same price can be put on the real thing, and small changes of structure are tried, the most promising
first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kerfwright.refine.curves.bumps import joined
from kerfwright.refine.curves.chain import GUIDED, SPIKE, unit_price
from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.prices import CHEAPEST_LINE, edge_prices, line_prices
from kerfwright.refine.curves.ranges import ARC, CUBIC, LINE, fit_range, line_chi2
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.shape import Shape, end_turn
from kerfwright.refine.curves.snap import GuideLine
from kerfwright.refine.curves.solve import Fit, solve
from kerfwright.refine.curves.start import inner_unknowns
from kerfwright.refine.curves.tidy import FARTHEST, do_cross, is_sound, without_edges

__all__ = ["improve", "score"]

MOST_TRIALS = 40
UNSOUND = 1e9

FILLET_REACH = 80.0  # mm that the nodes of a curve may move when it becomes a fillet
TINY_WEIGHT = 1e-12  # that a stretch without any still has a middle
SHORTEST_SIDE = 1e-6  # mm; of a line beside a fillet
SHARPEST_FILLET = 0.1  # radians between lines below which their corner is nowhere
LONGEST_SPLIT = 60.0  # mm: longer curves are no corners
DROP = -2
# Chi-square an observation: in 3 of 10 doubtful places any error up to 20 mm is as likely as another, in the others it
# is normal, of 2 mm (4.5); and what was mistaken was so over twice the length that noise is correlated over.
DOUBTED_MOST = 2.25
MOST_TURN = 0.7  # radians: a sharp node that turns more is not tried smooth


@dataclass(frozen=True)
class _Move:
    """Edges first .. first + count - 1 (round the loop) become one edge of a kind.

    With no edges node `first` becomes smooth; with `split`, samples, edge `first` becomes lines that meet there. DROP
    takes the edges out: the lines on both sides meet, or become one.
    """

    first: int
    count: int
    kind: int
    gain: float  # estimated
    split: tuple[int, ...] = ()


def score(fit: Fit, samples: Samples, options: CurveOptions) -> float:
    """Chi-square and the price of the structure: what is minimised."""
    price = charges(fit.shape, samples).sum() - sum(fit.shape.smooth)
    return believed_chi2(fit, samples) + unit_price(samples, options) * float(price)


def believed_chi2(fit: Fit, samples: Samples) -> float:
    """Chi-square, limited where the boundary is doubted: errors there come out of a mixture with wide tails."""
    each = samples.weight * fit.distance**2
    most = DOUBTED_MOST * samples.spacing / (2 * samples.correlation)
    return float(np.where(samples.doubted, np.minimum(each, most), each).sum())


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
    best, trials, tried = _value(fit, samples, options), 0, set()
    while trials < MOST_TRIALS:
        for move in _moves(fit, samples, options):
            key = _key(fit.shape, move)
            if key in tried or trials >= MOST_TRIALS:
                continue
            tried.add(key)
            trials += 1
            trial = solve(_applied(fit.shape, move, samples), samples, guides, steps=20)
            if _value(trial, samples, options) < best - 1e-6:
                fit = settled(trial, samples, guides)
                best = _value(fit, samples, options)
                break
        else:
            return fit
    return fit


def _value(fit: Fit, samples: Samples, options: CurveOptions) -> float:
    """The score; of a path that cannot be cut, more than that of any other."""
    return score(fit, samples, options) + (0.0 if is_sound(fit.shape, samples) else UNSOUND)


def settled(fit: Fit, samples: Samples, guides: list[GuideLine]) -> Fit:
    """Fit again with the ranges of the edges moved to where the nodes have gone."""
    return solve(_with_ranges(fit.shape, samples), samples, guides)


def _with_ranges(shape: Shape, samples: Samples, millimetres: float = 25.0) -> Shape:
    starts = []
    reach = samples.steps(millimetres)
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
    return (nodes, move.kind, len(move.split), shape.count)


def _moves(fit: Fit, samples: Samples, options: CurveOptions) -> list[_Move]:
    found = [*_smoothings(fit, samples, options), *_merges(fit, samples, options), *_splits(fit, samples, options)]
    found += _drops(fit, samples, options)
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
    charge, sure = charges(shape, samples), samples.without_doubt
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
                    - fit_range(sure, *_believed(span, shape, first, count, kind), kind)
                    - price * _least(kind)
                    + price * _allowance(shape, first, count, kind, samples)
                )
                yield _Move(first, count, kind, gain)


def _drops(fit: Fit, samples: Samples, options: CurveOptions) -> Iterator[_Move]:
    """One to three edges between lines that follow a boundary which is doubted for the most part."""
    shape, price = fit.shape, unit_price(samples, options)
    charge = charges(shape, samples)
    for count in (1, 2, 3):
        for first in range(shape.count if shape.count - count >= 3 else 0):
            edges = [(first + i) % shape.count for i in range(count)]
            span = _span(shape, first, count, samples.count)
            inside = samples.doubted[np.arange(span[0], span[1] + 1) % samples.count]
            known = any(shape.lines[k] >= 0 for k in edges)
            if not known and inside.mean() > 0.5 and _can_close(shape, first - 1, first + count):
                saved = sum(charge[k] - shape.smooth[k] for k in edges)
                yield _Move(first, count, DROP, price * float(saved) - DOUBTED_MOST * _observations(inside, samples))


def _observations(chosen: np.ndarray, samples: Samples) -> float:
    return float(chosen.sum()) * samples.spacing / (2 * samples.correlation)


def _can_close(shape: Shape, before: int, after: int) -> bool:
    """Whether two edges are lines that cross, or may be one."""
    a, b = before % shape.count, after % shape.count
    return do_cross(shape, a, b) or (shape.kinds[a] == shape.kinds[b] == LINE and shape.lines[a] == shape.lines[b])


def _splits(fit: Fit, samples: Samples, options: CurveOptions) -> Iterator[_Move]:
    """Short or ill-fitting curves that may be two or three lines: dynamic programming has only some corners to
    offer.
    """
    shape, price = fit.shape, unit_price(samples, options)
    now = np.bincount(fit.edge, samples.weight * fit.distance**2, minlength=shape.count)
    charge = charges(shape, samples)
    for k, (first, last) in enumerate(shape.ranges):
        short = (last - first) * samples.spacing < LONGEST_SPLIT
        if shape.kinds[k] == LINE or last - first < 6 or not (short or now[k] > 4 * price):
            continue
        paid = now[k] + price * (charge[k] - shape.smooth[k] - shape.smooth[(k + 1) % shape.count])
        for parts in (2, 3):
            split, chi2 = _best_split(samples, first, min(last, 2 * samples.count - 1), parts)
            yield _Move(k, 1, LINE, paid - chi2 - price * parts * CHEAPEST_LINE, split)


def _best_split(samples: Samples, first: int, last: int, parts: int) -> tuple[tuple[int, ...], float]:
    """Samples between which 2 or 3 free lines fit best, and their chi-square."""
    at = np.unique(np.linspace(first + 2, last - 2, min(last - first - 3, 60)).astype(int))
    head = line_chi2(samples, np.full(len(at), first), at)
    tail = line_chi2(samples, at, np.full(len(at), last))
    if parts == 2:
        best = int((head + tail).argmin())
        return (int(at[best]),), float((head + tail)[best])
    a, b = np.nonzero(at[None, :] - at[:, None] >= 3)
    if not len(a):
        return (int(at[0]),), np.inf
    total = head[a] + line_chi2(samples, at[a], at[b]) + tail[b]
    best = int(total.argmin())
    return (int(at[a[best]]), int(at[b[best]])), float(total[best])


def _believed(span: tuple[int, int], shape: Shape, first: int, count: int, kind: int) -> tuple[int, int]:
    """The part of a range that is sure to stay in the edge: a cubic that should be an arc may have eaten into its
    lines.
    """
    if count > 1 or kind != ARC or shape.kinds[first] != CUBIC:
        return span
    margin = (span[1] - span[0]) // 3
    return span[0] + margin * shape.smooth[first], span[1] - margin * shape.smooth[(first + 1) % shape.count]


def _allowance(shape: Shape, first: int, count: int, kind: int, samples: Samples) -> float:
    """How much a move may look worse than it is, as its nodes stay where they are in the estimate.

    The nodes of a short curve or of a cubic between smooth nodes can move far for the size of the edge.
    """
    if count > 1:
        return 4.0
    if shape.kinds[first] == LINE or kind == CUBIC:
        return 1.0
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
    if move.split:
        return _cut_up(shape, move, samples)
    if move.kind == DROP:
        before, after = (move.first - 1) % shape.count, (move.first + move.count) % shape.count
        if do_cross(shape, before, after):
            return without_edges(shape, move.first, move.count, samples.count)
        return joined(shape, before, move.count + 2, samples.count)
    n = shape.count
    order = [(move.first + i) % n for i in range(n)]
    kept = order[move.count :]
    starts = [move.first, *kept]
    kinds = (move.kind, *(shape.kinds[k] for k in kept))
    lines = (-1, *(shape.lines[k] for k in kept))
    ranges = (_span(shape, move.first, move.count, samples.count), *(shape.ranges[k] for k in kept))
    smooth = tuple(shape.smooth[k] and not _both_lines(kinds, i) for i, k in enumerate(starts))
    nodes = [shape.node(k) for k in starts]
    if move.kind == LINE and len(starts) > 2:
        nodes[0], nodes[1] = _line_ends(nodes[:2], kept[-1], kept[0], shape, samples.without_doubt, ranges[0])
    fillet = _fillet(shape, move, samples) if move.kind == ARC and smooth[0] and smooth[1 % len(smooth)] else None
    if fillet is not None:
        nodes[0], nodes[1], bulge = fillet
        inner = [[bulge]]
    else:
        inner = [inner_unknowns(move.kind, nodes[0], nodes[1 % len(nodes)], samples, ranges[0])]
    inner += [shape.unknowns[shape.extra(k)].tolist() for k in kept]
    applied = Shape(np.concatenate([*nodes, *map(np.array, inner)]), kinds, lines, smooth, ranges)
    return applied if fillet is None else _with_ranges(applied, samples, FILLET_REACH)


def _line_ends(
    nodes: list[np.ndarray], before: int, after: int, shape: Shape, samples: Samples, span: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Where the best line through a stretch meets the lines on both sides of it, or passes the nodes there."""
    at = np.arange(span[0], span[1] + 1) % samples.count
    middle = np.average(samples.points[at], axis=0, weights=samples.weight[at] + TINY_WEIGHT)
    spread = (samples.points[at] - middle) * np.sqrt(samples.weight[at] + TINY_WEIGHT)[:, None]
    along = np.linalg.svd(spread, full_matrices=False)[2][0]
    ends = []
    for node, beside in zip(nodes, (before, after), strict=True):
        foot = middle + along * ((node - middle) @ along)
        other = shape.node(beside + 1) - shape.node(beside)
        system = np.column_stack([along, -other / max(float(np.linalg.norm(other)), 1e-9)])
        if shape.kinds[beside] == LINE and abs(np.linalg.det(system)) > SHARPEST_FILLET:
            crossing = middle + along * np.linalg.solve(system, shape.node(beside) - middle)[0]
            foot = crossing if np.linalg.norm(crossing - node) < FARTHEST else foot
        ends.append(foot)
    return ends[0], ends[1]


def _fillet(shape: Shape, move: _Move, samples: Samples) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Ends and bulge of the arc that is tangent to the lines on both sides and as far from their corner as the
    boundary.
    """
    n = shape.count
    before, after = (move.first - 1) % n, (move.first + move.count) % n
    if shape.kinds[before] != LINE or shape.kinds[after] != LINE or before == after:
        return None
    a, b = shape.node(before), shape.node(after)
    u, v = shape.node(before + 1) - a, shape.node(after + 1) - b
    lengths = np.linalg.norm(u), np.linalg.norm(v)
    if min(lengths) < SHORTEST_SIDE:
        return None
    u, v = u / lengths[0], v / lengths[1]
    turn = float(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v))
    if not SHARPEST_FILLET < abs(turn) < SPIKE:
        return None
    corner = a + u * np.linalg.solve(np.column_stack([u, -v]), b - a)[0]
    first, last = _span(shape, move.first, move.count, samples.count)
    inside = samples.points[np.arange(first, last + 1) % samples.count]
    depth = np.linalg.norm(inside - corner, axis=1).min()
    radius = depth / (1 / np.cos(turn / 2) - 1)
    reach = radius * np.tan(abs(turn) / 2)
    return corner - reach * u, corner + reach * v, float(np.tan(turn / 4))


def _both_lines(kinds: tuple[int, ...], i: int) -> bool:
    return kinds[i] == LINE and kinds[i - 1] == LINE


def _cut_up(shape: Shape, move: _Move, samples: Samples) -> Shape:
    """Edge `move.first` as lines with sharp nodes between them."""
    k, n = move.first, shape.count
    kept = [(k + 1 + i) % n for i in range(n - 1)]
    order = [k, *(-1 for _ in move.split), *kept]
    cuts = [shape.ranges[k][0], *move.split, shape.ranges[k][1]]
    ranges = [(a % samples.count, a % samples.count + b - a) for a, b in pairwise(cuts)]
    nodes = [shape.node(k), *(samples.points[i % samples.count] for i in move.split), *(shape.node(i) for i in kept)]
    kinds = (*(LINE for _ in ranges), *(shape.kinds[i] for i in kept))
    smooth = tuple(i >= 0 and shape.smooth[i] and not _both_lines(kinds, at) for at, i in enumerate(order))
    lines = (*(-1 for _ in ranges), *(shape.lines[i] for i in kept))
    inner = [shape.unknowns[shape.extra(i)] for i in kept]
    return Shape(np.concatenate([*nodes, *inner]), kinds, lines, smooth, (*ranges, *(shape.ranges[i] for i in kept)))
