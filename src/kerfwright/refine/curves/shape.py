"""A closed chain of edges as one vector of unknowns, with distances to it and their derivatives.

Unknowns are the nodes (2 each), then of every arc its bulge (tangent of a quarter of the sweep) and of every cubic
its two inner control points. An arc is written as the rational quadratic through its nodes, which is smooth in the
bulge up to and beyond the half circle. Smooth nodes and guide lines are equations between unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kerfwright.refine.curves.ranges import ARC, CUBIC, LINE
from kerfwright.refine.curves.snap import GuideLine

__all__ = ["Shape", "end_turn", "equations", "feet", "residuals"]

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
        before = 2 * self.count + sum(EXTRA.get(kind, 0) for kind in self.kinds[:k])
        return slice(before, before + EXTRA.get(self.kinds[k], 0))

    def columns(self, k: int) -> np.ndarray:
        """Indices of all unknowns of edge k: its nodes, then its own."""
        nxt, own = (k + 1) % self.count, self.extra(k)
        return np.array([2 * k, 2 * k + 1, 2 * nxt, 2 * nxt + 1, *range(own.start, own.stop)])

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
    return float(np.copysign(max(abs(bulge), 1e-6), bulge))


def feet(shape: Shape, k: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Parameters (M,) of the nearest points on edge k, left normals (M, 2) there, and signed distances (M,), left
    positive.

    Beyond the edge's ends the normal is the way to the point, so that the distance is the whole one.
    """
    if shape.kinds[k] == LINE:
        return _line_feet(shape.node(k), shape.node(k + 1), points)
    t = _arc_feet(shape, k, points) if shape.kinds[k] == ARC else _cubic_feet(shape.controls(k), points)
    velocity = _velocity(shape, k, t)
    velocity /= np.maximum(np.hypot(velocity[:, 0], velocity[:, 1]), 1e-12)[:, None]
    normal = np.column_stack([-velocity[:, 1], velocity[:, 0]])
    return t, *_outward(points - _position(shape, k, t), normal, t)


def _line_feet(a: np.ndarray, b: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    d = b - a
    length = max(float(np.hypot(*d)), 1e-9)
    t = np.clip((points - a) @ d / length**2, 0, 1)
    normal = np.repeat(np.array([[-d[1], d[0]]]) / length, len(points), axis=0)
    return t, *_outward(points - a - t[:, None] * d, normal, t)


def _outward(gap: np.ndarray, normal: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normals, turned towards the points beyond the ends, and distances along them."""
    distance = (gap * normal).sum(axis=1)
    end = np.flatnonzero((t <= 0) | (t >= 1))
    far = np.hypot(gap[end, 0], gap[end, 1])
    end, far = end[far > 1e-9], far[far > 1e-9]
    signed = np.where(distance[end] < 0, -far, far)
    normal[end], distance[end] = gap[end] / signed[:, None], signed
    return normal, distance


def residuals(shape: Shape, k: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distances (M,) of points to edge k and their derivatives (M, C) by the unknowns `columns(k)`."""
    t, normal, distance = feet(shape, k, points)
    if shape.kinds[k] == LINE:
        return distance, -np.hstack([normal * (1 - t)[:, None], normal * t[:, None]])
    if shape.kinds[k] == CUBIC:
        basis = _bernstein(t)[:, [0, 3, 1, 2]]
        return distance, -(basis[:, :, None] * normal[:, None, :]).reshape(len(t), 8)
    return distance, -np.einsum("md,mdc->mc", normal, _arc_derivative(shape, k, t))


def _bernstein(t: np.ndarray) -> np.ndarray:
    s = 1 - t
    return np.column_stack([s**3, 3 * s * s * t, 3 * s * t * t, t**3])


def _position(shape: Shape, k: int, t: np.ndarray) -> np.ndarray:
    if shape.kinds[k] == CUBIC:
        return _bernstein(t) @ shape.controls(k)
    a, b = shape.node(k), shape.node(k + 1)
    weights, middle = _arc_weights(shape, k, t)
    top = weights[:, :1] * a + weights[:, 1:2] * middle + weights[:, 2:3] * b
    return top / weights[:, 3:]


def _arc_weights(shape: Shape, k: int, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Basis (M, 4) of the rational quadratic, its last column the denominator, and the weighted middle control
    point.
    """
    a, b = shape.node(k), shape.node(k + 1)
    half = 2 * np.arctan(_bounded(shape.unknowns[shape.extra(k)][0]))
    middle = np.cos(half) * (a + b) / 2 + np.sin(half) / 2 * (_RIGHT @ (b - a))
    s = 1 - t
    return np.column_stack([s * s, 2 * s * t, t * t, s * s + 2 * s * t * np.cos(half) + t * t]), middle


def _arc_feet(shape: Shape, k: int, points: np.ndarray) -> np.ndarray:
    centre, _, start, sweep = shape.arc(k)
    angle = np.arctan2(points[:, 1] - centre[1], points[:, 0] - centre[0]) - start
    angle = np.mod(angle * np.sign(sweep), 2 * np.pi)
    beyond = angle > abs(sweep)
    late = angle - abs(sweep) < 2 * np.pi - angle
    part = np.where(beyond, np.where(late, 1.0, 0.0), angle / abs(sweep))
    half = abs(sweep) / 2
    up, down = np.sin(part * half), np.sin((1 - part) * half)
    return np.where(part <= 0, 0.0, np.where(part >= 1, 1.0, up / np.maximum(up + down, 1e-15)))


def _cubic_feet(control: np.ndarray, points: np.ndarray) -> np.ndarray:
    grid = np.linspace(0, 1, 21)
    at = _bernstein(grid) @ control
    t = grid[((points[:, None] - at[None]) ** 2).sum(axis=2).argmin(axis=1)]
    d1, d2 = 3 * np.diff(control, axis=0), 6 * np.diff(control, 2, axis=0)
    for _ in range(4):
        s = 1 - t
        gap = _bernstein(t) @ control - points
        v = np.column_stack([s * s, 2 * s * t, t * t]) @ d1
        a = np.column_stack([s, t]) @ d2
        slope = (v * v).sum(axis=1) + np.maximum((gap * a).sum(axis=1), -0.5 * (v * v).sum(axis=1))
        t = np.clip(t - (gap * v).sum(axis=1) / np.maximum(slope, 1e-12), 0, 1)
    return t


def _velocity(shape: Shape, k: int, t: np.ndarray) -> np.ndarray:
    """Direction of travel (M, 2), of any length."""
    if shape.kinds[k] == CUBIC:
        d = np.diff(shape.controls(k), axis=0)
        s = 1 - t
        return np.column_stack([s * s, 2 * s * t, t * t]) @ d
    centre, _, _, sweep = shape.arc(k)
    spoke = _position(shape, k, t) - centre
    return np.sign(sweep) * np.column_stack([-spoke[:, 1], spoke[:, 0]])


def _arc_derivative(shape: Shape, k: int, t: np.ndarray) -> np.ndarray:
    """(M, 2, 5) derivatives of the points at parameters t by the nodes and the bulge of arc k."""
    eye = np.eye(2)
    weights, _ = _arc_weights(shape, k, t)
    bulge = _bounded(shape.unknowns[shape.extra(k)][0])
    half, rate = 2 * np.arctan(bulge), 2 / (1 + bulge**2)
    c, s = np.cos(half), np.sin(half)
    a, b = shape.node(k), shape.node(k + 1)
    w = weights / weights[:, 3:]
    by_start = w[:, 0, None, None] * eye + w[:, 1, None, None] * (c / 2 * eye - s / 2 * _RIGHT)
    by_end = w[:, 2, None, None] * eye + w[:, 1, None, None] * (c / 2 * eye + s / 2 * _RIGHT)
    middle = rate * (-s * (a + b) / 2 + c / 2 * (_RIGHT @ (b - a)))
    by_bulge = w[:, 1:2] * (middle + rate * s * _position(shape, k, t))
    return np.concatenate([by_start, by_end, by_bulge[..., None]], axis=2)


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
