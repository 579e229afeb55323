"""Bars known by their two ends: found where the ends match, and only there."""

import numpy as np
import pytest

from clouds import box_cloud, cloud_only
from kerfwright.capture.types import Cloud
from kerfwright.identify import IdentifyOptions, identify
from kerfwright.identify.bars import find_bars
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.primitives import find_planes, look_around

OPTIONS = IdentifyOptions()
FRINGE = 12.0
SEAT = ((-220.0, -150.0, 410.0), (220.0, 150.0, 430.0))
LEGS = tuple(((-120.0, y, 0.0), (-60.0, y + 20, 380.0)) for y in (-130.0, 110.0))
RAIL = ((-120.0, -140.0, 380.0), (-60.0, 140.0, 410.0))


def only_ends(cloud: Cloud) -> Cloud:
    """The cloud without what shows of the rail's long sides: stereo loses them in the dark under the seat."""
    x = cloud.points
    along = (np.abs(x[:, 1]) < 139) & (x[:, 2] > 379) & (x[:, 2] < 411) & (np.abs(x[:, 0] + 90) < 31)
    return Cloud(x[~along], cloud.normals[~along])


def bars(cloud: Cloud):
    around = look_around(cloud, OPTIONS)
    capture = cloud_only(cloud)
    return find_bars(capture, find_planes(cloud, around, OPTIONS), Photos(capture), FRINGE, OPTIONS)


def test_a_rail_that_shows_only_its_ends():
    found = bars(only_ends(box_cloud(SEAT, *LEGS, RAIL, spacing=3.0)))
    rails = [b for b in found if abs(b.world_from_board[2, 3] - 380) < 3]
    assert len(rails) == 1
    (rail,) = rails
    assert abs(rail.world_from_board[2, 2]) == pytest.approx(1, abs=1e-3), "its sheets lie across the smaller side"
    assert rail.thickness.value == pytest.approx(30, abs=7), "roughly: there are no photographs"
    low_x, low_y, high_x, high_y = rail.region.bounds
    assert (high_x - low_x, high_y - low_y) == (pytest.approx(60, abs=9), pytest.approx(280, abs=1))
    assert rail.thickness.evidence == "ends"


def test_ends_that_do_not_face_each_other_make_no_bar():
    cloud = only_ends(box_cloud(SEAT, *LEGS, RAIL, spacing=3.0))
    far = cloud.points[:, 1] > 138
    moved = cloud.points + np.where(far & (np.abs(cloud.points[:, 2] - 395) < 16), 70.0, 0.0)[:, None] * [1, 0, 0]
    assert not [b for b in bars(Cloud(moved, cloud.normals)) if abs(b.world_from_board[2, 3] - 380) < 3]


def test_identification_takes_the_rail_and_leaves_boards_alone():
    whole = identify(cloud_only(box_cloud(SEAT, *LEGS, spacing=3.0)), OPTIONS)
    with_rail = identify(cloud_only(only_ends(box_cloud(SEAT, *LEGS, RAIL, spacing=3.0))), OPTIONS)
    assert len(whole.sheets) == 3, "a bar through the seat says no more than the seat"
    assert len(with_rail.sheets) == 4
