"""Two legs and the rail between them, level with each other, found as one region like a U."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from clouds import sheet
from kerfwright.assemble import concave
from kerfwright.assemble.concave import find_inner_seams, inner_corners
from kerfwright.assemble.splits import SeamSearch, find_seam_lines

U = box(0, 0, 360, 400).difference(box(90, -1, 270, 290))
D = 600.0


def wood(x, y):
    return 120 + 8 * np.sin((y + 6 * np.sin(x / 40) + 3 * np.sin(x / 17 + y / 9)) * 1.3)


def three_boards(x, y):
    return np.where((x > 90) & (x < 270), wood(x, y) * 0.92, wood(x + 500, y + 321))


def searched(shade, region: Polygon = U) -> SeamSearch:
    """Five cameras above whose pixels are the board's millimetres; shade (x, y) gives grey levels."""

    def colours(k, pixels):
        noise = np.random.default_rng(k).normal(0, 1.0, (*pixels.shape[:-1], 3))
        return (shade(pixels[..., 0], pixels[..., 1])[..., None] + noise).astype(np.float32)

    def visible(views, places, outward, grazing=0.2):
        return np.full((len(views), len(places)), outward[2] > 0)

    views = [
        SimpleNamespace(centre=np.array([180.0, 200 + 20 * k, 900.0]), project=lambda x: (x[:, :2], np.ones(len(x))))
        for k in range(5)
    ]
    photos, obstacles = SimpleNamespace(views=views, colours=colours), SimpleNamespace(visible=visible)
    board = replace(sheet("board", np.eye(4), 18.0, (0, 0, 1, 1)), region=region)
    return SeamSearch(board, [], photos, obstacles, D)


def test_inner_corners_are_those_at_which_the_wood_goes_on() -> None:
    found = inner_corners(U, D)
    assert sorted(map(tuple, found)) == [(90, 290), (270, 290)]
    assert not len(inner_corners(box(0, 0, 360, 400), D))
    notched = box(0, 0, 360, 400).difference(box(170, 385, 190, 401))
    assert not len(inner_corners(notched, D))


def test_inner_corner_lies_where_the_edges_meet_though_the_outline_cuts_it_off() -> None:
    cut_off = U.union(Polygon([(90, 290), (90, 280), (100, 290)])).union(Polygon([(270, 290), (270, 280), (260, 290)]))
    found = np.array(sorted(map(tuple, inner_corners(cut_off, D))))
    assert found == pytest.approx(np.array([(90, 290), (270, 290)]), abs=0.5)


def test_rail_that_one_leg_clearly_ends_is_ended_by_the_other_too(monkeypatch) -> None:
    seams = find_inner_seams(searched(three_boards))
    weaker, stronger = sorted(s.strength for s in seams)
    monkeypatch.setattr(concave, "LEAST_STRENGTH", (weaker + stronger) / 2)
    assert len(find_inner_seams(searched(three_boards))) == 2
    monkeypatch.setattr(concave, "LEAST_STRENGTH", stronger + 1)
    assert not find_inner_seams(searched(three_boards))


def test_rail_between_legs_is_cut_off_at_the_inner_corners() -> None:
    search = searched(three_boards)
    assert not find_seam_lines(search)
    seams = find_inner_seams(search)
    assert sorted(abs(s.offset) for s in seams) == [pytest.approx(x, abs=1.0) for x in (90, 270)]
    for seam in seams:
        assert sorted([seam.start[1], seam.end[1]]) == [pytest.approx(290, abs=1), pytest.approx(400, abs=1)]


def test_seam_lies_in_the_line_of_the_free_edge() -> None:
    def shaded(x, y):
        return three_boards(np.where(x < 180, x - 4, x), y)  # the photographs show the left one 4 mm off

    seams = find_inner_seams(searched(shaded))
    assert sorted(abs(s.offset) for s in seams) == [pytest.approx(x, abs=0.2) for x in (90, 270)]
    assert sorted(abs(s.start @ s.m) for s in seams) == [pytest.approx(x, abs=0.2) for x in (90, 270)]


def test_a_board_cut_out_of_one_piece_stays_whole() -> None:
    assert not find_inner_seams(searched(wood))


def test_two_rails_at_one_leg_are_left_whole_rather_than_one_thrown_away(monkeypatch) -> None:
    two_rails = box(0, 0, 90, 400).union(box(80, 290, 360, 400)).union(box(80, 0, 360, 110))
    assert not find_inner_seams(searched(three_boards, two_rails))
    monkeypatch.setattr(concave, "_parts_whole", lambda region, seams: True)
    assert find_inner_seams(searched(three_boards, two_rails))  # the seam is there to be found
