"""The inner loops of nesting, compiled: boards that overlap are put elsewhere until none does.

Boards are sets of convex parts. How much two of them overlap is the sum, over pairs of parts, of the least way that
would part them (separating axes). Each board in turn goes where its overlaps weigh least, and pairs that go on
overlapping weigh more and more (guided local search: Egeblad, Nielsen and Odgaard, European Journal of Operational
Research 183(3), 2007; how places are sampled and weights grow: Gardeyn and Wauters, sparrow, 2025).

Arrays come one by one, in few columns: numba counts references to what it takes out of a tuple, at every call.
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
FIRST_STEP, ROUGH_STEP, LEAST_STEP = (
    0.25,
    0.02,
    2e-4,
)  # of a board's narrow side: looking closer begins, ends for all kept, ends for the best
HARDER, SOFTER = 1.8, 0.95  # how the weight of the worst pair grows, and of a pair that is apart shrinks
PATIENCE = 100  # rounds without a better layout after which separation gives up

# Compiled without a way in from Python; with loops for numpy's functions, which each compile a dozen more: the first
# run of an installation waits for all of it.
_inner = numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy")


@_inner
def _depth(edges, first, after, other_first, other_after, dx, dy, least):
    """How far a convex part reaches behind the edges of another, it shifted by dx, dy against them; 0 when not."""
    for k in range(first, after):
        nx, ny = edges[k, 0], edges[k, 1]
        low = np.inf
        for m in range(other_first, other_after):
            along = nx * edges[m, 3] + ny * edges[m, 4]
            if along < low:
                low = along
        depth = edges[k, 2] - low - nx * dx - ny * dy
        if depth <= SNUG:
            return 0.0
        if depth < least:
            least = depth
    return least


@_inner
def _overlap(edges, parts, outlines, a, b, dx, dy, enough):
    """How much outline a and outline b, shifted by dx, dy against it, overlap; no further once it is enough."""
    wide, high = outlines[b, 0], outlines[b, 1]
    total = 0.0
    for p in range(int(outlines[a, 2]), int(outlines[a, 3])):
        left, low, right, top = parts[p, 0] - dx, parts[p, 1] - dy, parts[p, 2] - dx, parts[p, 3] - dy
        if right <= 0 or top <= 0 or left >= wide or low >= high:
            continue
        p_first, p_after = int(parts[p, 4]), int(parts[p, 5])
        for q in range(int(outlines[b, 2]), int(outlines[b, 3])):
            if parts[q, 0] < right and left < parts[q, 2] and parts[q, 1] < top and low < parts[q, 3]:
                found = _depth(edges, p_first, p_after, int(parts[q, 4]), int(parts[q, 5]), dx, dy, np.inf)
                if found > 0:
                    found = _depth(edges, int(parts[q, 4]), int(parts[q, 5]), p_first, p_after, -dx, -dy, found)
                total += found
                if total >= enough:
                    return total
    return total


@_inner
def _cost(edges, parts, outlines, turns, board, turn, sheet, x, y, layout, weights, bound):
    """Weighted overlap of a board there with all others on the sheet; infinite as soon as it passes the bound."""
    total, shape = 0.0, board * turns + turn
    right, top = x + outlines[shape, 0], y + outlines[shape, 1]
    for other in range(len(layout)):
        if layout[other, 2] >= right or layout[other, 4] <= x or layout[other, 3] >= top or layout[other, 5] <= y:
            continue
        if other == board or layout[other, 0] != sheet:
            continue
        weight = weights[board, other]
        enough = (bound - total) / weight
        dx, dy = layout[other, 2] - x, layout[other, 3] - y
        beside = other * turns + int(layout[other, 1])
        total += weight * _overlap(edges, parts, outlines, shape, beside, dx, dy, enough)
        if total >= bound:
            return np.inf
    return total


@_inner
def _descend(edges, parts, outlines, turns, board, place, steps, lengths, width, layout, weights):
    """Bring a place to where it costs least nearby: steps along and across, shorter and shorter."""
    turn, sheet, x, y, cost = int(place[0]), int(place[1]), place[2], place[3], place[4]
    wide, high = outlines[board * turns + turn, 0], outlines[board * turns + turn, 1]
    most_x, most_y = lengths[sheet] - wide, width - high
    step_x, step_y = steps[0] * min(wide, high), steps[0] * min(wide, high)
    least = steps[1] * min(wide, high)
    while max(step_x, step_y) > least and cost > 0:
        way = np.random.randint(4)
        sx = 0.0 if way == 1 else step_x
        sy = 0.0 if way == 0 else (-step_y if way == 3 else step_y)
        better = False
        for sign in (1.0, -1.0):
            u, v = min(max(x + sign * sx, 0.0), most_x), min(max(y + sign * sy, 0.0), most_y)
            if u == x and v == y:
                continue
            found = _cost(edges, parts, outlines, turns, board, turn, sheet, u, v, layout, weights, cost)
            if found < cost:
                x, y, cost, better = u, v, found, True
                break
        factor = 1.1 if better else 0.5
        if way != 1:
            step_x *= factor
        if way != 0:
            step_y *= factor
    place[2], place[3], place[4] = x, y, cost


@_inner
def _dearest(places):
    """Which of the places costs most."""
    worst = 0
    for k in range(1, KEPT):
        if places[k, 4] > places[worst, 4]:
            worst = k
    return worst


@_inner
def _probe(edges, parts, outlines, turns, board, near, lengths, width, layout, weights, places):
    """Try a place, anywhere or near where the board is, and note it instead of a dearer one."""
    turn, sheet = np.random.randint(turns), np.random.randint(len(lengths))
    if near:
        sheet = int(layout[board, 0])
    wide, high = outlines[board * turns + turn, 0], outlines[board * turns + turn, 1]
    most_x, most_y = lengths[sheet] - wide, width - high
    if most_x < 0 or most_y < 0:
        return
    x, y = np.random.random() * most_x, np.random.random() * most_y
    if near:
        x = min(max(layout[board, 2] + (np.random.random() - 0.5) * wide * 0.5, 0.0), most_x)
        y = min(max(layout[board, 3] + (np.random.random() - 0.5) * high * 0.5, 0.0), most_y)
    worst = _dearest(places)
    bound = places[worst, 4]
    found = _cost(edges, parts, outlines, turns, board, turn, sheet, x, y, layout, weights, bound)
    if found < bound:
        places[worst, 0], places[worst, 1] = turn, sheet
        places[worst, 2], places[worst, 3], places[worst, 4] = x, y, found


@_inner
def _move(edges, parts, outlines, turns, board, lengths, width, layout, weights, places):
    """Put a board where it costs least of the places tried; the place it was at counts as well."""
    for k in range(KEPT):
        places[k, 4] = np.inf
    sheet, turn, x, y = int(layout[board, 0]), int(layout[board, 1]), layout[board, 2], layout[board, 3]
    places[0, 0], places[0, 1], places[0, 2], places[0, 3] = turn, sheet, x, y
    places[0, 4] = _cost(edges, parts, outlines, turns, board, turn, sheet, x, y, layout, weights, np.inf)
    for k in range(PROBES + NEAR_PROBES):
        _probe(edges, parts, outlines, turns, board, k >= PROBES, lengths, width, layout, weights, places)
    best = 0
    for k in range(KEPT):
        if places[k, 4] < np.inf:
            steps = (FIRST_STEP, ROUGH_STEP)
            _descend(edges, parts, outlines, turns, board, places[k], steps, lengths, width, layout, weights)
            if places[k, 4] < places[best, 4]:
                best = k
    steps = (ROUGH_STEP, LEAST_STEP)
    _descend(edges, parts, outlines, turns, board, places[best], steps, lengths, width, layout, weights)
    layout[board, 0], layout[board, 1] = places[best, 1], places[best, 0]
    layout[board, 2], layout[board, 3] = places[best, 2], places[best, 3]
    _box(outlines, turns, layout, board)


@_inner
def _box(outlines, turns, layout, board):
    """Note how far to the right and up a board reaches."""
    shape = board * turns + int(layout[board, 1])
    layout[board, 4], layout[board, 5] = layout[board, 2] + outlines[shape, 0], layout[board, 3] + outlines[shape, 1]


@_inner
def _boxes_meet(layout, a, b):
    return (
        layout[a, 2] < layout[b, 4]
        and layout[b, 2] < layout[a, 4]
        and layout[a, 3] < layout[b, 5]
        and layout[b, 3] < layout[a, 5]
    )


@_inner
def _refresh(edges, parts, outlines, turns, board, layout, found):
    a = board * turns + int(layout[board, 1])
    for other in range(len(layout)):
        value = 0.0
        if other != board and layout[other, 0] == layout[board, 0] and _boxes_meet(layout, board, other):
            b = other * turns + int(layout[other, 1])
            dx, dy = layout[other, 2] - layout[board, 2], layout[other, 3] - layout[board, 3]
            value = _overlap(edges, parts, outlines, a, b, dx, dy, np.inf)
        found[board, other] = value
        found[other, board] = value


@numba.njit(cache=True)
def separate(edges, parts, outlines, turns, lengths, width, layout, weights, seed, moves):
    """Move boards until none overlap, or nothing gets better any more, or the moves are used up.

    Parameters
    ----------
    edges, parts, outlines : of every board at every turn, see `nesting._Shapes`
    turns : number of turns
    lengths : (S,) of the sheets
    width : of all sheets
    layout : (N, 6) sheet, turn, left, bottom, right, top of every board; changed
    weights : (N, N) of the pairs; changed
    seed : of the random generator
    moves : at most

    Returns
    -------
    Whether they are apart, and the moves that are left.
    """
    np.random.seed(seed)
    count = len(weights)
    found, order, places = np.empty((count, count)), np.empty(count, np.int64), np.empty((KEPT, 5))
    for board in range(count):
        order[board] = board
        _box(outlines, turns, layout, board)
    for board in range(count):
        _refresh(edges, parts, outlines, turns, board, layout, found)
    total, worst = _total_and_worst(found)
    least, idle = total, 0
    while least > 0 and idle < PATIENCE and moves > 0:
        _shuffle(order)
        for k in range(count):
            if _worst_of(found[order[k]]) > 0:
                _move(edges, parts, outlines, turns, order[k], lengths, width, layout, weights, places)
                _refresh(edges, parts, outlines, turns, order[k], layout, found)
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
