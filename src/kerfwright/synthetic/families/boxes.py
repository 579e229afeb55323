"""Boxes, trays and frames: four sides and what closes them, corners overlapping either way, mitred or askew."""

from __future__ import annotations

from functools import partial

import numpy as np

from kerfwright.model import Board, CutPath
from kerfwright.synthetic.carpentry import board, slab, trimmed
from kerfwright.synthetic.families._draw import between, chance, stock
from kerfwright.synthetic.outlines import Pen, polygon, rectangle, slot_hole

__all__ = ["mitred_frame", "skewed_box", "tray"]


def tray(rng: np.random.Generator) -> list[Board]:
    """A tray or box: base between or under the sides, hand holds, each corner overlapping its own way."""
    length, width = between(rng, 260, 620), between(rng, 180, 380)
    height, t, base = between(rng, 60, 220), stock(rng, 8, 18), stock(rng, 6, 15)
    under = chance(rng, 0.4)
    floor = 0.0 if under else between(rng, 0, 12) * chance(rng, 0.5)
    inner = (length - 2 * t, width - 2 * t)
    x, y = length / 2, width / 2
    bottom = slab("base", (-x, -y, 0), (x, y, base)) if under else _inlay("base", inner, floor, base)
    low = base if under else 0.0
    ends_cover = rng.random(4) < 0.5  # at corner (sign of x, sign of y): whether the end covers the side's cut
    sides = [bottom]
    for k, (name, side) in enumerate((("end_left", -1), ("end_right", 1))):
        reach = [y if ends_cover[2 * k + j] else y - t for j in range(2)]
        span = sorted((side * x, side * (x - t)))
        path = partial(_end, lift=between(rng, 0.2 * height, 0.4 * height), hold=chance(rng, 0.7) and height > 90)
        sides.append(slab(name, (span[0], -reach[0], low), (span[1], reach[1], low + height), path))
    for j, (name, side) in enumerate((("side_front", -1), ("side_back", 1))):
        reach = [x - t if ends_cover[2 * k + j] else x for k in range(2)]
        span = sorted((side * y, side * (y - t)))
        tall = height * (0.6 if chance(rng, 0.3) else 1.0)
        sides.append(slab(name, (-reach[0], span[0], low), (reach[1], span[1], low + round(tall))))
    return sides


def _inlay(name: str, size: tuple[float, float], low: float, thickness: float) -> Board:
    return slab(name, (-size[0] / 2, -size[1] / 2, low), (size[0] / 2, size[1] / 2, low + thickness))


def _end(length: float, width: float, lift: float, hold: bool) -> CutPath:
    """A tray's end: a hump in the middle for the hand, with a slot through it."""
    if length < 1.3 * width or lift < 15:
        return rectangle(length, width)
    shoulder, low = 0.12 * length, width - lift
    pen = Pen((0, 0)).line((length, 0)).line((length, low))
    pen.bezier((length - shoulder, low), (0.7 * length + shoulder, width), (0.7 * length, width))
    pen.line((0.3 * length, width)).bezier((0.3 * length - shoulder, width), (shoulder, low), (0, low))
    holes = (slot_hole((length / 2, width - 26), 0.3 * length, 22),) if hold else ()
    return CutPath(outer=pen.close(), holes=holes)


def mitred_frame(rng: np.random.Generator) -> list[Board]:
    """Four boards mitred at their corners: flat like a picture frame on its side, or upright with a base in it."""
    return _picture_frame(rng) if chance(rng, 0.5) else _mitred_box(rng)


def _picture_frame(rng: np.random.Generator) -> list[Board]:
    """Boards in one plane, cut at 45 degrees across; two feet make it stand."""
    length, height = between(rng, 300, 700), between(rng, 250, 520)
    w, t = between(rng, 40, 80), stock(rng, 12, 25)
    rail = polygon([(0, 0), (length, 0), (length - w, w), (w, w)])
    stile = polygon([(0, 0), (height, 0), (height - w, w), (w, w)])
    up, along = np.array([0, 0, 1.0]), np.array([1.0, 0, 0])
    x, y, lift = length / 2, t / 2, 0.0
    boards = [
        board("rail_bottom", (-x, y, lift), along, up, t, rail),
        board("rail_top", (x, y, lift + height), -along, -up, t, rail),
        board("stile_left", (-x, y, lift + height), -up, along, t, stile),
        board("stile_right", (x, y, lift), up, -along, t, stile),
    ]
    depth, foot = between(rng, 60, 90), stock(rng, 15, 22)
    for name, side in (("foot_front", -1), ("foot_back", 1)):
        span = sorted((side * y, side * (y + depth)))
        boards.append(slab(name, (-foot / 2, span[0], 0), (foot / 2, span[1], w - 5)))
    return boards


def _mitred_box(rng: np.random.Generator) -> list[Board]:
    """Upright boards bevelled at 45 degrees, a base between them."""
    length, width = between(rng, 240, 560), between(rng, 180, 380)
    height, t = between(rng, 70, 200), stock(rng, 10, 22)
    boards = []
    for name, out, reach in (
        ("front", (0, -1, 0), width),
        ("right", (1, 0, 0), length),
        ("back", (0, 1, 0), width),
        ("left", (-1, 0, 0), length),
    ):
        out = np.array(out, float)
        along = np.cross((0, 0, 1.0), out)
        half = (length if out[1] else width) / 2
        cuts = [(out * reach / 2 + sign * along * half, (sign * along - out) / np.sqrt(2)) for sign in (-1, 1)]
        origin = out * (reach / 2 - t)
        boards.append(trimmed(name, origin, along, (0, 0, 1), t, height, cuts))
    base, low = stock(rng, 6, 12), between(rng, 0, 15) * chance(rng, 0.5)
    boards.append(_inlay("base", (length - 2 * t, width - 2 * t), low, base))
    return boards


def skewed_box(rng: np.random.Generator, corner: float | None = None) -> list[Board]:
    """A box whose plan is a parallelogram: corners of 80 and 100 degrees unless told otherwise, sides bevelled to meet.

    The long sides cover the short ones' cuts, which are bevelled.
    """
    angle = np.radians(80.0 if corner is None else corner)
    length, width = between(rng, 300, 600), between(rng, 200, 380)
    height, t = between(rng, 80, 220), stock(rng, 10, 20)
    along, across = np.array([1.0, 0, 0]), np.array([np.cos(angle), np.sin(angle), 0])
    out = np.array([np.sin(angle), -np.cos(angle), 0])  # of the right short side
    up, y = np.array([0, 0, 1.0]), np.array([0, 1.0, 0])
    deep = width * np.sin(angle) / 2  # half the distance between the long sides' inner faces
    corner_right = along * length / 2
    boards = []
    for name, side in (("long_front", -1), ("long_back", 1)):
        inner = y * side * deep
        edges = [(s * corner_right, s * out) for s in (-1, 1)]
        origin = inner if side > 0 else inner - y * t
        boards.append(trimmed(name, origin, -along, up, t, height, edges))
    for name, side in (("short_right", 1), ("short_left", -1)):
        ends = [(y * s * deep, y * s) for s in (-1, 1)]
        origin = side * corner_right - (out * t if side > 0 else 0)
        boards.append(trimmed(name, origin, across, up, t, height, ends))
    return [*boards, _skewed_base(rng, along, across, out, length, t, deep)]


def _skewed_base(rng, along, across, out, length: float, t: float, deep: float) -> Board:
    """The parallelogram between the four sides."""
    inset = t / abs(out[0])  # the short sides' thickness measured along the long ones
    a = along * (length / 2 - inset)
    b = across * deep / across[1]
    corners = [-a - b, a - b, a + b, b - a]
    flat = [tuple((c - corners[0])[:2]) for c in corners]
    return board("base", corners[0], along, (0, 1, 0), stock(rng, 6, 12), polygon(flat))
