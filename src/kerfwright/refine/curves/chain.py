"""The cheapest closed chain of edges over candidate nodes, by dynamic programming.

As in the paper the cost of an edge depends on the one before it: here through the *join* of two free fits, which is
sharp (they must cross near the node) or smooth (their ends must agree within the fits' own uncertainty; this saves a
degree of freedom). The state is therefore an edge, not a node. A closed chain has no first node: the recurrence runs
three times round, and the lap in the middle, which feels nothing of the start, is the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.prices import edge_prices, line_prices
from kerfwright.refine.curves.ranges import LINE, RangeFits, fit_ranges
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.snap import GuideLine, Run

__all__ = ["GUIDE", "GUIDED", "SPIKE", "Chain", "best_chain", "unit_price"]

GUIDED = 1.0  # price of a line that is given: only of its being there
GUIDE = 3  # a line on a guide line: no freedom of its own
SPIKE = 2.8  # radians: a node that turns more is a spike, not a cut
_TRUNCATION = 16.0  # chi-square of a stretch that a guide line overrides, per observation
_ANGLE_SLACK, _OFFSET_SLACK, _SLIDE = 0.02, 0.1, 5.0  # radians, mm, mm: what the linearised join may be wrong by


@dataclass(frozen=True)
class Chain:
    """A closed chain: edge k starts at sample `nodes[k]`; `smooth[k]` tells of that node; `lines[k]` is a guide line
    or -1.
    """

    nodes: tuple[int, ...]
    kinds: tuple[int, ...]
    lines: tuple[int, ...]
    smooth: tuple[bool, ...]
    cost: float


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges that may take part; arrays over edges."""

    start: np.ndarray  # candidate where it starts
    stop: np.ndarray
    kind: np.ndarray
    line: np.ndarray
    cost: np.ndarray
    ends: np.ndarray  # (E, 2, 2)
    tangents: np.ndarray  # (E, 2, 2)
    curvature: np.ndarray  # (E, 2)
    offset_variance: np.ndarray
    angle_variance: np.ndarray


def unit_price(samples: Samples, options: CurveOptions) -> float:
    """Chi-square that one degree of freedom must save: a multiple of ln(effective observations)."""
    return options.complexity * float(np.log(max(samples.observations, 8.0)))


def best_chain(
    samples: Samples, nodes: np.ndarray, runs: Sequence[Run], lines: Sequence[GuideLine], options: CurveOptions
) -> Chain | None:
    """The cheapest closed chain of at least two edges, or None if the candidates allow none."""
    price = unit_price(samples, options)
    edges = _edges(samples, nodes, runs, lines, price, options)
    if not len(edges.start):
        return None
    joins = [_Join(edges, samples, nodes[p], p, price, options) for p in range(len(nodes))]
    path = _middle_lap(_laps(edges, joins, len(nodes)), edges, joins, len(nodes))
    if path is None:
        return None
    order = np.array(path)
    smooth = [joins[edges.start[e]].is_smooth(path[k - 1], e) for k, e in enumerate(path)]
    cost = _closed_cost(path, edges, joins)
    return Chain(
        tuple(int(i) for i in nodes[edges.start[order]]),
        tuple(int(k) for k in edges.kind[order]),
        tuple(int(k) for k in edges.line[order]),
        tuple(smooth),
        cost,
    )


def _edges(
    samples: Samples,
    nodes: np.ndarray,
    runs: Sequence[Run],
    lines: Sequence[GuideLine],
    price: float,
    options: CurveOptions,
) -> _Edges:
    count = len(nodes)
    gap = (nodes[None, :] - nodes[:, None]) % samples.count
    long_enough = gap * samples.spacing >= 0.8 * options.shortest_edge
    covered = _core_owners(samples, nodes, runs, gap)
    fits = fit_ranges(samples, nodes, long_enough & (covered == -1), 2 * price)
    cost = fits.chi2 + price * edge_prices()
    straight = line_prices(
        fits.tangents[:, :, LINE, 0], np.sqrt(fits.angle_variance[:, :, LINE]), samples.main_direction
    )
    cost[:, :, LINE] = fits.chi2[:, :, LINE] + price * straight
    guided = np.full((count, count), np.inf)
    which = long_enough & (covered >= 0)
    for k, line in enumerate(lines):
        guided = np.where(which & (covered == k), _guided_chi2(samples, nodes, line) + price * GUIDED, guided)
    every = np.concatenate([cost, guided[..., None]], axis=2)
    keep = every < (_cheapest_cover(every.min(axis=2)) + 7 * price)[..., None]
    return _collected(samples, nodes, fits, every, keep, covered, lines)


def _core_owners(samples: Samples, nodes: np.ndarray, runs: Sequence[Run], gap: np.ndarray) -> np.ndarray:
    """(K, K): the guide line whose runs' cores the range holds, -1 for none, -2 where it cuts one or mixes lines."""
    owner = np.full(gap.shape, -1)
    for run in runs:
        trim = min(samples.steps(4.0), (run.last - run.first) // 4)
        first, length = run.first + trim, run.last - run.first - 2 * trim
        into = (first - nodes) % samples.count  # from the range's start to the core
        holds = into[:, None] + length <= gap
        touches = (into[:, None] < gap) | (into[:, None] + length > samples.count)
        same = holds & ((owner == -1) | (owner == run.line))
        owner = np.where(same, run.line, np.where(touches, -2, owner))
    return owner


def _guided_chi2(samples: Samples, nodes: np.ndarray, line: GuideLine) -> np.ndarray:
    """(K, K) chi-square of following the line, truncated: the line is known better than the boundary."""
    off = samples.points @ line.normal - line.offset
    independent = samples.spacing / (2 * samples.correlation)
    each = independent * np.minimum(off**2 / (samples.sigma**2 + line.standard_error**2), _TRUNCATION)
    sums = np.concatenate([[0.0], np.cumsum(np.concatenate([each, each]))])
    stop = nodes[None, :] + np.where(nodes[None, :] <= nodes[:, None], samples.count, 0)
    return sums[stop] - sums[nodes][:, None]


def _cheapest_cover(cost: np.ndarray) -> np.ndarray:
    """(K, K) cheapest way from node to node by any number of edges, joins for nothing: a bound for pruning."""
    count = len(cost)
    i = np.arange(count)
    ahead = np.stack([cost[i, (i + d) % count] for d in range(count)], axis=1)  # (from, steps)
    best = ahead.copy()
    for d in range(2, count):
        e = np.arange(1, d)
        via = best[:, 1:d] + ahead[(i[:, None] + e) % count, d - e]
        best[:, d] = np.minimum(best[:, d], via.min(axis=1))
    cover = np.empty_like(cost)
    for d in range(count):
        cover[i, (i + d) % count] = best[:, d]
    return cover


def _collected(
    samples: Samples,
    nodes: np.ndarray,
    fits: RangeFits,
    cost: np.ndarray,
    keep: np.ndarray,
    covered: np.ndarray,
    lines: Sequence[GuideLine],
) -> _Edges:
    start, stop, kind = np.nonzero(keep & np.isfinite(cost))
    free = np.minimum(kind, 2)
    line = np.where(kind == GUIDE, covered[start, stop], -1)
    ends, tangents = fits.ends[start, stop, free].copy(), fits.tangents[start, stop, free].copy()
    curvature = fits.curvature[start, stop, free].copy()
    offset, angle = fits.offset_variance[start, stop, free].copy(), fits.angle_variance[start, stop, free].copy()
    corner = samples.points[nodes[np.column_stack([start, stop])]]
    for e in np.flatnonzero(kind == GUIDE):
        guide = lines[line[e]]
        ends[e] = corner[e] - np.outer(corner[e] @ guide.normal - guide.offset, guide.normal)
        tangents[e], curvature[e], offset[e], angle[e] = guide.direction, 0.0, guide.standard_error**2, 1e-8
    return _Edges(start, stop, kind, line, cost[start, stop, kind], ends, tangents, curvature, offset, angle)


class _Join:
    """Cost of every way through one candidate node."""

    def __init__(
        self, edges: _Edges, samples: Samples, sample: int, node: int, price: float, options: CurveOptions
    ) -> None:
        self.incoming = np.flatnonzero(edges.stop == node)
        self.outgoing = np.flatnonzero(edges.start == node)
        a, b = self.incoming[:, None], self.outgoing[None, :]
        turn = _angle(edges.tangents[a, 1], edges.tangents[b, 0])
        straight = (edges.curvature[a, 1] == 0) & (edges.curvature[b, 0] == 0)
        sharp = _sharp_cost(edges, a, b, samples, sample, price, options)
        sharp = np.where((np.abs(turn) < options.sharp_angle) | (np.abs(turn) > SPIKE), np.inf, sharp)
        smooth = np.where(straight, np.inf, _smooth_cost(edges, a, b, turn) - price)
        self._sharp, self._smooth = sharp, smooth
        self.matrix = np.minimum(sharp, smooth)

    def _at(self, a: int, b: int) -> tuple[int, int]:
        return int(np.searchsorted(self.incoming, a)), int(np.searchsorted(self.outgoing, b))

    def cost(self, a: int, b: int) -> float:
        return float(self.matrix[self._at(a, b)])

    def is_smooth(self, a: int, b: int) -> bool:
        return bool(self._smooth[self._at(a, b)] < self._sharp[self._at(a, b)])


def _angle(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.arctan2(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0], (u * v).sum(axis=-1))


def _sharp_cost(
    edges: _Edges, a: np.ndarray, b: np.ndarray, samples: Samples, sample: int, price: float, options: CurveOptions
) -> np.ndarray:
    """Extra chi-square of running both fits on to where they cross, at distance d: the integral of u^2 up to d,
    twice.
    """
    p, u, q, v = edges.ends[a, 1], edges.tangents[a, 1], edges.ends[b, 0], edges.tangents[b, 0]
    cross = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    gap = q - p
    run = (gap[..., 0] * v[..., 1] - gap[..., 1] * v[..., 0]) / np.where(np.abs(cross) < 1e-6, 1e-6, cross)
    d = np.linalg.norm(p + run[..., None] * u - samples.points[sample], axis=-1)
    chi2 = 2 / 3 * d**3 * samples.weight[sample] / samples.spacing
    lines = np.isin(edges.kind[a], (LINE, GUIDE)) & np.isin(edges.kind[b], (LINE, GUIDE))
    guided = (edges.kind[a] == GUIDE) & (edges.kind[b] == GUIDE)
    chi2 = np.where(
        lines, np.minimum(chi2, np.where(guided, 0.5, 2.0) * price), chi2
    )  # traced corners are rounded, or hidden by a shadow
    return np.where(d > options.corner_reach, np.inf, chi2)


def _smooth_cost(edges: _Edges, a: np.ndarray, b: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Disagreement of the two fits' offsets and angles at the node, which may slide along the boundary to lessen it."""
    angle_variance = edges.angle_variance[a] + edges.angle_variance[b] + _ANGLE_SLACK**2
    offset_variance = edges.offset_variance[a] + edges.offset_variance[b] + _OFFSET_SLACK**2
    bend = edges.curvature[b, 0] - edges.curvature[a, 1]
    slide = -turn * bend / angle_variance / (bend**2 / angle_variance + 1 / _SLIDE**2)
    slide = np.clip(slide, -2 * _SLIDE, 2 * _SLIDE)
    u, gap = edges.tangents[a, 1], edges.ends[b, 0] - edges.ends[a, 1]
    offset = u[..., 0] * gap[..., 1] - u[..., 1] * gap[..., 0] + turn * slide + bend * slide**2 / 2
    return (turn + bend * slide) ** 2 / angle_variance + offset**2 / offset_variance + (slide / _SLIDE) ** 2


def _laps(edges: _Edges, joins: list[_Join], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Cheapest cost of ending with each edge in each of three laps, (3, E), and the edge before it as lap * E +
    edge.
    """
    total = len(edges.start)
    wraps = edges.stop <= edges.start
    value = np.full((3, total), np.inf)
    before = np.full((3, total), -1)
    for position in range(3 * count):
        lap, join = divmod(position, count)[0], joins[position % count]
        out = join.outgoing
        if lap == 0:
            value[0, out] = edges.cost[out]
        came = lap - wraps[join.incoming]
        usable = came >= 0
        if not (len(out) and usable.any()):
            continue
        reach = value[came[usable], join.incoming[usable]][:, None] + join.matrix[usable]
        best = reach.argmin(axis=0)
        cost = reach[best, np.arange(len(out))] + edges.cost[out]
        better = cost < value[lap, out] if lap == 0 else np.isfinite(cost)
        value[lap, out[better]] = cost[better]
        chosen = came[usable][best] * total + join.incoming[usable][best]
        before[lap, out[better]] = chosen[better]
    return value, before


def _middle_lap(laps: tuple[np.ndarray, np.ndarray], edges: _Edges, joins: list[_Join], count: int) -> list[int] | None:
    """Edges of a chain that closes on itself, taken out of the path of three laps."""
    value, before = laps
    total = value.shape[1]
    wraps = edges.stop <= edges.start
    ends = np.flatnonzero(wraps & np.isfinite(value[2]))
    # every path of three laps runs over the last boundary between laps with exactly one wrapping edge
    for last in ends[np.argsort(value[2, ends], kind="stable")][:20]:
        path, state = [], 2 * total + int(last)
        while state >= 0:
            path.append(state)
            state = int(before[divmod(state, total)])
        path.reverse()
        chain = _closing(path, edges, joins, total, count)
        if chain:
            return chain
    return None


def _closing(path: list[int], edges: _Edges, joins: list[_Join], total: int, count: int) -> list[int] | None:
    """The cheapest stretch of one lap that starts and ends at one node."""
    position = [lap * count + int(edges.start[e]) for lap, e in (divmod(s, total) for s in path)]
    where = {p: k for k, p in enumerate(position)}
    chains = [[s % total for s in path[where[p - count] : k]] for k, p in enumerate(position) if p - count in where]
    priced = [(_closed_cost(chain, edges, joins), i) for i, chain in enumerate(chains) if len(chain) >= 2]
    best = min(priced, default=(np.inf, -1))
    return chains[best[1]] if np.isfinite(best[0]) else None


def _closed_cost(chain: list[int], edges: _Edges, joins: list[_Join]) -> float:
    return sum(float(edges.cost[e]) + joins[edges.start[e]].cost(chain[k - 1], e) for k, e in enumerate(chain))
