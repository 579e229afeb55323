"""Distances from samples to a chain of edges, with derivatives: compiled, since every trial of a fit asks for them.

An edge is a row of eight numbers: its two nodes, then of an arc its bulge, of a cubic its two inner control points.
A foot is `t, gx, gy, nx, ny`: the parameter of the nearest point, the way from there to the sample, and the left
normal. Beyond the ends of an edge the normal is the way itself, so that the distance is the whole one.
"""

from __future__ import annotations

import numba
import numpy as np

from kerfwright.refine.curves.ranges import ARC, CUBIC

__all__ = ["LEAST_BULGE", "WIDTH", "assigned", "edge_feet", "edge_residuals", "normal_sums"]

WIDTH = 8  # unknowns of an edge, at most
LEAST_BULGE = 1e-6
_GRID = np.linspace(0.0, 1.0, 21)
_NEWTON_STEPS = 4
_NO_CHANGE = 1e-6  # mm: less does not move a sample to another edge
_HANDLE_PULL = 0.25


@numba.njit(cache=True)
def _line_foot(e, x, y):
    dx, dy = e[2] - e[0], e[3] - e[1]
    length = max(np.hypot(dx, dy), 1e-9)
    t = ((x - e[0]) * dx + (y - e[1]) * dy) / length**2
    t = min(max(t, 0.0), 1.0)
    return t, x - e[0] - t * dx, y - e[1] - t * dy, -dy / length, dx / length


@numba.njit(cache=True)
def _arc(e):
    """Centre, bulge, sine and cosine of half the sweep."""
    bulge = np.copysign(max(abs(e[4]), LEAST_BULGE), e[4])
    lift = (1 - bulge**2) / (4 * bulge)
    half = 2 * np.arctan(bulge)
    dx, dy = e[2] - e[0], e[3] - e[1]
    return (e[0] + e[2]) / 2 - lift * dy, (e[1] + e[3]) / 2 + lift * dx, bulge, np.sin(half), np.cos(half)


@numba.njit(cache=True)
def _arc_parameter(e, x, y, cx, cy, bulge):
    """Parameter of the rational quadratic at the angle of the sample seen from the centre."""
    sweep = 4 * abs(np.arctan(bulge))
    angle = np.arctan2(y - cy, x - cx) - np.arctan2(e[1] - cy, e[0] - cx)
    angle = np.mod(np.copysign(1.0, bulge) * angle, 2 * np.pi)
    if angle > sweep:
        return 1.0 if angle - sweep < 2 * np.pi - angle else 0.0
    up, down = np.sin(angle / 2), np.sin((sweep - angle) / 2)
    return up / max(up + down, 1e-15)


@numba.njit(cache=True)
def _arc_weights(t, cosine):
    s = 1 - t
    a, m, b = s * s, 2 * s * t, t * t
    total = a + m * cosine + b
    return a / total, m / total, b / total


@numba.njit(cache=True)
def _arc_foot(e, x, y):
    cx, cy, bulge, sine, cosine = _arc(e)
    t = _arc_parameter(e, x, y, cx, cy, bulge)
    a, m, b = _arc_weights(t, cosine)
    mx = cosine * (e[0] + e[2]) / 2 + sine / 2 * (e[3] - e[1])
    my = cosine * (e[1] + e[3]) / 2 - sine / 2 * (e[2] - e[0])
    px, py = a * e[0] + m * mx + b * e[2], a * e[1] + m * my + b * e[3]
    radius = max(np.hypot(px - cx, py - cy), 1e-12)
    side = np.copysign(1.0, bulge)
    return t, x - px, y - py, -side * (px - cx) / radius, -side * (py - cy) / radius


@numba.njit(cache=True)
def _cubic_at(e, t):
    s = 1 - t
    a, b, c, d = s**3, 3 * s * s * t, 3 * s * t * t, t**3
    return a * e[0] + b * e[4] + c * e[6] + d * e[2], a * e[1] + b * e[5] + c * e[7] + d * e[3]


@numba.njit(cache=True)
def _cubic_velocity(e, t):
    s = 1 - t
    a, b, c = 3 * s * s, 6 * s * t, 3 * t * t
    vx = a * (e[4] - e[0]) + b * (e[6] - e[4]) + c * (e[2] - e[6])
    return vx, a * (e[5] - e[1]) + b * (e[7] - e[5]) + c * (e[3] - e[7])


@numba.njit(cache=True)
def _cubic_acceleration(e, t):
    s = 1 - t
    ax = 6 * s * (e[6] - 2 * e[4] + e[0]) + 6 * t * (e[2] - 2 * e[6] + e[4])
    return ax, 6 * s * (e[7] - 2 * e[5] + e[1]) + 6 * t * (e[3] - 2 * e[7] + e[5])


@numba.njit(cache=True)
def _cubic_start(grid, x, y):
    best, nearest = 0, np.inf
    for k in range(len(grid)):
        squared = (grid[k, 0] - x) ** 2 + (grid[k, 1] - y) ** 2
        if squared < nearest:
            best, nearest = k, squared
    return _GRID[best]


@numba.njit(cache=True)
def _cubic_foot(e, grid, x, y):
    t = _cubic_start(grid, x, y)
    for _ in range(_NEWTON_STEPS):
        px, py = _cubic_at(e, t)
        vx, vy = _cubic_velocity(e, t)
        ax, ay = _cubic_acceleration(e, t)
        speed = vx * vx + vy * vy
        slope = speed + max((px - x) * ax + (py - y) * ay, -0.5 * speed)
        t = min(max(t - ((px - x) * vx + (py - y) * vy) / max(slope, 1e-12), 0.0), 1.0)
    px, py = _cubic_at(e, t)
    vx, vy = _cubic_velocity(e, t)
    speed = max(np.hypot(vx, vy), 1e-12)
    return t, x - px, y - py, -vy / speed, vx / speed


@numba.njit(cache=True)
def _grid_of(kind, e):
    """Points along a cubic to start from; none for others."""
    if kind != CUBIC:
        return np.empty((0, 2))
    grid = np.empty((len(_GRID), 2))
    for k in range(len(_GRID)):
        grid[k] = _cubic_at(e, _GRID[k])
    return grid


@numba.njit(cache=True)
def _foot(kind, e, grid, x, y):
    """Parameter, signed distance, left positive, and normal of the foot."""
    if kind == CUBIC:
        t, gx, gy, nx, ny = _cubic_foot(e, grid, x, y)
    elif kind == ARC:
        t, gx, gy, nx, ny = _arc_foot(e, x, y)
    else:
        t, gx, gy, nx, ny = _line_foot(e, x, y)
    signed = gx * nx + gy * ny
    if t <= 0 or t >= 1:
        far = np.hypot(gx, gy)
        if far > 1e-9:
            signed = -far if signed < 0 else far
            nx, ny = gx / signed, gy / signed
    return t, signed, nx, ny


@numba.njit(cache=True)
def _slope(kind, e, t, nx, ny, row):
    """Derivatives of the signed distance by the edge's unknowns, into `row`."""
    row[:] = 0.0
    if kind == CUBIC:
        s = 1 - t
        weights = (s**3, t**3, 3 * s * s * t, 3 * s * t * t)
        for i in range(4):
            row[2 * i], row[2 * i + 1] = -weights[i] * nx, -weights[i] * ny
    elif kind == ARC:
        _arc_slope(e, t, nx, ny, row)
    else:
        row[0], row[1], row[2], row[3] = -(1 - t) * nx, -(1 - t) * ny, -t * nx, -t * ny


@numba.njit(cache=True)
def _arc_slope(e, t, nx, ny, row):
    _, _, bulge, sine, cosine = _arc(e)
    rate = 2 / (1 + bulge**2)
    a, m, b = _arc_weights(t, cosine)
    # n . R and R d, where R turns a vector to its right
    rx, ry = -ny, nx
    dx, dy = e[3] - e[1], e[0] - e[2]
    row[0] = -(a * nx + m * (cosine / 2 * nx - sine / 2 * rx))
    row[1] = -(a * ny + m * (cosine / 2 * ny - sine / 2 * ry))
    row[2] = -(b * nx + m * (cosine / 2 * nx + sine / 2 * rx))
    row[3] = -(b * ny + m * (cosine / 2 * ny + sine / 2 * ry))
    mx, my = (e[0] + e[2]) / 2, (e[1] + e[3]) / 2
    px = a * e[0] + m * (cosine * mx + sine / 2 * dx) + b * e[2]
    py = a * e[1] + m * (cosine * my + sine / 2 * dy) + b * e[3]
    by_x = m * (rate * (-sine * mx + cosine / 2 * dx) + rate * sine * px)
    by_y = m * (rate * (-sine * my + cosine / 2 * dy) + rate * sine * py)
    row[4] = -(nx * by_x + ny * by_y)


@numba.njit(cache=True)
def edge_feet(kind, e, points):
    """Parameters (M,), left normals (M, 2) and signed distances (M,) of the feet of points (M, 2) on one edge."""
    count = len(points)
    t, normal, signed = np.empty(count), np.empty((count, 2)), np.empty(count)
    grid = _grid_of(kind, e)
    for i in range(count):
        t[i], signed[i], normal[i, 0], normal[i, 1] = _foot(kind, e, grid, points[i, 0], points[i, 1])
    return t, normal, signed


@numba.njit(cache=True)
def edge_residuals(kind, e, points):
    """Signed distances (M,) to one edge and their derivatives (M, WIDTH) by its unknowns."""
    signed, slope = np.empty(len(points)), np.empty((len(points), WIDTH))
    grid = _grid_of(kind, e)
    for i in range(len(points)):
        t, signed[i], nx, ny = _foot(kind, e, grid, points[i, 0], points[i, 1])
        _slope(kind, e, t, nx, ny, slope[i])
    return signed, slope


@numba.njit(cache=True)
def _take(kind, e, grid, k, first, last, points, best, edge):
    """Give samples first .. last - 1, counted round, to edge k where it is nearer than what they had."""
    for index in range(first, last):
        i = index % len(points)
        signed = _foot(kind, e, grid, points[i, 0], points[i, 1])[1]
        if abs(signed) < abs(best[i]) - _NO_CHANGE or np.isinf(best[i]):
            best[i], edge[i] = signed, k


@numba.njit(cache=True)
def assigned(kinds, edges, ranges, points, reach):
    """Signed distance (N,) and edge (N,) of each sample: of its range's edge, or of the neighbour's if that is nearer.

    kinds (n,), edges (n, WIDTH), ranges (n, 2) of samples, points (N, 2), `reach` in samples from a node.
    """
    best, edge = np.full(len(points), np.inf), np.zeros(len(points), np.int64)
    count = len(kinds)
    for k in range(count):
        _take(kinds[k], edges[k], _grid_of(kinds[k], edges[k]), k, ranges[k, 0], ranges[k, 1], points, best, edge)
    if count > 1:
        for k in range(count):
            before, after, grid = ranges[k - 1], ranges[(k + 1) % count], _grid_of(kinds[k], edges[k])
            _take(kinds[k], edges[k], grid, k, max(before[0], before[1] - reach), before[1], points, best, edge)
            _take(kinds[k], edges[k], grid, k, after[0], min(after[1], after[0] + reach), points, best, edge)
    return best, edge


@numba.njit(cache=True)
def normal_sums(kinds, edges, edge, points, sigma, weight, robust):
    """Blocks (n, WIDTH, WIDTH) of the normal matrix, right sides (n, WIDTH) and the robust chi-square.

    Geman and McClure's weights with `robust` standard errors; a weak pull holds control points near the thirds of
    their chord, as nothing else does along a flat curve.
    """
    count = len(kinds)
    blocks, right, chi2 = np.zeros((count, WIDTH, WIDTH)), np.zeros((count, WIDTH)), 0.0
    row = np.empty(WIDTH)
    for k in range(count):
        grid = _grid_of(kinds[k], edges[k])
        for i in np.flatnonzero(edge == k):
            t, signed, nx, ny = _foot(kinds[k], edges[k], grid, points[i, 0], points[i, 1])
            _slope(kinds[k], edges[k], t, nx, ny, row)
            ratio = 1 + (signed / (robust * sigma[i])) ** 2
            chi2 += weight[i] * signed**2 / ratio
            for a in range(WIDTH):
                right[k, a] -= weight[i] / ratio**2 * signed * row[a]
                for b in range(WIDTH):
                    blocks[k, a, b] += weight[i] / ratio**2 * row[a] * row[b]
        if kinds[k] == CUBIC:
            _pull_handles(edges[k], blocks[k], right[k])
    return blocks, right, chi2


@numba.njit(cache=True)
def _pull_handles(e, block, right):
    pull = _HANDLE_PULL / max(np.hypot(e[2] - e[0], e[3] - e[1]), 1e-6) ** 2
    for row, third in ((4, 1 / 3), (6, 2 / 3)):
        for d in range(2):
            block[row + d, row + d] += pull
            right[row + d] += pull * (e[d] + third * (e[2 + d] - e[d]) - e[row + d])
