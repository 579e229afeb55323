"""Boards on sheets: a first layout, then tighter and tighter ones until nothing gives.

The last sheet is cut shorter by a little, what stands over is pushed back onto it, and boards that now overlap are
moved until none do, to any sheet and at any turn allowed (Gardeyn and Wauters, sparrow, 2025, for one endless strip;
here for sheets, with boards in the holes of others). Where that fails, the best layout is disturbed and tried again.

The search counts moves, not seconds: the same boards give the same sheets on any load. spyrrow, the packaged form of
sparrow, stops by the clock, and knows neither sheets nor holes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kerfwright_exporters._separation import separate
from kerfwright_exporters.bottom_left import first_places
from kerfwright_exporters.convex import convex_parts
from kerfwright_exporters.places import NestOptions, Place

if TYPE_CHECKING:
    from shapely.geometry import Polygon

__all__ = ["NestOptions", "Place", "nest"]

MOST_MOVES = 120_000  # of all boards together
MANY_PARTS = 8  # convex parts a board, from which a move takes so long that fewer are made
LONG_STEP, SHORT_STEP, SHORTEST_STEP = (
    0.01,
    0.002,
    0.0002,
)  # of the length in use, by which the last sheet is cut shorter
SAVING = 0.4  # share of the moves that may be spent on a sheet less
EXPLORING = 0.7  # share of those left that is spent on long steps
FAILURES_A_BOARD = 3  # in a row, after which few boards, whose layouts have all been tried, are left as they are
DENSEST = 0.97  # share of a sheet that boards with curves and corners hardly fill
MANY_CORNERS, STRAY = 24, 0.25  # outlines of more corners are drawn with fewer, up to twice so far outside, mm


def nest(outlines: list[Polygon], options: NestOptions) -> list[Place]:
    """A place for every outline, mm, on as few sheets as it finds, the last one as empty as it finds.

    Raises
    ------
    ValueError
        If an outline is too large for a sheet at any allowed turn; its index is the argument.
    """
    if not outlines:
        return []
    places = first_places(outlines, options)
    if len(outlines) == 1 or not options.moves:
        return places
    return _Search(outlines, options, places).best_places()


@dataclass
class _Layout:
    """Where every grown outline lies, and how long each sheet is.

    at : (N, 6) sheet, turn (as an index), left, bottom, right and top; the last two are for `separate` to set
    """

    at: np.ndarray
    lengths: np.ndarray

    def copy(self) -> _Layout:
        return _Layout(self.at.copy(), self.lengths.copy())


class _Shapes:
    """The outlines, grown by half the spacing, as convex parts at every turn, lower left corners at the origin.

    arrays : edges (E, 5), see `_edges`; parts (P, 6) with left, bottom, right, top, first edge and edge after the last;
        shapes, an outline at a turn each, (N * turns, 4) with length, width, first part and part after the last
    """

    def __init__(self, outlines: list[Polygon], options: NestOptions) -> None:
        self.corners: list[np.ndarray] = []
        edges, parts, shapes = [], [], []
        for outline in outlines:
            pieces = sorted(convex_parts(_grown(outline, options.spacing / 2)), key=_area, reverse=True)
            for turn in options.turns:
                turned = [piece @ _turn(turn).T for piece in pieces]
                everything = np.concatenate(turned)
                low, first = everything.min(axis=0), len(parts)
                self.corners.append(low)
                for piece in (piece - low for piece in turned):
                    start = parts[-1][5] if parts else 0
                    edges.append(_edges(piece))
                    parts.append([*piece.min(axis=0), *piece.max(axis=0), start, start + len(piece)])
                shapes.append([*np.ptp(everything, axis=0), first, len(parts)])
        self.sizes = np.array(shapes)[:, :2]
        lines, pieces = np.concatenate(edges), np.array(parts)
        self.arrays = lines, pieces, np.array(shapes)


def _area(piece: np.ndarray) -> float:
    """Of a convex part; large ones are looked at first, since they show soonest that a place is no good."""
    x, y = piece.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def _edges(piece: np.ndarray) -> np.ndarray:
    """(N, 5) of a convex part: the normal outwards of every edge, how far out it lies, and the corner it starts at."""
    along = np.roll(piece, -1, axis=0) - piece
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    return np.column_stack([normals, (piece * normals).sum(axis=1), piece])


def _turn(degrees: int) -> np.ndarray:
    c, s = round(np.cos(np.radians(degrees)), 12), round(np.sin(np.radians(degrees)), 12)
    return np.array([[c, -s], [s, c]])


def _grown(outline: Polygon, distance: float) -> Polygon:
    """The outline let out; one of many corners by a little more and with fewer of them."""
    grown = outline.buffer(distance, join_style="mitre", mitre_limit=2.0)
    if len(grown.exterior.coords) + sum(len(ring.coords) for ring in grown.interiors) <= MANY_CORNERS:
        return grown
    return grown.buffer(STRAY, join_style="mitre", mitre_limit=2.0).simplify(STRAY)


class _Search:
    """Tighter and tighter layouts of the same boards."""

    def __init__(self, outlines: list[Polygon], options: NestOptions, places: list[Place]) -> None:
        self.options, self.first = options, places
        self.shapes = _Shapes(outlines, options)
        self.areas = np.array([outline.area for outline in outlines])
        self.turns = len(options.turns)
        self.full = np.array([options.length, options.width]) + options.spacing
        self.rng = np.random.default_rng(options.seed)
        parts = len(self.shapes.arrays[1]) / len(self.shapes.sizes)
        self.moves = int(min(MOST_MOVES, options.moves * len(outlines)) * min(1.0, MANY_PARTS / parts))

    def best_places(self) -> list[Place]:
        """The best layout found; the first one, where drawing outlines with fewer corners makes one too large."""
        best = self._started()
        sizes = self.shapes.sizes.reshape(-1, self.turns, 2)
        if not (sizes <= self.full + 1e-9).all(axis=2).any(axis=1).all():
            return self.first
        best = self._shortened(self._fewer_sheets(best), sizes)
        return [self._place(best, k) for k in range(len(self.areas))]

    def _started(self) -> _Layout:
        turned = np.array([self.options.turns.index(place.turn) for place in self.first])
        corners = [self.shapes.corners[k * self.turns + t] for k, t in enumerate(turned)]
        x, y = (np.array([p.shift for p in self.first]) + corners + self.options.spacing / 2).T
        sheets = np.array([place.sheet for place in self.first])
        lengths = np.full(sheets.max() + 1, self.full[0])
        return _Layout(np.column_stack([sheets, turned, x, y, x, y]).astype(float), lengths)

    def _place(self, layout: _Layout, k: int) -> Place:
        sheet, turn = layout.at[k, :2].astype(int)
        shift = layout.at[k, 2:4] - self.shapes.corners[k * self.turns + turn] - self.options.spacing / 2
        return Place(int(sheet), self.options.turns[turn], (float(shift[0]), float(shift[1])))

    def _fewer_sheets(self, best: _Layout) -> _Layout:
        """Without the last sheet, as long as its boards find room on the others."""
        spare = int((1 - SAVING) * self.moves)
        while len(best.lengths) > 1 and self.areas.sum() < DENSEST * self.full.prod() * (len(best.lengths) - 1):
            fewer = best.copy()
            fewer.lengths = fewer.lengths[:-1]
            if not self._found_room(fewer, spare):
                break
            best = fewer
        return best

    def _found_room(self, layout: _Layout, spare: int) -> bool:
        """Move boards until none overlap; where that fails, go on from there with two boards in each other's place."""
        for _ in range(FAILURES_A_BOARD * len(self.areas)):
            if self.moves <= spare:
                break
            if self._apart(layout, self.moves - spare):
                return True
            self._disrupt(layout)
        return False

    def _shortened(self, best: _Layout, sizes: np.ndarray) -> _Layout:
        """With the last sheet as short as it gets."""
        best.lengths[-1] = self._used(best)
        exploring, step, failures = (1 - EXPLORING) * self.moves, LONG_STEP, 0
        least = self._least_length(best, sizes)
        while self.moves > 0 and failures < FAILURES_A_BOARD * len(self.areas):
            compressing = self.moves < exploring
            step = min(step, SHORT_STEP) if compressing else step
            goal = best.copy()
            goal.lengths[-1] -= step * goal.lengths.sum()
            if goal.lengths[-1] < least:
                break
            if failures and not compressing:
                self._disrupt(goal)
            if self._apart(goal, self.moves):
                best, failures = goal, 0
                best.lengths[-1] = min(best.lengths[-1], self._used(best))
            else:
                failures += 1
                step = max(0.7 * step, SHORTEST_STEP)
        return best

    def _least_length(self, best: _Layout, sizes: np.ndarray) -> float:
        """What the last sheet cannot be shorter than: an only one holds all boards, others the smallest at least."""
        if len(best.lengths) > 1:
            return float(sizes[:, :, 0].min())
        return max(self.areas.sum() / (DENSEST * self.full[1]), float(sizes[:, :, 0].min(axis=1).max()))

    def _used(self, layout: _Layout) -> float:
        """How far boards reach on the last sheet."""
        index = np.arange(len(self.areas)) * self.turns + layout.at[:, 1].astype(int)
        ends = layout.at[:, 2] + self.shapes.sizes[index, 0]
        return float(ends[layout.at[:, 0] == len(layout.lengths) - 1].max(initial=0.0))

    def _apart(self, layout: _Layout, moves: int) -> bool:
        """Push all boards onto their sheets and move them until none overlap; the moves are counted."""
        if not self._squeeze(layout):
            self.moves -= 1
            return False
        weights = np.ones((len(self.areas), len(self.areas)))
        on = *self.shapes.arrays, self.turns, layout.lengths, self.full[1], layout.at
        done, left = separate(*on, weights, int(self.rng.integers(1 << 30)), moves)
        self.moves -= max(1, moves - left)
        return bool(done)

    def _squeeze(self, layout: _Layout) -> bool:
        """Push boards that stand out of their sheets back, or onto others; whether there is a sheet for each."""
        last = len(layout.lengths) - 1
        for board, (sheet, turn) in enumerate(layout.at[:, :2].astype(int)):
            room = self._room(layout, board, turn, min(sheet, last))
            if sheet <= last and (room >= 0).all():
                layout.at[board, 2:4] = np.clip(layout.at[board, 2:4], 0, room)
            elif not self._resettle(layout, board, min(sheet, last)):
                return False
        return True

    def _resettle(self, layout: _Layout, board: int, nearest: int) -> bool:
        """Put a board anywhere on any sheet, at any turn, where it fits; the nearest sheet first."""
        for sheet in (nearest, *self.rng.permutation(len(layout.lengths))):
            for turn in self.rng.permutation(self.turns):
                room = self._room(layout, board, turn, sheet)
                if (room >= 0).all():
                    layout.at[board, :4] = sheet, turn, *(self.rng.random(2) * room)
                    return True
        return False

    def _room(self, layout: _Layout, board: int, turn: int, sheet: int) -> np.ndarray:
        """How far a board can be shifted on a sheet, along and across."""
        return np.array([layout.lengths[sheet], self.full[1]]) - self.shapes.sizes[board * self.turns + turn]

    def _disrupt(self, layout: _Layout) -> None:
        """Let two large boards change places."""
        large = np.argsort(-self.areas, kind="stable")[: max(2, len(self.areas) // 3)]
        pair = self.rng.choice(large, 2, replace=False)
        layout.at[pair[:, None], (0, 2, 3)] = layout.at[pair[::-1, None], (0, 2, 3)]
