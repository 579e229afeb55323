"""Two boards that cross: their ends show which of them runs through."""

import numpy as np
import pytest
from shapely.geometry import box

from clouds import pose, sheet
from kerfwright.capture.types import Cloud
from kerfwright.identify.crossings import crossings_settled
from painted import Painted, nothing_hides

SIZE = 400.0
NONE = Cloud(np.zeros((0, 3)), np.zeros((0, 3)))
# seen from above: ends at z = 100, one board along x (y from -6 to 6), the other one along y (x from -6 to 6)
ALONG_X = pose((0, 6, 0), (1, 0, 0), (0, 0, 1))  # its normal is -y
ALONG_Y = pose((-6, 0, 0), (0, 1, 0), (0, 0, 1))  # its normal is +x


def crossing(top=100.0):
    """The board along x whole, the other one in two pieces."""
    whole = sheet("whole", ALONG_X, 12.0, (-200, 0, 200, top))
    pieces = [sheet(n, ALONG_Y, 12.0, (y, 0, y + 194, 100)) for n, y in (("before", -200.0), ("after", 6.0))]
    return whole, *pieces


def joints_along(axis):
    """Dark joints on the ends: along x when the board along x runs through."""
    def tone(x, y):
        across, along = (y, x) if axis == "x" else (x, y)
        return np.where((np.abs(np.abs(across) - 6) < 0.8) & (np.abs(along) < 6), 90.0, 150.0)
    return tone


def settled(sheets, tone):
    cloud = Cloud(np.array([[0.0, 0, 0], [SIZE, 0, 0]]), np.zeros((2, 3)))
    return {s.name: s for s in crossings_settled(sheets, cloud, Painted(tone), nothing_hides())}


def test_the_board_whose_faces_the_joints_follow_stays_whole():
    sheets = crossing()
    assert all(a is b for a, b in zip(sheets, settled(sheets, joints_along("x")).values(), strict=True))


def test_else_the_other_one_runs_through():
    found = settled(crossing(), joints_along("y"))
    assert found["before"].region.symmetric_difference(box(-200, 0, 200, 100)).area < 1
    assert found["before"].normal == pytest.approx((1, 0, 0))
    ends = {n: np.ravel(found[n].region.bounds) for n in ("whole", "after")}
    assert sorted(map(tuple, ends.values())) == [(-200, 0, -6, 100), (6, 0, 200, 100)]
    assert all(found[n].normal == pytest.approx((0, -1, 0)) for n in ("whole", "after"))


@pytest.mark.parametrize("tone", [lambda x, y: 150.0 + 0 * x])
def test_without_joints_nothing_changes(tone):
    sheets = crossing()
    assert all(a is b for a, b in zip(sheets, settled(sheets, tone).values(), strict=True))


def test_ends_that_are_not_flush_tell_nothing():
    sheets = crossing(top=140.0)
    found = settled(sheets, joints_along("y"))
    assert all(a is b for a, b in zip(sheets, found.values(), strict=True))


def test_a_board_in_three_pieces_becomes_one_through_both_that_it_crosses():
    """The first exchange makes other boards of three names; the second crossing is among what it made."""
    along_x = [pose((0, y + 6, 0), (1, 0, 0), (0, 0, 1)) for y in (0, 100)]
    wholes = [sheet(f"whole_{k}", frame, 12.0, (-200, 0, 200, 100)) for k, frame in enumerate(along_x)]
    spans = ((-200.0, -6.0), (6.0, 94.0), (106.0, 200.0))
    pieces = [sheet(f"piece_{k}", ALONG_Y, 12.0, (a, 0, b, 100)) for k, (a, b) in enumerate(spans)]

    def tone(x, y):
        joints = (np.abs(np.abs(x) - 6) < 0.8) & ((np.abs(y) < 6) | (np.abs(y - 100) < 6))
        return np.where(joints, 90.0, 150.0)

    found = settled([*wholes, *pieces], tone)
    along_y = [s for s in found.values() if abs(s.normal[0]) > 0.9]
    assert [s.region.symmetric_difference(box(-200, 0, 200, 100)).area < 1 for s in along_y] == [True]
    halves = sorted(tuple(np.round(s.region.bounds)) for s in found.values() if abs(s.normal[1]) > 0.9)
    assert halves == [(-200, 0, -6, 100), (-200, 0, -6, 100), (6, 0, 200, 100), (6, 0, 200, 100)]
