"""Wood behind the ends of boards that stand on a face."""

import pytest
from shapely.geometry import box

from clouds import pose, sheet
from kerfwright.identify.covered import backed_by_ends
from kerfwright.identify.options import WholeOptions

UPRIGHT = pose((0, 0, 0), (1, 0, 0), (0, 0, 1))  # its normal is -y
NOTCHED = box(0, 0, 300, 200).difference(box(140, 0, 160, 60))


def frame_and_foot(region=NOTCHED, start=0.0, length=80.0):
    """An upright board with a notch in which the cloud lost it, and a foot that ends there, on its face at y = 0."""
    board = sheet("board", pose((0, 20, 0), (1, 0, 0), (0, 0, 1)), 20, region)
    foot = sheet("foot", pose((140, 0, 0), (0, 1, 0), (0, 0, 1)), 20, (start - length, 0, start, 60))
    return board, foot


def areas(*boards):
    return [s.region.area for s in backed_by_ends(boards, 500, WholeOptions())]


def test_the_place_behind_a_foot_is_wood():
    board, foot = frame_and_foot()
    assert areas(board, foot) == [pytest.approx(300 * 200, rel=1e-3), pytest.approx(80 * 60)]


def test_a_board_that_goes_right_through_keeps_its_notch():
    board, foot = frame_and_foot(start=100.0, length=180.0)
    assert areas(board, foot)[0] == pytest.approx(NOTCHED.area)


def test_a_foot_beside_the_board_adds_nothing():
    board, foot = frame_and_foot(region=box(0, 0, 138, 200))
    assert areas(board, foot)[0] == pytest.approx(138 * 200)


def test_a_foot_that_stays_away_adds_nothing():
    board, foot = frame_and_foot(start=-30.0)
    assert areas(board, foot)[0] == pytest.approx(NOTCHED.area)
