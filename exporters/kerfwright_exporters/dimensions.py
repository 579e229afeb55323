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
    from shapely.geometry.base import BaseGeometry

    from kerfwright_exporters.sheets import LaidBoard, Sheet

__all__ = ["Dimension", "laid_polygon", "sheet_dimensions"]

FIGURES = 1.9  # mm of paper, the height of figures
NEAR_RIM, PLACES = 0.5, 21  # lines lie this many heights of a figure from the rim, or in one of so many places
SHARES = (0.3, 0.5, 0.7)  # of the line, where the figure may stand
NARROW = 8  # heights of a figure: narrower boards have room for their label only
LEAST_HEIGHT = 1.6  # mm of paper, of the letters beside a bevel
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

    @property
    def room(self) -> BaseGeometry:
        """What the line and its figure cover."""
        import shapely

        across = int(self.turn != 0)
        figure = _figure_box(across, self.at[across], self.at[1 - across], len(self.text), self.height)
        return shapely.LineString([self.start, self.end]).buffer(0.2 * self.height).union(figure)


def sheet_dimensions(sheet: Sheet, scale: float, options: ExportOptions) -> Iterator[Dimension]:
    """All dimensions of a sheet that is drawn at 1:scale."""
    height, gap = FIGURES * scale, OUTSIDE * scale
    for across, length in ((0, sheet.length), (1, sheet.width)):
        text = length_text(length, options)
        yield _dimension(across, (0.0, length), -gap, length / 2, height, text, 1 if across == 0 else -1)
    for board in sheet.boards:
        polygon = laid_polygon(board)
        free = polygon.difference(_texts(board, scale))
        for across in (0, 1):
            yield from _on_board(polygon, free, across, height, options)


def laid_polygon(board: LaidBoard) -> Polygon:
    """The board's outline as laid."""
    loops = {"outside": [], "inside": []}
    for cut in board.drawing.cuts:
        loops.setdefault(cut.operation, []).append(cut.loop)
    return outline_polygon(CutPath(outer=loops["outside"][0], holes=tuple(loops["inside"])), 0.1)


def _texts(board: LaidBoard, scale: float) -> BaseGeometry:
    """Where the board's label stands, and along the stretches of its bevels their angles."""
    import shapely
    from shapely import affinity

    height = max((t.height for t in board.drawing.texts if t.operation == "bevel"), default=0.0)
    stretches = shapely.MultiLineString([(b.start, b.end) for b in board.drawing.bevels])
    covered = [stretches.buffer(1.7 * max(height, LEAST_HEIGHT * scale), cap_style="flat")]
    for text in board.drawing.texts:
        if text.operation != "bevel":
            box = _figure_box(0, *text.at, len(text.text), text.height)
            covered.append(affinity.rotate(box, text.turn, use_radians=True))
    return shapely.union_all(covered)


def _figure_box(across: int, along: float, beside: float, letters: int, height: float) -> Polygon:
    """The room that a line of text takes, centred, written along x (across 0) or y (1)."""
    import shapely

    middle, half = np.array([along, beside]), np.array([LETTER_WIDTH * letters, 1.2]) * height / 2
    low, high = middle - half, middle + half
    return shapely.box(*low, *high) if across == 0 else shapely.box(*low[::-1], *high[::-1])


def _on_board(
    polygon: Polygon, free: BaseGeometry, across: int, height: float, options: ExportOptions
) -> Iterator[Dimension]:
    """The board's extent along x (across 0) or y (1), if the figure finds room on what is free of the board."""
    box = np.array(polygon.bounds).reshape(2, 2)
    (low, high), (near, far) = box[:, across], box[:, 1 - across]
    text = length_text(high - low, options)
    if far - near < NARROW * height:
        return
    for place, (start, end) in _places(free, across, (low, high), (near + NEAR_RIM * height, far - NEAR_RIM * height)):
        inward = 1 if place <= (near + far) / 2 else -1
        for share in SHARES:
            middle, beside = start + share * (end - start), place + 0.8 * inward * height
            if free.covers(_figure_box(across, middle, beside, len(text) + 1, height)):
                yield _dimension(across, (low, high), place, middle, height, text, inward)
                return


def _places(
    free: BaseGeometry, across: int, ends: tuple[float, float], between: tuple[float, float]
) -> Iterator[tuple[float, np.ndarray]]:
    """Places of a line and its longest free stretch, the longest first; of like ones the outermost."""
    import shapely

    places, aside = np.linspace(*between, PLACES), np.abs(np.linspace(-1, 1, PLACES))
    lines = [free.intersection(_line(across, ends[0] - 1, ends[1] + 1, place)) for place in places]
    pieces = [max(shapely.get_parts(line), key=shapely.length, default=None) for line in lines]
    lengths = [shapely.length(piece) / (ends[1] - ends[0]) for piece in pieces]
    for k in np.argsort([-round(n, 2) - 0.01 * a for n, a in zip(lengths, aside, strict=True)], kind="stable"):
        if lengths[k] > 0:
            yield places[k], np.sort(shapely.get_coordinates(pieces[k])[:, across])


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
