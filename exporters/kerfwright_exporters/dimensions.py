"""Dimension lines on cut sheets: length and width of every board as it lies, and of the sheet.

A line is laid where most of it is on the board, and left out where its figure does not fit: the label has the size too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.model import CutPath
from kerfwright_exporters.cutlist import length_text
from kerfwright_exporters.drawing import LETTER_WIDTH, outline_polygon
from kerfwright_exporters.options import ExportOptions

if TYPE_CHECKING:
    from shapely.geometry import Polygon

    from kerfwright_exporters.sheets import LaidBoard, Sheet

__all__ = ["Dimension", "sheet_dimensions"]

FIGURES = 1.9  # mm of paper, the height of figures
NEAR_RIM, PLACES = 0.5, 21  # lines lie this many heights of a figure from the rim, or in one of so many places
NARROW = 8  # heights of a figure: narrower boards have room for their label only
OUTSIDE = 5.0  # mm of paper between the sheet and its own dimensions


@dataclass(frozen=True)
class Dimension:
    """A line with strokes across its ends and a figure on it; sheet frame, mm; turn in radians."""

    start: tuple[float, float]
    end: tuple[float, float]
    text: str
    at: tuple[float, float]
    height: float
    turn: float

    @property
    def lines(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The line and the slanted strokes that end it, as pairs of points."""
        start, end = np.array(self.start), np.array(self.end)
        along = (end - start) / np.hypot(*(end - start))
        stroke = 0.3 * self.height * (along + np.array([-along[1], along[0]]))
        return [(start, end), (start - stroke, start + stroke), (end - stroke, end + stroke)]


def sheet_dimensions(sheet: Sheet, scale: float, options: ExportOptions) -> Iterator[Dimension]:
    """All dimensions of a sheet that is drawn at 1:scale."""
    height, gap = FIGURES * scale, OUTSIDE * scale
    for across, length in ((0, sheet.length), (1, sheet.width)):
        text = length_text(length, options)
        yield _dimension(across, (0.0, length), -gap, length / 2, height, text, 1 if across == 0 else -1)
    for board in sheet.boards:
        polygon = _polygon(board)
        for across in (0, 1):
            yield from _on_board(polygon, across, height, options)


def _polygon(board: LaidBoard) -> Polygon:
    """The board's outline as laid."""
    loops = {"outside": [], "inside": []}
    for cut in board.drawing.cuts:
        loops.setdefault(cut.operation, []).append(cut.loop)
    return outline_polygon(CutPath(outer=loops["outside"][0], holes=tuple(loops["inside"])), 0.1)


def _on_board(polygon: Polygon, across: int, height: float, options: ExportOptions) -> Iterator[Dimension]:
    """The board's extent along x (across 0) or y (1), if the figure finds room on the board."""
    import shapely

    box = np.array(polygon.bounds).reshape(2, 2)
    (low, high), (near, far) = box[:, across], box[:, 1 - across]
    text = length_text(high - low, options)
    if far - near < NARROW * height:
        return
    places = np.linspace(near + NEAR_RIM * height, far - NEAR_RIM * height, PLACES)
    lines = [_line(across, low - 1, high + 1, place) for place in places]
    pieces = [max(shapely.get_parts(polygon.intersection(line)), key=shapely.length) for line in lines]
    # the label is in the middle: of lines about as long, the one furthest from there
    aside = np.abs(np.linspace(-1, 1, PLACES))
    chosen = int(np.argmax([round(p.length / (high - low), 2) + 0.01 * a for p, a in zip(pieces, aside, strict=True)]))
    ends = np.sort(np.array(pieces[chosen].coords)[:, across])
    if np.ptp(ends) < LETTER_WIDTH * height * (len(text) + 4):
        return
    inward = 1 if chosen <= PLACES // 2 else -1
    yield _dimension(across, (low, high), places[chosen], ends[0] + 0.3 * np.ptp(ends), height, text, inward)


def _line(across: int, low: float, high: float, place: float):
    from shapely.geometry import LineString

    points = np.array([[low, place], [high, place]])
    return LineString(points if across == 0 else points[:, ::-1])


def _dimension(
    across: int, ends: tuple[float, float], place: float, middle: float, height: float, text: str, side: int
) -> Dimension:
    """Along x at y = place, or along y at x = place; the figure beside it, above or to the right where side is 1."""
    beside = place + 0.8 * side * height
    if across == 0:
        return Dimension((ends[0], place), (ends[1], place), text, (middle, beside), height, 0.0)
    return Dimension((place, ends[0]), (place, ends[1]), text, (beside, middle), height, np.pi / 2)
