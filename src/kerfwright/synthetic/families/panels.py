"""Boards glued edge to edge, and single boards: what tells a seam from grain, knots and shadows."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from kerfwright.model import Board
from kerfwright.synthetic.carpentry import slab
from kerfwright.synthetic.families._draw import between, chance, stock

__all__ = ["panel", "single"]


def panel(rng: np.random.Generator, boards: int | None = None) -> list[Board]:
    """Two to four boards glued side by side, on two battens that hold them (sheet on sheet)."""
    count = int(rng.integers(2, 5)) if boards is None else boards
    length, t = between(rng, 350, 800), stock(rng, 12, 25)
    widths = [between(rng, 70, 160) for _ in range(count)]
    tall, thick = between(rng, 40, 90), stock(rng, 18, 28)
    edges = np.concatenate([[0], np.cumsum(widths)]) - sum(widths) / 2
    x, y = length / 2, sum(widths) / 2
    flat = chance(rng, 0.5)  # battens laid flat touch sheet on sheet; on edge they touch cut on sheet
    high, wide = (thick, tall) if flat else (tall, thick)
    at, short = round(rng.uniform(0.55, 0.75) * x), min(8.0, y / 4)
    out = [slab(f"panel_{k}", (-x, a, high), (x, b, high + t)) for k, (a, b) in enumerate(pairwise(edges))]
    for name, side in (("batten_left", -1), ("batten_right", 1)):
        out.append(slab(name, (side * at - wide / 2, -y + short, 0), (side * at + wide / 2, y - short, high)))
    return out


def single(rng: np.random.Generator) -> list[Board]:
    """One board on two battens: nothing to split, whatever its grain."""
    length, width, t = between(rng, 350, 700), between(rng, 150, 320), stock(rng, 12, 25)
    tall, thick = between(rng, 40, 70), stock(rng, 18, 28)
    x, y = length / 2, width / 2
    out = [slab("panel_0", (-x, -y, tall), (x, y, tall + t))]
    for name, side in (("batten_left", -1), ("batten_right", 1)):
        at = side * round(0.6 * x)
        out.append(slab(name, (at - thick / 2, -y + 5, 0), (at + thick / 2, y - 5, tall)))
    return out
