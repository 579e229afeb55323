"""Bookcases, cabinets of any number of boards, racks, and frames crossed by diagonals."""

from __future__ import annotations

from functools import partial

import numpy as np

from kerfwright.errors import OptionError
from kerfwright.model import Board, CutPath
from kerfwright.synthetic.carpentry import slab, trimmed
from kerfwright.synthetic.families._draw import between, chance, stock
from kerfwright.synthetic.outlines import Pen, arched, circle_hole, rectangle

__all__ = ["bookcase", "cabinet", "crossed_frame", "rack"]


def bookcase(rng: np.random.Generator) -> list[Board]:
    """Sides on feet, shelves between them, a top that overlaps or fits between, a back set in or laid on."""
    width, depth, height = between(rng, 420, 1000), between(rng, 180, 340), between(rng, 500, 1500)
    t, shelf = stock(rng, 16, 25), stock(rng, 15, 22)
    shelves = int(rng.integers(2, 6))
    back = stock(rng, 6, 12)
    capped, laid_on = chance(rng, 0.5), chance(rng, 0.5)
    x, y = width / 2, depth / 2
    side_top = height - shelf if capped else height
    foot = partial(arched, foot=between(rng, 40, 60), rise=between(rng, 15, 40)) if chance(rng, 0.6) else rectangle
    boards = [
        slab("side_left", (-x, -y, 0), (-x + t, y, side_top), foot),
        slab("side_right", (x - t, -y, 0), (x, y, side_top), foot),
    ]
    rear = y if laid_on else y - back
    if capped:
        boards.append(slab("top", (-x, -y, side_top), (x, y, height)))
    levels = np.round(np.linspace(between(rng, 50, 90), side_top - shelf, shelves + (not capped) + capped))
    levels = levels[:-1] if capped else levels
    for k, low in enumerate(levels):
        boards.append(slab(f"shelf_{k}", (-x + t, -y, low), (x - t, rear, low + shelf)))
    if laid_on:
        return [*boards, slab("back", (-x, y, levels[0]), (x, y + back, side_top))]
    return [*boards, slab("back", (-x + t, rear, levels[0]), (x - t, y, side_top))]


def cabinet(rng: np.random.Generator, boards: int | None = None) -> list[Board]:
    """Top, bottom, two sides, shelves and dividers: exactly as many boards as asked for, 4 to 60.

    Raises
    ------
    OptionError
        If fewer than 4 boards or more than 60 are asked for.
    """
    count = int(rng.integers(6, 20)) if boards is None else boards
    if not 4 <= count <= 60:
        raise OptionError(f"boards: {count}: a cabinet has 4 to 60 boards")
    shelves = min(count - 4, round(float(np.sqrt((count - 4) * 0.7))))
    rows = shelves + 1
    dividers = [(count - 4 - shelves) // rows + (k < (count - 4 - shelves) % rows) for k in range(rows)]
    t, thin = stock(rng, 12, 20), stock(rng, 10, 16)
    width = t * 2 + (max(dividers) + 1) * between(rng, 110, 150) + 150
    height, depth = 2 * t + rows * between(rng, 110, 150) + 100, between(rng, 160, 280)
    out = _carcass(rng, width, height, depth, t)
    levels = np.round(np.linspace(t, height - t + thin, rows + 1))
    for k in range(rows):
        low = levels[k]
        if k:
            out.append(slab(f"shelf_{k}", (-width / 2 + t, 0, low - thin), (width / 2 - t, depth, low)))
        high = levels[k + 1] - thin
        out += _dividers(rng, dividers[k], k, (width - 2 * t, depth), (low, high), thin)
    return out


def _carcass(rng, width: float, height: float, depth: float, t: float) -> list[Board]:
    """Sides between bottom and top, or bottom and top between sides, each corner pair its own way."""
    x = width / 2
    low, high = (t if chance(rng, 0.5) else 0.0), (height - t if chance(rng, 0.5) else height)
    ends = [x if low else x - t, x if high < height else x - t]
    return [
        slab("bottom", (-ends[0], 0, 0), (ends[0], depth, t)),
        slab("top", (-ends[1], 0, height - t), (ends[1], depth, height)),
        slab("side_left", (-x, 0, low), (-x + t, depth, high)),
        slab("side_right", (x - t, 0, low), (x, depth, high)),
    ]


def _dividers(rng, count: int, row: int, size, levels, thin: float) -> list[Board]:
    """Upright boards that part a row into compartments, not quite evenly."""
    width, depth = size
    places = (np.arange(1, count + 1) / (count + 1) - 0.5) * width + rng.uniform(-12, 12, count)
    return [
        slab(f"divider_{row}_{k}", (round(x) - thin / 2, 0, levels[0]), (round(x) + thin / 2, depth, levels[1]))
        for k, x in enumerate(places)
    ]


def rack(rng: np.random.Generator) -> list[Board]:
    """A rack: sides with a rounded front, a back, shelves with rows of round holes."""
    width, depth, height = between(rng, 300, 620), between(rng, 110, 180), between(rng, 240, 480)
    t, thin, back = stock(rng, 12, 20), stock(rng, 10, 18), stock(rng, 8, 15)
    shelves = int(rng.integers(1, 4))
    x = width / 2
    side = partial(_rounded_side, radius=round(depth * rng.uniform(0.5, 0.9)))
    boards = [
        slab("side_left", (-x, -depth, 0), (-x + t, 0, height), side),
        slab("side_right", (x - t, -depth, 0), (x, 0, height), side),
        slab("back", (-x + t, -back, 0), (x - t, 0, height - between(rng, 0, 40))),
    ]
    radius = between(rng, 10, min(32, (depth - back) / 2 - 18))
    reach = depth - back
    for k, low in enumerate(np.round(np.linspace(0.12, 0.62, shelves) * height)):
        path = partial(_holed, radius=radius) if k or shelves == 1 else rectangle
        boards.append(slab(f"shelf_{k}", (-x + t, -back - reach * 0.9, low), (x - t, -back, low + thin), path))
    return boards


def _rounded_side(length: float, width: float, radius: float) -> CutPath:
    """A side whose upper front corner is a large arc; x runs up."""
    r = min(radius, 0.9 * width)
    pen = Pen((0, 0)).line((length - r, 0))
    pen.arc((length - r + r * np.sqrt(0.5), r - r * np.sqrt(0.5)), (length, r))
    return CutPath(outer=pen.line((length, width)).line((0, width)).close())


def _holed(length: float, width: float, radius: float) -> CutPath:
    """A shelf with a row of round holes."""
    count = max(1, int((length - 40) / (2 * radius + 30)))
    places = (np.arange(count) + 0.5) / count * length
    return rectangle(length, width, *(circle_hole((x, width / 2), radius) for x in places))


def crossed_frame(rng: np.random.Generator) -> list[Board]:
    """A frame crossed by a diagonal and two half ones, all bevelled where they end."""
    width, height, depth = between(rng, 380, 750), between(rng, 350, 650), between(rng, 150, 280)
    t, thin = stock(rng, 12, 22), stock(rng, 10, 18)
    boards = _carcass(rng, width, height, depth, t)
    x, low, high = width / 2 - t, t, height - t
    middle = np.array([0, 0, height / 2])
    slope = np.array([2 * x, 0, high - low]) / np.hypot(2 * x, high - low)
    if chance(rng, 0.5):
        slope = slope * (-1, 1, 1)
    across = np.array([-slope[2], 0, slope[0]])
    walls = [
        (np.array([x, 0, 0]), np.array([1.0, 0, 0])),
        (np.array([-x, 0, 0]), np.array([-1.0, 0, 0])),
        (np.array([0, 0, high]), np.array([0, 0, 1.0])),
        (np.array([0, 0, low]), np.array([0, 0, -1.0])),
    ]
    y = np.array([0, 1.0, 0])
    boards.append(_strut("diagonal", middle, slope, y, thin, depth, walls))
    other = slope * (-1, 1, 1)
    for name, sign in (("half_upper", 1.0), ("half_lower", -1.0)):
        face = (middle + sign * across * thin / 2, -sign * across)
        boards.append(_strut(name, middle, sign * other, y, thin, depth, [*walls, face]))
    return boards


def _strut(name: str, middle, along, y, thin: float, depth: float, cuts) -> Board:
    """A board centred on the line through `middle`."""
    across = np.cross(along, y)
    return trimmed(name, middle - across * thin / 2, along, y, thin, depth, cuts)
