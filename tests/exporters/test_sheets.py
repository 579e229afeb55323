"""Boards on sheets: nothing overlaps, everything is there, few sheets, the same every time."""

import json
import math
from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace

import ezdxf
import numpy as np
import pytest
import shapely
from shapely import affinity

from kerfwright.errors import ExportError, OptionError
from kerfwright.model import Model
from kerfwright.model.geometry import path_area, sample_loop
from kerfwright_exporters import ExportOptions, nesting
from kerfwright_exporters._separation import separate
from kerfwright_exporters.convex import convex_parts
from kerfwright_exporters.dimensions import laid_polygon, sheet_dimensions
from kerfwright_exporters.drawing import upright
from kerfwright_exporters.nesting import NestOptions, nest
from kerfwright_exporters.pdf import label_room
from kerfwright_exporters.sheets import export, lay_sheets
from simple import bevel, board, hole, polygon, rectangle, stool


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
    options = NestOptions(1500, 800, 6.0, layouts=20, coarse=100, fine=200, moves=60)
    places = nest(shapes, options)
    room = shapely.box(-1e-6, -1e-6, 1500 + 1e-6, 800 + 1e-6)
    put = laid(shapes, places)
    assert all(room.covers(p) for p in put)
    for a, b in combinations(range(count), 2):
        assert places[a].sheet != places[b].sheet or put[a].distance(put[b]) >= 6.0 - 1e-6
    least = math.ceil(sum(s.area for s in shapes) / (1500 * 800))
    assert max(p.sheet for p in places) + 1 <= least + 1
    assert nest(shapes, options) == places


@pytest.mark.parametrize("seed", [1, 2])
def test_moving_boards_tightens_the_first_layout(seed):
    shapes = outlines(16, seed)
    options = NestOptions(4000, 800, 6.0, layouts=20, coarse=100, fine=200, moves=150)
    first, tight = (laid(shapes, nest(shapes, replace(options, moves=moves))) for moves in (0, 150))
    ends = [max(board.bounds[2] for board in found) for found in (first, tight)]
    assert ends[1] < 0.98 * ends[0]
    assert min(a.distance(b) for a, b in combinations(tight, 2)) >= 6 - 1e-6


def test_few_boards_are_left_as_they_are_before_the_moves_are_used_up(monkeypatch):
    left = []

    def counted(*arguments):
        done, moves = separate(*arguments)
        left.append(moves)
        return done, moves

    monkeypatch.setattr(nesting, "separate", counted)
    nest(outlines(4, 1), NestOptions(2000, 800, 6.0, layouts=5, coarse=60, fine=100, moves=5000))
    assert 0 < left[-1] < left[0]


def test_a_sheet_that_is_not_needed_is_saved():
    """Four triangles of which each pair makes a square, in the order that leaves most room between them."""
    triangle = shapely.Polygon([(0, 0), (300, 0), (0, 300)])
    places = nest([triangle] * 4, NestOptions(640, 320, 6.0, layouts=1, moves=500))
    assert {place.sheet for place in places} == {0}


def test_a_sheet_is_saved_at_a_later_attempt():
    options = NestOptions(900, 435, 6.0, (0, 180), layouts=5, coarse=60, fine=100, moves=1500)
    assert max(place.sheet for place in nest(outlines(12, 5), options)) == 1


def test_parts_are_convex_and_make_up_the_whole():
    plate = shapely.Polygon(
        [(0, 0), (300, 0), (300, 100), (200, 100), (200, 60), (100, 60), (100, 200), (0, 200)],
        [[(20, 20), (20, 50), (60, 50), (60, 20)]],
    )
    parts = [shapely.Polygon(part) for part in convex_parts(plate)]
    assert all(part.exterior.is_ccw and part.equals(part.convex_hull) for part in parts)
    assert shapely.union_all(parts).symmetric_difference(plate).area < 1e-6
    assert sum(part.area for part in parts) == pytest.approx(plate.area) and len(parts) <= 8
    assert len(convex_parts(shapely.box(0, 0, 4, 2))) == 1


def test_small_boards_go_into_holes():
    frame = shapely.Polygon(shapely.box(0, 0, 500, 400).exterior, [shapely.box(50, 50, 450, 350).exterior])
    places = nest([frame, shapely.box(0, 0, 300, 200)], NestOptions(520, 420, 6.0, layouts=5, moves=50))
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


def test_dimension_lines_tell_sizes_and_lie_on_their_boards():
    boards = (board(rectangle(600, 400), "door"), board(rectangle(500, 30), "slat"))
    (sheet,) = lay_sheets(Model(boards=boards), ExportOptions())
    found = list(sheet_dimensions(sheet, 10.0, ExportOptions()))
    assert sorted(d.text for d in found) == ["1220.0 mm", "2440.0 mm", "400.0 mm", "600.0 mm"]  # the slat has a label
    outline = shapely.Polygon(sample_loop(next(b for b in sheet.boards if b.name == "door").drawing.cuts[0].loop))
    for d in found:
        if d.text in ("400.0 mm", "600.0 mm"):
            length = math.dist(d.start, d.end)
            assert f"{length:.1f} mm" == d.text
            assert outline.buffer(1e-6).covers(shapely.LineString([d.start, d.end]))
            assert outline.covers(shapely.Point(d.at).buffer(d.height / 2))


def test_figures_keep_off_labels_holes_and_the_angles_of_bevels():
    """A board with a hole in its middle and a bevel at one end: everything that is written on it stands on its own."""
    slanted = bevel((600, 0), (600, 300), 45.0)
    window = polygon([(200, 100), (200, 200), (400, 200), (400, 100)])
    model = Model(boards=(board(rectangle(600, 300), "door", holes=(window,), bevels=(slanted,)),))
    (sheet,) = lay_sheets(model, ExportOptions())
    (laid,) = sheet.boards
    figures = [d for d in sheet_dimensions(sheet, 10.0, ExportOptions()) if d.text in ("600.0 mm", "300.0 mm")]
    texts = [text_box(*f) for f in [(t.text, t.at, t.height, t.turn) for t in (*laid.drawing.texts, *figures)]]
    assert len(figures) == 2 and len(texts) == 4
    assert all(laid_polygon(laid).covers(text) for text in texts)
    assert not any(a.intersects(b) for a, b in combinations(texts, 2))


def text_box(text: str, at: tuple[float, float], height: float, turn: float) -> shapely.Polygon:
    """The room of a line of text in a common font, centred."""
    half = np.array([0.6 * len(text), 1.0]) * height / 2
    return affinity.rotate(shapely.box(*(at - half), *(at + half)), turn, use_radians=True)


@pytest.mark.parametrize("turn", [0.0, np.pi / 2])
def test_labels_of_the_pdf_stand_beside_holes(turn):
    frame = shapely.box(0, 0, 400, 500) - shapely.box(60, 60, 340, 440)
    at, height = label_room(frame, ["frame", "500.0 mm x 400.0 mm"], turn, 10)
    assert height >= 1.2 and frame.covers(text_box("500.0 mm x 400.0 mm", at, 10 * height, turn))


@pytest.mark.parametrize(("turn", "reads"), [(0, 0), (90, 90), (180, 0), (270, 90), (-45, -45), (135, -45)])
def test_text_is_never_upside_down(turn, reads):
    assert np.degrees(upright(np.radians(turn))) == pytest.approx(reads)


def test_dimensions_are_in_all_three_drawings(tmp_path):
    paths = {p.suffix: p for p in export(stool(), tmp_path, ExportOptions(units="in"))}
    texts = [t.dxf.text for t in ezdxf.readfile(paths[".dxf"]).modelspace().query('TEXT[layer=="DIMENSION"]')]
    assert '96 1/16"' in texts and '15 3/4"' in texts
    assert "96 1/16&quot;" in paths[".svg"].read_text() or '96 1/16"' in paths[".svg"].read_text()


def test_same_bytes_twice(tmp_path):
    first, second = (export(stool(), tmp_path / folder, ExportOptions()) for folder in "ab")
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]


def test_an_outline_that_crosses_itself_by_a_hair_is_measured_all_the_same():
    hair = [(0, 0), (50, 0), (50.02, -0.01), (50.01, 0.02), (49.99, -0.02), (100, 0), (100, 60), (0, 60)]
    cut = SimpleNamespace(operation="outside", loop=polygon(hair))
    assert not shapely.Polygon(hair).is_valid
    whole = laid_polygon(SimpleNamespace(drawing=SimpleNamespace(cuts=[cut])))
    assert whole.is_valid and whole.area == pytest.approx(6000, rel=1e-3)
