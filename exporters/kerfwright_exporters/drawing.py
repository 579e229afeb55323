"""A board as something to cut: loops, bevel lines and a label, by operation; what DXF, SVG and sheets all draw.

Board frame seen from the top: x to the right, y up, millimetres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from kerfwright.errors import ExportError
from kerfwright.model import Bezier, Board, CutPath, Loop
from kerfwright.model.arcs import arc_path
from kerfwright.model.geometry import path_polygon, transform_loop
from kerfwright_exporters.naming import STAMP, plain_name
from kerfwright_exporters.offset import offset_loop
from kerfwright_exporters.options import ExportOptions
from kerfwright_exporters.relief import relieved_path

if TYPE_CHECKING:
    from shapely.geometry import Polygon
    from shapely.geometry.base import BaseGeometry

__all__ = [
    "BevelLine", "Cut", "Drawing", "Text", "board_drawing", "cutting_path", "moved_drawing", "outline_polygon",
    "text_room", "upright",
]  # fmt: skip

CHORD = 0.01  # mm between an arc and its chords, when it is asked whether arcs cross
FINER = 10  # halvings of the tolerance of arcs, down to a twentieth of a micrometre
LETTER_WIDTH = 0.95  # of a letter's height, with the space after it, in the widest of the usual fonts
GRID = 25  # places across a board and along it where a label is tried
TEXT_HEIGHTS = (12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5)  # mm, the largest that fits is taken


@dataclass(frozen=True)
class Cut:
    """A closed loop to cut through; `depth` is the board's thickness, mm."""

    operation: Literal["inside", "outside", "inside_kerf", "outside_kerf"]
    loop: Loop
    depth: float


@dataclass(frozen=True)
class BevelLine:
    """A stretch of the outline to cut at a slant; the angle in degrees, positive when the top is the shorter side."""

    start: tuple[float, float]
    end: tuple[float, float]
    angle: float


@dataclass(frozen=True)
class Text:
    """One line of text, centred on a point; height in mm, turn in radians."""

    operation: Literal["bevel", "dimension", "label", "stamp"]
    text: str
    at: tuple[float, float]
    height: float
    turn: float = 0.0


@dataclass(frozen=True)
class Drawing:
    """Everything to draw of one board, in the order of cutting: inside cuts come before the outline that holds them."""

    cuts: tuple[Cut, ...]
    bevels: tuple[BevelLine, ...]
    texts: tuple[Text, ...]


def board_drawing(board: Board, options: ExportOptions) -> Drawing:
    """The board's drawing in its own frame."""
    path = cutting_path(board, options)
    depth = board.thickness.value
    cuts = [*(Cut("inside", hole, depth) for hole in path.holes), Cut("outside", path.outer, depth)]
    if options.kerf:
        cuts = [c for cut in cuts for c in (cut, _tool_path(cut, options.kerf / 2, board.name))]
    bevels = tuple(BevelLine(b.start, b.end, b.angle.value) for b in board.bevels)
    return Drawing(tuple(cuts), bevels, tuple(_texts(board, path, bevels, options)))


def cutting_path(board: Board, options: ExportOptions) -> CutPath:
    """The cut path as the files carry it: reliefs as asked for, Beziers as arcs unless splines were asked for.

    Raises
    ------
    ExportError
        If arcs would cross each other at any tolerance, or there is no room for a relief.
    """
    path = board.cut_path if options.splines else _as_arcs(board, options.arc_tolerance)
    if options.relief == "none":
        return path
    return relieved_path(path, options.relief, options.tool_diameter, board.name)


def _as_arcs(board: Board, tolerance: float) -> CutPath:
    """The cut path with arcs for Beziers, within less than the tolerance where they would cross in a slit."""
    if not any(isinstance(e, Bezier) for loop in (board.cut_path.outer, *board.cut_path.holes) for e in loop.edges):
        return board.cut_path
    for halvings in range(FINER):
        path = arc_path(board.cut_path, tolerance / 2**halvings)
        if path_polygon(path, min(CHORD, tolerance / 2**halvings)).is_valid:
            return path
    raise ExportError(
        f"board {board.name!r}: cut_path: arcs for its curves would cross each other: widen its slits, "
        "or export with splines"
    )


def outline_polygon(path: CutPath, chord: float = CHORD) -> Polygon:
    """The path as a polygon, curves within the chord (mm); the largest part, where chords cross a narrow slit."""
    import shapely

    polygon = path_polygon(path, chord)
    if polygon.is_valid:
        return polygon
    parts = shapely.get_parts(shapely.make_valid(polygon))
    return max((part for part in parts if part.geom_type == "Polygon"), key=shapely.area)


def _tool_path(cut: Cut, distance: float, name: str) -> Cut:
    return Cut(f"{cut.operation}_kerf", offset_loop(cut.loop, distance, name), cut.depth)


def _texts(board: Board, path: CutPath, bevels: tuple[BevelLine, ...], options: ExportOptions) -> Iterator[Text]:
    polygon = outline_polygon(path, 0.1)
    lines = [plain_name(board.name), *([STAMP] if options.unverified else [])]
    (x, y), size = text_room(polygon, LETTER_WIDTH * max(map(len, lines)), 1.5 * len(lines), TEXT_HEIGHTS)
    for row, (operation, text) in enumerate(zip(("label", "stamp"), lines, strict=False)):
        yield Text(operation, text, (x, y + (0.75 * (len(lines) - 1) - 1.5 * row) * size), size)
    for (start, end), angles in _by_stretch(bevels).items():
        yield _bevel_text(start, end, angles, size)


def text_room(
    polygon: BaseGeometry, width: float, height: float, sizes: Sequence[float]
) -> tuple[tuple[float, float], float]:
    """Where text fits on the board, centred, and the first of the sizes of letters that keeps it on it, mm.

    Width and height are those of all the text, as multiples of its size.
    """
    import shapely

    centres = np.array(list(_centres(polygon)))
    for size in sizes:
        half = np.array([width, height]) * size / 2
        fits = shapely.covers(polygon, shapely.box(*(centres - half).T, *(centres + half).T))
        if fits.any():
            x, y = centres[int(fits.argmax())]
            return (float(x), float(y)), size
    return tuple(map(float, centres[1])), sizes[-1]


def _centres(polygon: BaseGeometry) -> Iterator[tuple[float, float]]:
    """Where text may be centred: the centroid, the middle of the largest circle, a grid from the centroid out."""
    import shapely

    middle = np.array(polygon.centroid.coords[0])
    yield tuple(middle)
    largest = max(shapely.get_parts(polygon), key=shapely.area)
    yield shapely.maximum_inscribed_circle(largest, tolerance=1.0).coords[0]
    x, y = (np.linspace(low, high, GRID) for low, high in np.reshape(polygon.bounds, (2, 2)).T)
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    yield from grid[np.argsort(np.hypot(*(grid - middle).T), kind="stable")]


def _by_stretch(bevels: tuple[BevelLine, ...]) -> dict[tuple, list[float]]:
    """Angles of the bevels, those of one stretch together."""
    found: dict[tuple, list[float]] = {}
    for bevel in bevels:
        found.setdefault((bevel.start, bevel.end), []).append(bevel.angle)
    return found


def _bevel_text(start: tuple[float, float], end: tuple[float, float], angles: list[float], size: float) -> Text:
    """The angles, beside the middle of the stretch, on the board, reading along the cut."""
    first, last = np.array(start), np.array(end)
    length = np.hypot(*(last - first))
    along = (last - first) / length
    text = "BEVEL " + " ".join(f"{angle:+.1f}" for angle in angles)
    height = float(min(size, 0.9 * length / (LETTER_WIDTH * len(text))))
    at = (first + last) / 2 + height * np.array([-along[1], along[0]])
    turn = upright(float(np.arctan2(along[1], along[0])))
    return Text("bevel", text, (float(at[0]), float(at[1])), height, turn)


def upright(turn: float) -> float:
    """The turn of a line of text, or its opposite, so that it reads from the left or from below."""
    turn = (turn + np.pi) % (2 * np.pi) - np.pi
    return turn if -np.pi / 2 + 1e-3 < turn < np.pi / 2 + 1e-3 else turn - np.sign(turn) * np.pi


def moved_drawing(drawing: Drawing, target_from_board: np.ndarray) -> Drawing:
    """The drawing after a turn and a move, (2, 3), not a mirror image."""
    m = np.asarray(target_from_board, float)
    turn = float(np.arctan2(m[1, 0], m[0, 0]))

    def at(point: tuple[float, float]) -> tuple[float, float]:
        x, y = m[:, :2] @ np.array(point) + m[:, 2]
        return float(x), float(y)

    return Drawing(
        tuple(Cut(c.operation, transform_loop(c.loop, m), c.depth) for c in drawing.cuts),
        tuple(BevelLine(at(b.start), at(b.end), b.angle) for b in drawing.bevels),
        tuple(Text(t.operation, t.text, at(t.at), t.height, upright(t.turn + turn)) for t in drawing.texts),
    )
