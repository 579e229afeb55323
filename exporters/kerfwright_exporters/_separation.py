"""The inner loops of nesting, compiled: boards that overlap are put elsewhere until none does.

Boards are sets of convex parts. How much two of them overlap is the sum, over pairs of parts, of the least way that
would part them (separating axes). Each board in turn goes where its overlaps weigh least, and pairs that go on
overlapping weigh more and more (guided local search: Egeblad, Nielsen and Odgaard, European Journal of Operational
Research 183(3), 2007; how places are sampled and weights grow: Gardeyn and Wauters, sparrow, 2025).
"""

from __future__ import annotations

import numba
import numpy as np

__all__ = ["separate"]

SNUG = 1e-7  # mm that parts may reach into each other: rounding
PROBES, NEAR_PROBES, KEPT = (
    40,
    20,
    3,
)  # places tried for a board: anywhere, near where it is, and those looked at closer
LEAST_STEP = 2e-3  # mm, at which looking closer ends
HARDER, SOFTER = 1.8, 0.95  # how the weight of the worst pair grows, and of a pair that is apart shrinks
PATIENCE = 100  # rounds without a better layout after which separation gives up

# Compiled without a way in from Python; with loops for numpy's functions, which each compile a dozen more: the first
# run of an installation waits for all of it.
_inner = numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)


@_inner
def _parts_overlap(verts, normals, reach, first, after, p, q, dx, dy):
    """How far two convex parts would have to move apart, q shifted by dx, dy against p; 0 when they are."""
    least = np.inf
    for k in range(first[p], after[p]):
        nx, ny = normals[k, 0], normals[k, 1]
        low = np.inf
        for m in range(first[q], after[q]):
            low = min(low, nx * verts[m, 0] + ny * verts[m, 1])
        depth = reach[k] - low - nx * dx - ny * dy
        if depth <= SNUG:
            return 0.0
        least = min(least, depth)
    for k in range(first[q], after[q]):
        nx, ny = normals[k, 0], normals[k, 1]
        low = np.inf
        for m in range(first[p], after[p]):
            low = min(low, nx * verts[m, 0] + ny * verts[m, 1])
        depth = reach[k] - low + nx * dx + ny * dy
        if depth <= SNUG:
            return 0.0
        least = min(least, depth)
    return least


@_inner
def _overlap(shapes, a, xa, ya, b, xb, yb):
    """How much shape a at xa, ya and shape b at xb, yb overlap."""
    verts, normals, reach, first, after, boxes, parts, sizes = shapes
    dx, dy = xb - xa, yb - ya
    if dx >= sizes[a, 0] or dy >= sizes[a, 1] or -dx >= sizes[b, 0] or -dy >= sizes[b, 1]:
        return 0.0
    total = 0.0
    for p in range(parts[a], parts[a + 1]):
        for q in range(parts[b], parts[b + 1]):
            if (
                boxes[q, 0] + dx < boxes[p, 2]
                and boxes[p, 0] < boxes[q, 2] + dx
                and boxes[q, 1] + dy < boxes[p, 3]
                and boxes[p, 1] < boxes[q, 3] + dy
            ):
                total += _parts_overlap(verts, normals, reach, first, after, p, q, dx, dy)
    return total


@_inner
def _cost(shapes, turns, board, turn, sheet, x, y, layout, weights, bound):
    """Weighted overlap of a board there with all others on the sheet; infinite as soon as it passes the bound."""
    sheets, turned, xs, ys = layout
    total = 0.0
    for other in range(len(sheets)):
        if other != board and sheets[other] == sheet:
            shape = other * turns + turned[other]
            found = _overlap(shapes, board * turns + turn, x, y, shape, xs[other], ys[other])
            if found > 0:
                total += weights[board, other] * found
                if total >= bound:
                    return np.inf
    return total


@_inner
def _descend(shapes, turns, board, turn, sheet, x, y, cost, room, layout, weights):
    """The place near x, y that costs least: steps along and across, shorter and shorter."""
    step_x, step_y = 0.06 * room[0], 0.06 * room[1]
    size = shapes[7][board * turns + turn]
    step_x, step_y = min(step_x, 0.25 * size[0]), min(step_y, 0.25 * size[1])
    while max(step_x, step_y) > LEAST_STEP and cost > 0:
        way = np.random.randint(4)
        sx = 0.0 if way == 1 else step_x
        sy = 0.0 if way == 0 else (-step_y if way == 3 else step_y)
        better = False
        for sign in (1.0, -1.0):
            u, v = min(max(x + sign * sx, 0.0), room[0]), min(max(y + sign * sy, 0.0), room[1])
            if u == x and v == y:
                continue
            found = _cost(shapes, turns, board, turn, sheet, u, v, layout, weights, cost)
            if found < cost:
                x, y, cost, better = u, v, found, True
                break
        factor = 1.1 if better else 0.5
        if way != 1:
            step_x *= factor
        if way != 0:
            step_y *= factor
    return x, y, cost


@_inner
def _room(shapes, turns, board, turn, lengths, width, sheet):
    """How far a board can be shifted on a sheet, along and across."""
    size = shapes[7][board * turns + turn]
    return lengths[sheet] - size[0], width - size[1]


@_inner
def _note(row, turn, sheet, x, y, cost):
    row[0], row[1], row[2], row[3], row[4] = turn, sheet, x, y, cost


@_inner
def _dearest(places):
    """Which of the places costs most."""
    worst = 0
    for k in range(1, KEPT):
        if places[k, 4] > places[worst, 4]:
            worst = k
    return worst


@_inner
def _move(shapes, turns, board, lengths, width, layout, weights):
    """Put a board where it costs least of the places tried; the places it was at count as well."""
    sheets, turned, xs, ys = layout
    best = np.empty((KEPT, 5))
    for k in range(KEPT):
        _note(best[k], 0, 0, 0.0, 0.0, np.inf)
    now = _cost(shapes, turns, board, turned[board], sheets[board], xs[board], ys[board], layout, weights, np.inf)
    _note(best[0], turned[board], sheets[board], xs[board], ys[board], now)
    for k in range(PROBES + NEAR_PROBES):
        turn, sheet = np.random.randint(turns), np.random.randint(len(lengths))
        if k >= PROBES:
            sheet = sheets[board]
        room = _room(shapes, turns, board, turn, lengths, width, sheet)
        if room[0] < 0 or room[1] < 0:
            continue
        x, y = np.random.random() * room[0], np.random.random() * room[1]
        if k >= PROBES:
            size = shapes[7][board * turns + turn]
            x = min(max(xs[board] + (np.random.random() - 0.5) * size[0] * 0.5, 0.0), room[0])
            y = min(max(ys[board] + (np.random.random() - 0.5) * size[1] * 0.5, 0.0), room[1])
        worst = _dearest(best)
        found = _cost(shapes, turns, board, turn, sheet, x, y, layout, weights, best[worst, 4])
        if found < best[worst, 4]:
            _note(best[worst], turn, sheet, x, y, found)
    chosen, least = 0, np.inf
    for k in range(KEPT):
        if best[k, 4] == np.inf:
            continue
        turn, sheet = int(best[k, 0]), int(best[k, 1])
        room = _room(shapes, turns, board, turn, lengths, width, sheet)
        best[k, 2], best[k, 3], best[k, 4] = _descend(
            shapes, turns, board, turn, sheet, best[k, 2], best[k, 3], best[k, 4], room, layout, weights
        )
        if best[k, 4] < least:
            chosen, least = k, best[k, 4]
    turned[board], sheets[board] = int(best[chosen, 0]), int(best[chosen, 1])
    xs[board], ys[board] = best[chosen, 2], best[chosen, 3]


@_inner
def _refresh(shapes, turns, board, layout, found):
    sheets, turned, xs, ys = layout
    a = board * turns + turned[board]
    for other in range(len(sheets)):
        value = 0.0
        if other != board and sheets[other] == sheets[board]:
            b = other * turns + turned[other]
            value = _overlap(shapes, a, xs[board], ys[board], b, xs[other], ys[other])
        found[board, other] = value
        found[other, board] = value


@numba.njit(cache=True)
def separate(shapes, turns, lengths, width, layout, weights, seed, moves):
    """Move boards until none overlap, or nothing gets better any more, or the moves are used up.

    Parameters
    ----------
    shapes : parts of every board at every turn, see `nesting._Shapes`
    turns : number of turns
    lengths : (S,) of the sheets
    width : of all sheets
    layout : sheet, turn, x, y of every board, each (N,); changed
    weights : (N, N) of the pairs; changed
    seed : of the random generator
    moves : at most

    Returns
    -------
    Whether they are apart, and the moves that are left.
    """
    np.random.seed(seed)
    count = len(weights)
    found, order = np.empty((count, count)), np.empty(count, np.int64)
    for board in range(count):
        order[board] = board
        _refresh(shapes, turns, board, layout, found)
    total, worst = _total_and_worst(found)
    least, idle = total, 0
    while least > 0 and idle < PATIENCE and moves > 0:
        _shuffle(order)
        for k in range(count):
            if _worst_of(found[order[k]]) > 0:
                _move(shapes, turns, order[k], lengths, width, layout, weights)
                _refresh(shapes, turns, order[k], layout, found)
                moves -= 1
        total, worst = _total_and_worst(found)
        _reweigh(weights, found, worst)
        idle = 0 if total < 0.98 * least else idle + 1
        least = min(least, total)
    return worst == 0, moves


@_inner
def _shuffle(order):
    for k in range(len(order) - 1, 0, -1):
        other = np.random.randint(k + 1)
        order[k], order[other] = order[other], order[k]


@_inner
def _worst_of(row):
    worst = 0.0
    for k in range(len(row)):
        worst = max(worst, row[k])
    return worst


@_inner
def _total_and_worst(found):
    total, worst = 0.0, 0.0
    for a in range(len(found)):
        for b in range(len(found)):
            total += found[a, b]
        worst = max(worst, _worst_of(found[a]))
    return total, worst


@_inner
def _reweigh(weights, found, worst):
    """Pairs that overlap weigh more, the worst the most, and pairs that are apart less."""
    for a in range(len(found)):
        for b in range(len(found)):
            if found[a, b] > 0:
                weights[a, b] *= 1.2 + (HARDER - 1.2) * found[a, b] / worst
            else:
                weights[a, b] = max(1.0, weights[a, b] * SOFTER)
