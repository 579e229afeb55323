"""Stools, benches and tables: a top on panels or legs, held together by stretchers and aprons."""

from __future__ import annotations

from functools import partial

import numpy as np

from kerfwright.model import Board, CutPath
from kerfwright.synthetic.carpentry import board, slab, trimmed
from kerfwright.synthetic.families._draw import between, chance, stock
from kerfwright.synthetic.outlines import Pen, arched, polygon, rounded, slot_hole

__all__ = ["bench", "stool", "table", "tilted_stool"]


def stool(rng: np.random.Generator) -> list[Board]:
    """Two panel legs with arches or waists, a top with a hand hold, a stretcher."""
    length, width, height = between(rng, 320, 520), between(rng, 230, 340), between(rng, 200, 480)
    t, top = stock(rng, 15, 25), stock(rng, 15, 25)
    inset, depth = between(rng, 15, 60), width - between(rng, 10, 50)
    radius = between(rng, 15, 60) * chance(rng, 0.7)
    holes = (slot_hole((length / 2, width / 2), between(rng, 90, 130), between(rng, 26, 36)),) * chance(rng, 0.6)
    x, y, under = length / 2, width / 2, height - top
    seat = slab("top", (-x, -y, under), (x, y, height), lambda a, b: rounded(a, b, (radius,) * 4, *holes))
    leg = (
        _waisted(rng)
        if chance(rng, 0.4)
        else partial(_arched_leg, foot=between(rng, 30, 60), rise=between(rng, 25, 70))
    )
    legs = [_panel_leg(f"leg_{n}", s * (x - inset), t, under, depth, leg) for n, s in (("left", -1), ("right", 1))]
    inner = x - inset - t
    high, tall = between(rng, 0.4 * under, 0.55 * under), min(between(rng, 50, 90), round(0.4 * under))
    thin = stock(rng, 15, 22)
    return [seat, *legs, slab("stretcher", (-inner, -thin / 2, high), (inner, thin / 2, high + tall))]


def _panel_leg(name: str, outer: float, t: float, tall: float, depth: float, path) -> Board:
    """A panel that stands with its outer sheet at x = outer; the path's x runs up from the floor."""
    low = outer if outer < 0 else outer - t
    x_axis, y_axis = np.array([0, 0, 1.0]), np.array([0, -1.0, 0])  # z cross -y = +x
    return board(name, (low, depth / 2, 0), x_axis, y_axis, t, path(tall, depth))


def _arched_leg(length: float, width: float, foot: float, rise: float) -> CutPath:
    return arched(length, width, min(foot, width / 3), min(rise, length / 3))


def _waisted(rng: np.random.Generator):
    """A leg with curved sides, narrower in the middle, and an arch between its feet."""
    waist, foot = between(rng, 15, 30), between(rng, 40, 55)
    rise = between(rng, 30, 60)

    def path(length: float, width: float) -> CutPath:
        third = length / 3
        pen = Pen((0, 0)).bezier((third, waist * 1.3), (2 * third, waist * 1.3), (length, 0)).line((length, width))
        pen.bezier((2 * third, width - waist * 1.3), (third, width - waist * 1.3), (0, width)).line((0, width - foot))
        return CutPath(outer=pen.arc((rise, width / 2), (0, foot)).close())

    return path


def tilted_stool(rng: np.random.Generator) -> list[Board]:
    """Legs that lean outward, bevelled at top and floor, and a stretcher that follows their slope."""
    lean = np.radians(rng.uniform(6, 18))
    length, width, height = between(rng, 340, 520), between(rng, 220, 320), between(rng, 280, 460)
    t, top = stock(rng, 15, 22), stock(rng, 15, 25)
    depth, inner, under = width - between(rng, 20, 60), between(rng, 95, 130), height - top
    seat = slab("top", (-length / 2, -width / 2, under), (length / 2, width / 2, height))
    up = np.array([0, 0, 1.0])
    cuts = [(up * under, up), (up * 0, -up)]
    legs = []
    for name, side in (("left", -1), ("right", 1)):
        down = np.array([side * np.sin(lean), 0, -np.cos(lean)])
        out = np.array([side * np.cos(lean), 0, np.sin(lean)])  # of the outer sheet
        y_axis = np.cross(out, -down)
        start = np.array([side * inner, 0, under]) - y_axis * depth / 2
        legs.append(trimmed(f"leg_{name}", start, -down, y_axis, t, depth, cuts))
    thin, low, tall = stock(rng, 12, 20), between(rng, 0.4, 0.6) + round(under * 0.45), between(rng, 45, 80)
    reach = [inner + np.tan(lean) * (under - z) for z in (low, low + tall)]
    flat = [(0, 0), (2 * reach[0], 0), (reach[0] + reach[1], tall), (reach[0] - reach[1], tall)]
    return [seat, *legs, board("stretcher", (-reach[0], thin / 2, low), (1, 0, 0), (0, 0, 1), thin, polygon(flat))]


def bench(rng: np.random.Generator) -> list[Board]:
    """A slatted bench: equal slats 20 mm apart on panel legs, with one stretcher or two."""
    slats, gap = int(rng.integers(3, 8)), 20.0
    wide, t, slat = between(rng, 40, 80), stock(rng, 18, 30), stock(rng, 15, 25)
    length, height = between(rng, 500, 1300), between(rng, 300, 460)
    depth = slats * wide + (slats - 1) * gap
    under, inset = height - slat, between(rng, 20, 90)
    leg = partial(_arched_leg, foot=between(rng, 35, 60), rise=between(rng, 30, 90))
    x, y = length / 2, depth / 2
    boards = [_panel_leg(f"leg_{n}", s * (x - inset), t, under, depth, leg) for n, s in (("left", -1), ("right", 1))]
    for k in range(slats):
        low = -y + k * (wide + gap)
        boards.append(slab(f"slat_{k}", (-x, low, under), (x, low + wide, height)))
    inner, thin, tall = x - inset - t, stock(rng, 18, 25), between(rng, 60, 100)
    places = (-0.25 * depth, 0.25 * depth) if chance(rng, 0.5) else (0.0,)
    for k, at in enumerate(places):
        boards.append(slab(f"stretcher_{k}", (-inner, at - thin / 2, under - tall), (inner, at + thin / 2, under)))
    return boards


def table(rng: np.random.Generator) -> list[Board]:
    """Four board legs, long aprons between their sheets, short ones between or behind their edges, a top."""
    length, width, height = between(rng, 420, 1100), between(rng, 300, 600), between(rng, 300, 740)
    t, top, apron = stock(rng, 20, 30), stock(rng, 15, 25), stock(rng, 15, 22)
    wide, tall = between(rng, 50, 80), between(rng, 60, 100)
    over, under = between(rng, 10, 50), height - top
    x, y = length / 2 - over, width / 2 - over
    radius = between(rng, 10, 50) * chance(rng, 0.5)
    boards = [
        slab(
            "top",
            (-x - over, -y - over, under),
            (x + over, y + over, height),
            lambda a, b: rounded(a, b, (radius,) * 4),
        )
    ]
    for name, sx, sy in (("fl", -1, -1), ("fr", 1, -1), ("bl", -1, 1), ("br", 1, 1)):
        (x0, x1), (y0, y1) = sorted((sx * x, sx * (x - t))), sorted((sy * y, sy * (y - wide)))
        boards.append(slab(f"leg_{name}", (x0, y0, 0), (x1, y1, under)))
    for name, side in (("front", -1), ("back", 1)):
        setback = between(rng, 5, wide - apron - 5)
        y0, y1 = sorted((side * (y - setback), side * (y - setback - apron)))
        boards.append(slab(f"apron_{name}", (-x + t, y0, under - tall), (x - t, y1, under)))
    return boards + _short_aprons(rng, x, y, t, wide, under, tall)


def _short_aprons(rng, x: float, y: float, t: float, wide: float, under: float, tall: float) -> list[Board]:
    """Between the legs' edges (cut on cut)."""
    thin = min(t, stock(rng, 15, 20))
    out = []
    for name, side in (("left", -1), ("right", 1)):
        setback = between(rng, 0, t - thin)
        x0, x1 = sorted((side * (x - setback), side * (x - setback - thin)))
        out.append(slab(f"apron_{name}", (x0, -y + wide, under - tall), (x1, y - wide, under)))
    return out
