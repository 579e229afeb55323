"""Identification as a whole, on clouds without photographs; clouds that it cannot use end in a clear error."""

import numpy as np
import pytest

from clouds import box_cloud, cloud_only, shelf_parts, with_flipped
from kerfwright.capture.types import Cloud
from kerfwright.errors import StageError
from kerfwright.identify import identify

BOARD = ((-150, -100, 0), (150, 100, 20))
TABLE = (
    ((-150, -100, 200), (150, 100, 218)),
    ((-120, -80, 0), (-102, 80, 200)),
    ((102, -80, 0), (120, 80, 200)),
)


def sheets_of(cloud: Cloud):
    return identify(cloud_only(cloud)).sheets


def only(cloud: Cloud, keep: np.ndarray) -> Cloud:
    return cloud.select(keep)


def stacked(cloud: Cloud, *heights: float) -> Cloud:
    points = [cloud.points + np.array([0, 0, h]) for h in heights]
    return Cloud(np.concatenate(points), np.tile(cloud.normals, (len(heights), 1)))


@pytest.fixture(scope="module")
def board():
    return box_cloud(BOARD, spacing=3.5)


@pytest.fixture(scope="module")
def table():
    return box_cloud(*TABLE, spacing=4.0)


@pytest.fixture(scope="module")
def found(table):
    return identify(cloud_only(table))


def assert_is_table(sheets):
    assert [round(s.thickness.value) for s in sheets] == [18, 18, 18]
    assert abs(sheets[0].normal[2]) > 0.999
    assert [abs(s.normal[0]) > 0.999 for s in sheets[1:]] == [True, True]
    assert [s.region.area for s in sheets] == pytest.approx([60000, 32000, 32000], rel=0.05)  # a row of cells is 4 %


def test_one_board(board):
    (sheet,) = sheets_of(board)
    assert sheet.thickness.value == pytest.approx(20, abs=0.1)
    assert sheet.region.area == pytest.approx(60000, rel=0.01)


def test_three_boards_largest_first(found):
    assert_is_table(found.sheets)
    assert [s.name for s in found.sheets] == ["board_01", "board_02", "board_03"]


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_changes_only_the_scale(board, scale):
    (plain,), (scaled,) = sheets_of(board), sheets_of(Cloud(board.points * scale, board.normals))
    assert scaled.thickness.value == pytest.approx(scale * plain.thickness.value, rel=1e-6)
    assert scaled.region.area == pytest.approx(scale**2 * plain.region.area, rel=1e-3)


def test_ten_kilometres_from_the_origin(board):
    (sheet,) = sheets_of(Cloud(board.points + 1e7, board.normals))
    assert sheet.thickness.value == pytest.approx(20, abs=0.1)


def test_flipped_normals(table):
    assert_is_table(sheets_of(with_flipped(table, 0.1)))


def test_normals_at_random(table):
    wrong = np.random.default_rng(1).random(len(table)) < 0.1
    normals = np.where(wrong[:, None], ball(len(table)).normals, table.normals)
    assert_is_table(sheets_of(Cloud(table.points, normals)))


def test_strays_of_five_percent(table):
    rng = np.random.default_rng(4)
    count = len(table) // 20
    points = rng.uniform([-160, -110, -10], [160, 110, 230], (count, 3))
    normals = rng.standard_normal((count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    strayed = Cloud(np.concatenate([table.points, points]), np.concatenate([table.normals, normals]))
    assert_is_table(sheets_of(strayed))


def test_two_objects_apart():
    sheets = sheets_of(box_cloud(BOARD, ((300, -100, 0), (500, 100, 20)), spacing=4.0))
    assert [round(s.region.area, -3) for s in sheets] == [60000, 40000]


def test_parallel_planes_are_boards_where_they_face_apart(board):
    """Top and bottom alone: the opposite plane is evidence enough; the air between two boards is none."""
    faces = only(board, np.abs(board.normals[:, 2]) > 0.5)
    sheets = sheets_of(stacked(faces, 0, 60))
    assert [round(s.thickness.value, 1) for s in sheets] == [20.0, 20.0]


def ball(count: int = 20000) -> Cloud:
    normals = np.random.default_rng(0).standard_normal((count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Cloud(150 * normals, normals)


BAD = {
    "one plane, from above, high over the floor": (
        lambda b: stacked(only(b, b.normals[:, 2] > 0.5), 300), "no plane has a thickness",
    ),
    "a ball": (lambda b: ball(), "no plane has a thickness"),
    "a cube, thin in no direction": (
        lambda b: box_cloud(((-100, -100, 0), (100, 100, 200)), spacing=5.0), "no plane has a thickness",
    ),
    "normals at random": (lambda b: Cloud(b.points, ball().normals[: len(b)]), "no plane found"),
    "no normals": (lambda b: Cloud(b.points, 0 * b.normals), "no plane found"),
    "one place": (lambda b: Cloud(0 * b.points, b.normals), "no plane found"),
    "a handful of points": (lambda b: b.select(np.arange(30)), "points: 30"),
}


@pytest.mark.parametrize("case", BAD)
def test_clouds_without_boards_are_refused_with_a_reason(board, case):
    make, message = BAD[case]
    with pytest.raises(StageError, match=message):
        sheets_of(make(board))


def test_same_cloud_gives_the_same_bytes(table, found):
    first, second = found.sheets, sheets_of(table)
    assert [s.world_from_board.tobytes() + s.region.wkb for s in first] == [
        s.world_from_board.tobytes() + s.region.wkb for s in second
    ]


def test_figures_say_how_the_selection_went(found):
    figures = found.selection
    assert figures["chosen"] == 3
    assert figures["bound"] == pytest.approx(figures["objective"])
    assert figures["explained"] > 0.9


def test_photographed_shelf_is_found_whole():
    parts = shelf_parts()
    assert [round(s.thickness.value, 0) for s in parts.sheets] == [18, 15, 15]
    assert [s.region.area for s in parts.sheets] == pytest.approx([54000, 32000, 32000], rel=0.2)


def test_what_boards_do_not_explain_is_told(table):
    round_thing = ball()
    points = np.concatenate([table.points, round_thing.points + np.array([0, 0, 400])])
    both = Cloud(points, np.concatenate([table.normals, round_thing.normals]))
    assert identify(cloud_only(table)).notes == ()
    found = identify(cloud_only(both))
    assert len(found.sheets) >= 3
    (note,) = found.notes
    assert f"{100 * (1 - found.selection['explained']):.0f} %" in note and "unexplained" in note
