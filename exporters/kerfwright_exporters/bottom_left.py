"""A first layout: bottom-left placement on a raster, over many orders of the boards.

The sheet is a raster of cells, column by column; a board is, for each column it covers, the runs of cells it needs.
Where a run meets an occupied cell, the board jumps past it. Dozens of orders are tried on a coarse raster (simulated
annealing over the order, Kirkpatrick et al., Science 220, 1983), and the best of them laid again on a finer one. Cells
are counted as covered when the board, grown by half the spacing, touches them: what fits on the raster fits on the
sheet. Holes of boards are free cells, and small boards go into them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kerfwright_exporters._raster import place_all
from kerfwright_exporters.places import NestOptions, Place

if TYPE_CHECKING:
    from shapely.geometry import Polygon

__all__ = ["first_places"]

EDGE = 1e-6  # of a cell; less than that in a cell is rounding
TRIALS_A_BOARD = 12  # few boards have few orders worth trying
WARMTH = 0.02  # of the cost: how much worse a layout the search takes at its start


def first_places(outlines: list[Polygon], options: NestOptions) -> list[Place]:
    """A place for every outline, mm, none overlapping.

    Raises
    ------
    ValueError
        If an outline is too large for a sheet at any allowed turn; its index is the argument.
    """
    fine = _Raster(outlines, options, options.fine)
    finalists = [order for _, order in _search(_Raster(outlines, options, options.coarse), outlines, options)]
    return fine.places(min(finalists, key=fine.cost))


def _search(raster: _Raster, outlines: list[Polygon], options: NestOptions) -> list[tuple[float, np.ndarray]]:
    """Cost and order of the best layouts found on the coarse raster, best first."""
    rng = np.random.default_rng(options.seed)
    seen = [(raster.cost(order), order) for order in _starts(outlines)]
    current, order = min(seen, key=lambda entry: entry[0])
    trials = min(options.layouts, TRIALS_A_BOARD * len(outlines)) if len(outlines) > 1 else 0
    for trial in range(trials):
        warmth = WARMTH * current * (1 - trial / trials)
        candidate = _neighbour(order, rng)
        found = raster.cost(candidate)
        if found <= current or rng.random() < np.exp((current - found) / warmth):
            current, order = found, candidate
            seen.append((found, candidate))
    return sorted(seen, key=lambda entry: entry[0])[: options.finalists]


def _starts(outlines: list[Polygon]) -> list[np.ndarray]:
    """Orders that often do well: by area, by the longer side, by the shorter side, largest first."""
    spans = np.array([np.ptp(np.array(o.exterior.coords), axis=0) for o in outlines])
    keys = (np.array([o.area for o in outlines]), spans.max(axis=1), spans.min(axis=1))
    return [np.argsort(-key, kind="stable") for key in keys]


def _neighbour(order: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The order with two boards swapped, or one taken to another place."""
    a, b = rng.choice(len(order), 2, replace=False)
    changed = order.copy()
    if rng.random() < 0.5:
        changed[[a, b]] = changed[[b, a]]
        return changed
    return np.insert(np.delete(changed, a), b, order[a])


class _Raster:
    """The outlines in cells, at every turn; the sheet is grown like them by half the spacing on every side."""

    def __init__(self, outlines: list[Polygon], options: NestOptions, cells: int) -> None:
        self.options = options
        grown = np.array([options.length, options.width]) + options.spacing
        columns = max(1, round(grown[0] / (grown[1] / cells)))
        self.cell = grown / (columns, cells)  # all but square: whole cells in both directions, so that exact fits fit
        shapes = [[self._shape(outline, turn) for turn in options.turns] for outline in outlines]
        self.corners = [[corner for _, corner in row] for row in shapes]
        runs = [r for row in shapes for r, _ in row]
        self.starts = np.cumsum([0, *(len(r) for r in runs)]).astype(np.int64)
        self.runs = np.concatenate(runs).astype(np.int64)
        self.free = np.empty((len(outlines), columns, cells), np.int16)
        self._require_room(len(outlines), runs)

    def _require_room(self, count: int, runs: list[np.ndarray]) -> None:
        _, columns, cells = self.free.shape
        fits = [r[:, 0].max() < columns and r[:, 2].max() <= cells for r in runs]
        turns = len(self.options.turns)
        for k in range(count):
            if not any(fits[k * turns : (k + 1) * turns]):
                raise ValueError(k)

    def _shape(self, outline: Polygon, turn: int) -> tuple[np.ndarray, np.ndarray]:
        """Runs (N, 3) of the grown outline, the longest first, and where its cell 0, 0 lies, mm."""
        from shapely import affinity

        turned = affinity.rotate(outline, turn, origin=(0, 0))
        grown = turned.buffer(self.options.spacing / 2, join_style="mitre", mitre_limit=2.0)
        runs = _runs(grown, self.cell)
        return runs[np.argsort(runs[:, 1] - runs[:, 2], kind="stable")], np.array(grown.bounds[:2])

    def cost(self, order: np.ndarray) -> float:
        """Sheets before the last one, and the share of the last one's length that is used."""
        sheet, _, _, _, end = place_all(order, self.runs, self.starts, len(self.options.turns), self.free)
        last = sheet.max()
        return float(last + end[sheet == last].max() / self.free.shape[1])

    def places(self, order: np.ndarray) -> list[Place]:
        """The places that an order gives, by board."""
        sheet, turn, x, y, _ = place_all(order, self.runs, self.starts, len(self.options.turns), self.free)
        found = []
        for k in range(len(order)):
            corner = np.array([x[k], y[k]]) * self.cell - self.options.spacing / 2
            shift = corner - self.corners[k][turn[k]]
            found.append(Place(int(sheet[k]), self.options.turns[turn[k]], (float(shift[0]), float(shift[1]))))
        return found


def _runs(shape: Polygon, cell: np.ndarray) -> np.ndarray:
    """Runs (N, 3) of column, first cell and cell after the last that a shape covers, counted from its lower left.

    What lies of the shape in one column is in connected parts, and a part touches every cell between its ends.
    """
    import shapely

    low, high = np.array(shape.bounds).reshape(2, 2)
    columns = int(np.ceil((high[0] - low[0]) / cell[0] - EDGE))
    left = low[0] + cell[0] * np.arange(columns)
    slack = EDGE * cell[0]  # what only touches the next column is not in it
    strips = shapely.box(left + slack, low[1] - 1, left + cell[0] - slack, high[1] + 1)
    parts, column = shapely.get_parts(shapely.intersection(shape, strips), return_index=True)
    ends = (shapely.bounds(parts)[:, [1, 3]] - low[1]) / cell[1]
    first, last = np.floor(ends[:, 0] + EDGE), np.ceil(ends[:, 1] - EDGE)
    return np.stack([column, first, np.maximum(last, first + 1)], axis=1).astype(np.int64)
