"""Pieces of one board that the cloud shows apart are joined, and only those."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from clouds import pose, sheet
from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.rags import pieced_together

BLIND = FreeSpace((), (), 1.0, 1.0)
OPTIONS = WholeOptions()
LEVEL = pose((0, 0, 200))


class Everywhere(FreeSpace):
    """Cameras that saw through every place."""

    def votes(self, x_in_world):
        return np.full(len(x_in_world), 3)


def face(x0, x1, step):
    """Points on the top of a board at z = 210 between x0 and x1."""
    grid = np.stack(np.meshgrid(np.arange(x0, x1, step), np.arange(1, 100, step)), axis=-1).reshape(-1, 2)
    return np.c_[grid, np.full(len(grid), 210.0)]


def shelf(gap=20.0, step=12.0, lift=0.0, thickness=10.0, lined=False):
    """Two pieces with a gap between them, seen badly, and a table top that was seen well."""
    points = [face(0, 150, step), face(150 + gap, 300, step), np.c_[face(0, 500, 4)[:, :2], np.full(125 * 25, 400.0)]]
    rim = np.array([[x, y, 205.0] for x in (150.0, 150 + gap) for y in np.arange(0, 100, 2.0)])[: None if lined else 0]
    cloud = Cloud(np.concatenate([*points, rim]), np.tile([0, 0, 1.0], (sum(map(len, points)) + len(rim), 1)))
    ends = np.cumsum([0, *map(len, points), len(rim)])
    idx = [np.arange(a, b) for a, b in pairwise(ends)]
    cut = {"cut_idx": idx[3]}
    one = sheet("one", LEVEL, 10.0, (0, 0, 150, 100), top_idx=idx[0], **cut)
    two = sheet("two", pose((0, 0, 200 + lift)), thickness, (150 + gap, 0, 300, 100), top_idx=idx[1], **cut)
    top = sheet("top", pose((0, 0, 390)), 10.0, (0, 0, 500, 100), top_idx=idx[2])
    return (one, two, top), cloud


def joined(sheets, cloud, free=BLIND):
    return pieced_together(sheets, cloud, free, OPTIONS)


def test_rags_of_a_dark_shelf_are_one_board():
    whole, top = joined(*shelf())
    assert (whole.name, top.name) == ("one", "top")
    assert whole.region.area == pytest.approx(300 * 100, rel=0.01)
    assert len(whole.top_idx) == sum(len(s.top_idx) for s in shelf()[0][:2])


@pytest.mark.parametrize("apart", [
    {"step": 4.0}, {"lift": 5.0}, {"thickness": 16.0}, {"lined": True}, {"gap": 120.0},
])  # fmt: skip
def test_boards_apart_stay_apart(apart):
    assert len(joined(*shelf(**apart))) == 3


def test_a_board_of_which_both_faces_are_seen_badly_is_seen_badly():
    (one, two, top), cloud = shelf(step=6.0)
    both = [replace(s, bottom_idx=s.top_idx) for s in (one, two)]  # each face shows too little for a gap to be real
    assert len(joined((*both, top), cloud)) == 2


def test_a_gap_that_was_seen_through_stays():
    sheets, cloud = shelf()
    assert len(joined(sheets, cloud, Everywhere((), (), 1.0, 1.0))) == 3


@pytest.mark.parametrize(("length", "joins"), [(40.0, True), (10.0, False)])
def test_a_divider_that_stands_in_the_gap_hides_the_wood_under_it(length, joins):
    sheets, cloud = shelf(gap=14.0, step=4.0)
    divider = sheet("divider", pose((152, 30, 210), (0, 1, 0), (0, 0, 1)), 10.0, (0, 0, length, 90))
    assert len(joined((*sheets, divider), cloud)) == (3 if joins else 4)


@pytest.mark.parametrize(("height", "count"), [(220.0, 4), (90.0, 3)])
def test_only_a_board_that_reaches_up_to_the_gap_parts_it(height, count):
    sheets, cloud = shelf()
    upright = sheet("upright", pose((152, 0, 100), (0, 1, 0), (0, 0, 1)), 16.0, (0, 0, 100, height))
    assert len(joined((*sheets, upright), cloud)) == count
