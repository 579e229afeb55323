"""A board along x that runs through, and one that leans 10 degrees from square and stops on it."""

import numpy as np
import pytest

from clouds import pose, sheet
from kerfwright.assemble.flush_ends import flush_end
from kerfwright.capture.types import Cloud
from kerfwright.identify.joints import Search, end_on

T, LEAN = 15.0, np.radians(10)
ALONG = np.array([np.sin(LEAN), np.cos(LEAN), 0])  # of the board that stops
OUT = np.array([-np.cos(LEAN), np.sin(LEAN), 0])
THROUGH = sheet("through", pose((0, T, 0), (1, 0, 0), (0, 0, 1)), T, (-10, 0, 300, 100))  # its inner face is y = T
FOOT = T / np.cos(LEAN) * ALONG
STOPS = sheet("stops", pose(FOOT, ALONG, (0, 0, 1)), T, (0, 0, 200, 100))
SHEETS = (THROUGH, STOPS)


def cloud_of_end(slant: float, share: float = 1.0):
    """Points on the end of the board that runs through, turned by `slant` radians from square about its middle."""
    rng = np.random.default_rng(3)
    y, z = rng.uniform(0, T, 400), rng.uniform(0, 100 * share, 400)
    plane = STOPS.world_from_board[:3, 3]
    outer = plane + (T if STOPS.normal @ OUT > 0 else 0.0) * STOPS.normal
    middle = outer[0] - (outer[1] - T / 2) * np.tan(LEAN)
    x = middle + (y - T / 2) * np.tan(slant) + rng.normal(0, 0.1, 400)
    normal = np.array([-np.cos(slant), np.sin(slant), 0])
    points = np.c_[x, y, z]
    return Cloud(np.r_[points, [[300, 200, 0]]], np.r_[np.tile(normal, (400, 1)), [[0, 0, -1.0]]])


def found(slant: float, share: float = 1.0):
    joint = end_on(SHEETS, 0, 1, Search(reach=10.0, slack=5.0, cover=5.0, step=1.5, shortest=3.0))
    outer = "top" if STOPS.normal @ OUT > 0 else "bottom"
    return flush_end(SHEETS, joint, outer, cloud_of_end(slant, share))


def test_an_end_whose_points_lie_on_the_outer_face_is_bevelled_flush():
    end = found(LEAN)
    assert (end.a, end.b) == (1, 0)
    assert abs(np.degrees(np.arctan(end.trace.slope))) == pytest.approx(10)
    ((low, high),) = end.intervals
    assert high - low == pytest.approx(98, abs=2)


@pytest.mark.parametrize(("slant", "share"), [(0.0, 1.0), (-LEAN, 1.0), (LEAN, 0.3)])
def test_a_square_end_and_one_that_is_hardly_seen_are_left_alone(slant, share):
    assert found(slant, share) is None
