"""Boards on sheets: nothing overlaps, everything is there, few sheets, the same every time."""

import json
import math
from itertools import combinations

import ezdxf
import numpy as np
import pytest
import shapely
from shapely import affinity

from kerfwright.errors import ExportError, OptionError
from kerfwright.model import Model
from kerfwright.model.geometry import path_area, sample_loop
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.nesting import NestOptions, nest
from kerfwright_exporters.sheets import export, lay_sheets
from simple import board, hole, polygon, rectangle, stool


def outlines(count: int, seed: int) -> list[shapely.Polygon]:
    """A fixed set of rectangles, angles and tapered boards."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(count):
        a, b = rng.uniform(150, 700), rng.uniform(40, 260)
        shapes = (
            [(0, 0), (a, 0), (a, b), (0, b)],
            [(0, 0), (a, 0), (a, b * 0.4), (a * 0.4, b * 0.4), (a * 0.4, b), (0, b)],
            [(0, 0), (a, 0), (a * 0.85, b), (a * 0.15, b)],
        )
        found.append(shapely.Polygon(shapes[k % 3]))
    return found


def laid(shapes, places):
    return [
        affinity.translate(affinity.rotate(s, p.turn, origin=(0, 0)), *p.shift)
        for s, p in zip(shapes, places, strict=True)
    ]


@pytest.mark.parametrize(("count", "seed"), [(24, 1), (40, 2)])
def test_boards_keep_their_distance_on_few_sheets(count, seed):
    shapes = outlines(count, seed)
    options = NestOptions(1500, 800, 6.0, layouts=20, finalists=3, coarse=100, fine=200)
    places = nest(shapes, options)
    room = shapely.box(-1e-6, -1e-6, 1500 + 1e-6, 800 + 1e-6)
    put = laid(shapes, places)
    assert all(room.covers(p) for p in put)
    for a, b in combinations(range(count), 2):
        assert places[a].sheet != places[b].sheet or put[a].distance(put[b]) >= 6.0 - 1e-6
    least = math.ceil(sum(s.area for s in shapes) / (1500 * 800))
    assert max(p.sheet for p in places) + 1 <= least + 1
    assert nest(shapes, options) == places


def test_small_boards_go_into_holes():
    frame = shapely.Polygon(shapely.box(0, 0, 500, 400).exterior, [shapely.box(50, 50, 450, 350).exterior])
    places = nest([frame, shapely.box(0, 0, 300, 200)], NestOptions(520, 420, 6.0, layouts=5))
    assert [p.sheet for p in places] == [0, 0]
    put = laid([frame, shapely.box(0, 0, 300, 200)], places)
    assert put[0].distance(put[1]) >= 6 - 1e-6


def test_exact_fits_fit_and_too_large_ones_are_named():
    places = nest([shapely.box(0, 0, 500, 300)], NestOptions(500, 300, 6.0))
    assert places[0].shift == pytest.approx((0, 0), abs=1e-6)
    assert nest([shapely.box(0, 0, 300, 500)], NestOptions(500, 300, 6.0))[0].turn in (90, 270)
    with pytest.raises(ExportError, match=r"board 'door': sheets: does not fit 980 x 480 mm"):
        lay_sheets(
            Model(boards=(board(rectangle(990, 300), "door"),)), ExportOptions(sheet_length=1000, sheet_width=500)
        )
    with pytest.raises(OptionError, match="sheet_width"):
        ExportOptions(sheet_width=15)


def test_grain_allows_half_turns_only():
    boards = tuple(board(rectangle(400, 100), f"slat {k}") for k in range(3))
    options = ExportOptions(sheet_length=500, sheet_width=520, grain=True)
    (sheet,) = lay_sheets(Model(boards=boards), options)
    for one in sheet.boards:
        width, height = np.ptp(sample_loop(one.drawing.cuts[0].loop), axis=0)
        assert width == pytest.approx(400) and height == pytest.approx(100)
    with pytest.raises(ExportError, match="does not fit"):
        lay_sheets(Model(boards=(board(rectangle(100, 510), "tall"),)), options)


def test_files_by_stock_with_exact_outlines(tmp_path):
    round_hole = (hole(50, 40, 12),)
    thin = board(rectangle(200, 120), "back", 6.0, holes=round_hole)
    wedge = board(polygon([(0, 0), (300, 0), (200, 150), (0, 150)]), "wedge", 18.02)
    model = Model(name="set", boards=(*stool().boards, thin, wedge))
    paths = export(model, tmp_path, ExportOptions())
    assert [p.relative_to(tmp_path).as_posix() for p in paths] == [
        "sheets/18.0mm-1.dxf", "sheets/18.0mm-1.svg", "sheets/6.0mm-1.dxf", "sheets/6.0mm-1.svg", "sheets/sheets.pdf",
        "sheets/sheets.json",
    ]  # fmt: skip
    document = ezdxf.readfile(paths[0])
    assert not document.audit().has_errors
    lines = document.modelspace().query('LWPOLYLINE[layer=="OUTSIDE"]')
    areas = sorted(shapely.Polygon(line.get_points("xy")).area for line in lines)
    assert areas == pytest.approx(sorted(path_area(b.cut_path) for b in model.boards if b.name != "back"), rel=1e-9)
    (circle,) = ezdxf.readfile(paths[2]).modelspace().query("CIRCLE")
    assert circle.dxf.radius == 12
    summary = json.loads(paths[-1].read_text())
    assert summary["sheets"][1]["utilisation"] == pytest.approx((200 * 120 - np.pi * 144) / (2440 * 1220), abs=1e-4)
    assert paths[-2].read_bytes().startswith(b"%PDF-1.") and paths[-2].read_bytes().rstrip().endswith(b"%%EOF")


def test_same_bytes_twice(tmp_path):
    first, second = (export(stool(), tmp_path / folder, ExportOptions()) for folder in "ab")
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]
