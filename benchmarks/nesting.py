"""How tightly boards are nested: two fixed sets, on one endless strip against spyrrow, and on sheets.

    python benchmarks/nesting.py [--seconds 20] [--seeds 3]

spyrrow gets the same boards, spacing and turns, one thread, and so many seconds by the clock, of which a loaded
processor gives it fewer; kerfwright itself does not need it: pip install spyrrow. Sheets are counted against the area
of the boards over the usable area of a sheet, rounded up.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import shapely
from shapely import affinity
from tables import markdown

from kerfwright_exporters.nesting import NestOptions, Place, nest

WIDTH, SPACING, ENDLESS = 1208.0, 6.0, 4000.0
SHEET = (1200.0, 590.0)  # what a sheet of 1220 x 610 leaves inside a margin of 10: small, so that several are needed
TURNS = ((0, 180), (0, 90, 180, 270))


def main() -> None:
    """Print two tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=20, help="that spyrrow may take for a strip")
    parser.add_argument("--seeds", type=int, default=3, help="runs of both, each with another seed")
    arguments = parser.parse_args()
    nest(list(_angles())[:4], NestOptions(*SHEET, SPACING, moves=10))  # compiles
    strips = [
        _strip(name, boards, turns, arguments.seconds, arguments.seeds) for name, boards in _sets() for turns in TURNS
    ]
    head = ["set", "turns", "kerfwright", "processor seconds", "least distance, mm"]
    head += [f"spyrrow, {arguments.seconds} s", "processor seconds"]
    print(markdown(head, strips))
    print(
        markdown(
            ["set", "turns", "sheets", "area / usable", "processor seconds"],
            [_sheets(*s, t) for s in _sets() for t in TURNS],
        )
    )


def _sets() -> list[tuple[str, list[shapely.Polygon]]]:
    return [("30 with curves", list(_curves())), ("40 with angles", list(_angles()))]


def _curves():
    """Rectangles, boards with a wavy edge, angles, and boards with a hollow foot."""
    rng = np.random.default_rng(3)
    for k in range(30):
        a, b = rng.uniform(150, 700), rng.uniform(40, 260)
        wave = _bezier((a, 0.6 * b), (0.7 * a, 1.3 * b), (0.3 * a, 0.1 * b), (0, b))
        hollow = _bezier((0.05 * a, 0), (0.3 * a, 0.5 * b), (0.7 * a, 0.5 * b), (0.95 * a, 0))
        yield shapely.Polygon((
            [(0, 0), (a, 0), (a, b), (0, b)],
            [(0, 0), (a, 0), (a, 0.6 * b), *wave],
            [(0, 0), (a, 0), (a, 0.4 * b), (0.4 * a, 0.4 * b), (0.4 * a, b), (0, b)],
            [(0, 0), *hollow, (a, 0), (0.85 * a, b), (0.15 * a, b)],
        )[k % 4])  # fmt: skip


def _bezier(*controls: tuple[float, float]) -> list[tuple[float, float]]:
    t = np.linspace(0, 1, 12)[:, None]
    p, q, r, s = np.array(controls)
    return [tuple(x) for x in (1 - t) ** 3 * p + 3 * (1 - t) ** 2 * t * q + 3 * (1 - t) * t**2 * r + t**3 * s]


def _angles():
    """Rectangles, angles and tapered boards."""
    rng = np.random.default_rng(2)
    for k in range(40):
        a, b = rng.uniform(150, 700), rng.uniform(40, 260)
        yield shapely.Polygon((
            [(0, 0), (a, 0), (a, b), (0, b)],
            [(0, 0), (a, 0), (a, b * 0.4), (a * 0.4, b * 0.4), (a * 0.4, b), (0, b)],
            [(0, 0), (a, 0), (a * 0.85, b), (a * 0.15, b)],
        )[k % 3])  # fmt: skip


def _strip(name: str, boards: list, turns: Sequence[int], seconds: int, seeds: int) -> list[str]:
    area = sum(board.area for board in boards)
    ours, theirs, least, took, spent = [], [], math.inf, [], []
    for seed in range(seeds):
        start = time.process_time()
        places = nest(boards, NestOptions(ENDLESS, WIDTH, SPACING, tuple(turns), seed=seed))
        took.append(time.process_time() - start)
        laid = _laid(boards, places)
        ours.append(area / WIDTH / max(board.bounds[2] for board in laid))
        least = min(least, *(a.distance(b) for a, b in combinations(laid, 2)))
        start = time.process_time()
        theirs.append(_spyrrow(boards, turns, seconds, seed))
        spent.append(time.process_time() - start)
    columns = [" ".join(form.format(x) for x in found) for found, form in (
        (ours, "{:.3f}"), (took, "{:.0f}"), ([least], "{:.4f}"), (theirs, "{:.3f}"), (spent, "{:.0f}")
    )]  # fmt: skip
    return [name, str(len(turns)), *columns]


def _spyrrow(boards: list, turns: Sequence[int], seconds: int, seed: int) -> float:
    import spyrrow

    items = [spyrrow.Item(str(k), list(board.exterior.coords)[:-1], 1, list(turns)) for k, board in enumerate(boards)]
    config = spyrrow.StripPackingConfig(
        total_computation_time=seconds, num_workers=1, seed=seed, min_items_separation=SPACING
    )
    return spyrrow.StripPackingInstance("strip", WIDTH, items).solve(config).density


def _sheets(name: str, boards: list, turns: Sequence[int]) -> list[str]:
    start = time.process_time()
    places = nest(boards, NestOptions(*SHEET, SPACING, tuple(turns)))
    seconds = time.process_time() - start
    laid = _laid(boards, places)
    for (a, p), (b, q) in combinations(zip(laid, places, strict=True), 2):
        assert p.sheet != q.sheet or a.distance(b) >= SPACING - 1e-6
    used = max(place.sheet for place in places) + 1
    return [name, str(len(turns)), str(used), f"{sum(b.area for b in boards) / math.prod(SHEET):.2f}", f"{seconds:.0f}"]


def _laid(boards: list, places: list[Place]) -> list:
    return [
        affinity.translate(affinity.rotate(board, place.turn, origin=(0, 0)), *place.shift)
        for board, place in zip(boards, places, strict=True)
    ]


if __name__ == "__main__":
    main()
