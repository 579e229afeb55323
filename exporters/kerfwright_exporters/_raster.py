"""The inner loops of nesting, compiled: boards as runs of cells, placed at the first free place from the left."""

from __future__ import annotations

import numba
import numpy as np

__all__ = ["place_all"]

_inner = numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # see _separation


@numba.njit(cache=True)
def place_all(order, runs, starts, turns, free):
    """Lay the boards on sheets in the given order, each on the first sheet that has room, as far left as it goes.

    Parameters
    ----------
    order : (N,) board numbers
    runs : (R, 3) column, first cell and cell after the last of every run of every shape
    starts : (N * turns + 1,) where the runs of a shape begin; shape = board * turns + turn
    turns : number of turns
    free : (S, columns, cells) int16 workspace: the next occupied cell at or after each cell

    Returns
    -------
    Sheet, turn, column, cell and column after the last of every board, each (N,); sheet -1 where no sheet has room.
    """
    places = np.empty((5, len(order)), np.int64)
    sheet, turn, x, y, end = places[0], places[1], places[2], places[3], places[4]
    used = 0
    for board in order:
        sheet[board] = -1
        for s in range(free.shape[0]):
            if s == used:
                _clear(free[s])
                used += 1
            best = free.shape[1] + 1
            for t in range(turns):
                shape = runs[starts[board * turns + t] : starts[board * turns + t + 1]]
                found_x, found_y, found_end = _first_place(free[s], shape, best)
                if found_x >= 0 and (found_end < best or (found_end == best and found_y < y[board])):
                    best = found_end
                    sheet[board], turn[board], x[board], y[board], end[board] = s, t, found_x, found_y, found_end
            if sheet[board] >= 0:
                t = turn[board]
                shape = runs[starts[board * turns + t] : starts[board * turns + t + 1]]
                _occupy(free[s], shape, x[board], y[board])
                break
    return sheet, turn, x, y, end


@_inner
def _clear(free):
    columns, cells = free.shape
    for x in range(columns):
        for y in range(cells):
            free[x, y] = cells


@_inner
def _first_place(free, shape, limit):
    """Leftmost column, then lowest cell, where the shape fits and ends no further right than the limit."""
    columns, cells = free.shape
    wide, high = 0, 0
    for k in range(len(shape)):
        wide, high = max(wide, shape[k, 0] + 1), max(high, shape[k, 2])
    for x in range(min(columns, limit) - wide + 1):
        y = 0
        while y + high <= cells:
            blocked = -1
            for k in range(len(shape)):
                column, first, last = shape[k]
                occupied = free[x + column, y + first]
                if occupied < y + last:
                    blocked = occupied + 1 - first
                    break
            if blocked < 0:
                return x, y, x + wide
            y = max(y + 1, blocked)
    return -1, -1, limit + 1


@_inner
def _occupy(free, shape, x, y):
    """Mark the shape's cells as occupied."""
    for k in range(len(shape)):
        column, first, last = shape[k]
        cell = y + last - 1
        while cell >= 0:
            if cell >= y + first:
                free[x + column, cell] = cell
            elif free[x + column, cell] > y + first:
                free[x + column, cell] = y + first
            else:
                break
            cell -= 1
