"""A closed chain of edges as one vector of unknowns, with distances to it and their derivatives.

Unknowns are the nodes (2 each), then of every arc its bulge (tangent of a quarter of the sweep) and of every cubic
its two inner control points. An arc is written as the rational quadratic through its nodes, which is smooth in the
bulge up to and beyond the half circle. Smooth nodes and guide lines are equations between unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from kerfwright.refine.curves.feet import LEAST_BULGE, WIDTH, edge_residuals
from kerfwright.refine.curves.ranges import ARC, CUBIC
from kerfwright.refine.curves.snap import GuideLine

__all__ = ["Shape", "end_turn", "equations", "residuals"]

EXTRA = {ARC: 1, CUBIC: 4}
_RIGHT = np.array([[0.0, 1.0], [-1.0, 0.0]])  # turns a vector to its right: where a counter-clockwise arc bows to


@dataclass(frozen=True, eq=False)
class Shape:
    """Edge k runs from node k to the next; `kinds`, `lines` and `smooth` as in `Chain`, `ranges` the samples of each
    edge.
    """

    unknowns: np.ndarray
    kinds: tuple[int, ...]
    lines: tuple[int, ...]
    smooth: tuple[bool, ...]
    ranges: tuple[tuple[int, int], ...]  # first and last sample; the last may exceed N

    @property
    def count(self) -> int:
        """Number of edges, and of nodes."""
        return len(self.kinds)

    @property
    def nodes(self) -> np.ndarray:
        """(n, 2) all nodes."""
        return self.unknowns[: 2 * self.count].reshape(-1, 2)

    def node(self, k: int) -> np.ndarray:
        """(2,) node k, counted round."""
        k %= self.count
        return self.unknowns[2 * k : 2 * k + 2]

    def extra(self, k: int) -> slice:
        """Where the inner unknowns of edge k lie."""
        own = self.columns(k)[4:]
        return slice(own[0], own[-1] + 1) if len(own) else slice(0, 0)

    def columns(self, k: int) -> np.ndarray:
        """Indices of all unknowns of edge k: its nodes, then its own."""
        return _columns(self.kinds)[k]

    @cached_property
    def edges(self) -> np.ndarray:
        """(n, WIDTH) unknowns of every edge, in the order of `columns`, the rest zero."""
        rows = np.zeros((self.count, WIDTH))
        for row, columns in zip(rows, _columns(self.kinds), strict=True):
            row[: len(columns)] = self.unknowns[columns]
        return rows

    def moved(self, unknowns: np.ndarray) -> Shape:
        """The same structure with other unknowns."""
        return replace(self, unknowns=unknowns)

    def controls(self, k: int) -> np.ndarray:
        """(4, 2) control points of a cubic edge."""
        return np.vstack([self.node(k), self.unknowns[self.extra(k)].reshape(2, 2), self.node(k + 1)])

    def arc(self, k: int) -> tuple[np.ndarray, float, float, float]:
        """Centre, radius, start angle and signed sweep of an arc edge."""
        a, b = self.node(k), self.node(k + 1)
        bulge = _bounded(float(self.unknowns[self.extra(k)][0]))
        centre = (a + b) / 2 - (1 - bulge**2) / (4 * bulge) * (_RIGHT @ (b - a))
        spoke = a - centre
        return centre, float(np.hypot(*spoke)), float(np.arctan2(spoke[1], spoke[0])), 4 * float(np.arctan(bulge))


def _bounded(bulge: float) -> float:
    return float(np.copysign(max(abs(bulge), LEAST_BULGE), bulge))


@lru_cache(maxsize=256)
def _columns(kinds: tuple[int, ...]) -> tuple[np.ndarray, ...]:
    """Indices of the unknowns of every edge: its nodes, then its own."""
    found, own = [], 2 * len(kinds)
    for k, kind in enumerate(kinds):
        after, more = (k + 1) % len(kinds), EXTRA.get(kind, 0)
        found.append(np.array([2 * k, 2 * k + 1, 2 * after, 2 * after + 1, *range(own, own + more)]))
        own += more
    return tuple(found)


def residuals(shape: Shape, k: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distances (M,), left positive, of points to edge k and their derivatives (M, C) by the unknowns
    `columns(k)`.
    """
    distance, slope = edge_residuals(shape.kinds[k], shape.edges[k], np.ascontiguousarray(points))
    return distance, slope[:, : len(shape.columns(k))]


def _end_directions(shape: Shape, k: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Tangent vectors at the start and the end of edge k with their derivatives (2, C) by its unknowns."""
    eye, zero = np.eye(2), np.zeros((2, 2))
    a, b = shape.node(k), shape.node(k + 1)
    if shape.kinds[k] == CUBIC:
        c = shape.controls(k)
        return [(c[1] - c[0], np.hstack([-eye, zero, eye, zero])), (c[3] - c[2], np.hstack([zero, eye, zero, -eye]))]
    if shape.kinds[k] != ARC:
        return [(b - a, np.hstack([-eye, eye]))] * 2
    bulge = _bounded(shape.unknowns[shape.extra(k)][0])
    half, rate = 2 * np.arctan(bulge), 2 / (1 + bulge**2)
    found = []
    for sign in (-1.0, 1.0):  # the chord turned back by half the sweep, and on by as much
        c, s = np.cos(half), sign * np.sin(half)
        turn, slope = (
            np.array([[c, -s], [s, c]]),
            sign * rate * np.array([[-np.sin(sign * half), -c], [c, -np.sin(sign * half)]]),
        )
        found.append((turn @ (b - a), np.hstack([-turn, turn, (slope @ (b - a))[:, None]])))
    return found


def end_turn(shape: Shape, k: int) -> float:
    """Signed angle, radians, that the path turns by at node k."""
    u, v = _end_directions(shape, (k - 1) % shape.count)[1][0], _end_directions(shape, k)[0][0]
    return float(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v))


def equations(shape: Shape, guides: list[GuideLine]) -> tuple[np.ndarray, np.ndarray]:
    """Values (E,) and Jacobian (E, U) of what must vanish: the sine of the turn at smooth nodes, offsets from guide
    lines.
    """
    values, rows = [], []
    for k in range(shape.count):
        if shape.smooth[k]:
            value, row = _tangency(shape, k)
            values.append(value)
            rows.append(row)
        if shape.lines[k] >= 0:
            guide = guides[shape.lines[k]]
            for node in (k, (k + 1) % shape.count):
                row = np.zeros(len(shape.unknowns))
                row[2 * node : 2 * node + 2] = guide.normal
                values.append(float(guide.normal @ shape.node(node) - guide.offset))
                rows.append(row)
    return np.array(values), np.array(rows).reshape(len(values), len(shape.unknowns))


def _tangency(shape: Shape, k: int) -> tuple[float, np.ndarray]:
    before = (k - 1) % shape.count
    u, du = _end_directions(shape, before)[1]
    v, dv = _end_directions(shape, k)[0]
    scale = max(float(np.hypot(*u) * np.hypot(*v)), 1e-12)
    row = np.zeros(len(shape.unknowns))
    np.add.at(row, shape.columns(before), (du[0] * v[1] - du[1] * v[0]) / scale)
    np.add.at(row, shape.columns(k), (u[0] * dv[1] - u[1] * dv[0]) / scale)
    return float((u[0] * v[1] - u[1] * v[0]) / scale), row
