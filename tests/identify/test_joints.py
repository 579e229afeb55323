"""A shelf over uprights: who ends on whom, by geometry alone."""

import numpy as np
import pytest
from shapely.geometry import box

from clouds import pose, sheet, turned
from kerfwright.identify.joints import Search, columns, end_on, face_plane, runs_of, trace_of

REACH, SLACK, STEP = 15.0, 6.0, 2.0
SEARCH = Search(reach=REACH, slack=SLACK, cover=SLACK, step=STEP, shortest=5.0)
SHELF = sheet("shelf", pose((0, 0, 200)), 18.0, (-150, 0, 150, 100))


def upright(x: float, low: float, high: float):
    """A board of 18 mm from x on, as deep as the shelf."""
    return sheet("upright", pose((x, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, low, 100, high))


def joint(a, b):
    return end_on((a, b), 0, 1, SEARCH)


def test_tee_joint_is_found_on_the_underside():
    found = joint(SHELF, upright(-9, 0, 197))
    assert found.face_a == "bottom"
    assert found.gap == pytest.approx(3.0)
    assert found.length == pytest.approx(100, abs=STEP)
    assert joint(upright(-9, 0, 197), SHELF) is None


def test_a_board_above_ends_on_the_top():
    found = joint(SHELF, upright(-9, 221, 400))
    assert found.face_a == "top"
    assert found.gap == pytest.approx(3.0)


def test_at_a_corner_either_could_end():
    side = upright(-150, 0, 218)
    assert joint(SHELF, side).face_a == "bottom"
    assert joint(SHELF, side).gap == pytest.approx(-18.0)
    assert joint(side, SHELF).face_a == "top"


def test_a_crossing_board_does_not_end():
    crossing = upright(-9, 0, 400)
    assert joint(SHELF, crossing) is None
    assert joint(crossing, SHELF) is None


def test_a_board_that_stops_beyond_reach_does_not_end():
    assert joint(SHELF, upright(-9, 0, 200 - REACH - 1)) is None


def test_a_board_that_points_past_the_other_does_not_end_on_it():
    assert joint(SHELF, upright(400, 0, 197)) is None


def test_parallel_boards_have_no_line_to_end_on():
    assert joint(SHELF, sheet("other", pose((0, 0, 150)), 18.0, (-150, 0, 150, 100))) is None


def test_a_joint_is_as_long_as_the_other_has_wood():
    short = sheet("short", pose((0, 0, 200)), 18.0, (-150, 0, 150, 40))
    assert joint(short, upright(-9, 0, 197)).length == pytest.approx(40 + SLACK, abs=2 * STEP)


def test_two_feet_are_two_intervals():
    feet = box(0, 0, 100, 197).difference(box(30, 150, 70, 200))
    on = sheet("feet", pose((-9, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, feet)
    found = joint(SHELF, on)
    assert len(found.intervals) == 2
    assert found.length == pytest.approx(60, abs=2 * STEP)


@pytest.mark.parametrize("degrees", [20.0, -35.0])
def test_trace_of_a_tilted_board_lies_on_the_plane_at_every_height(degrees):
    frame = turned("y", 90.0 + degrees)
    frame[:3, 3] = 5.0, -3.0, 40.0
    tilted = sheet("tilted", frame, 15.0, (-100, 0, 100, 80))
    normal, offset = face_plane(SHELF, "bottom")
    trace = trace_of(tilted, normal, offset)
    for z in (0.0, 6.0, 15.0):
        shift = np.full(3, trace.slope * (z - trace.depth))
        places = trace.place(shift, np.array([-20.0, 0.0, 60.0]))
        assert tilted.to_world(np.c_[places, np.full(3, z)]) @ normal == pytest.approx(offset)
    assert abs(trace.slope) == pytest.approx(abs(np.tan(np.radians(degrees))))
    assert trace.sine == pytest.approx(np.cos(np.radians(degrees)))


@pytest.mark.parametrize("degrees", [20.0, -35.0])
def test_trace_of_a_tilted_board_is_where_it_reaches_furthest(degrees):
    frame = turned("y", 90.0 + degrees)
    tilted = sheet("tilted", frame, 15.0, (-100, 0, 100, 80))
    trace = trace_of(tilted, *face_plane(SHELF, "bottom"))
    reach = [trace.slope * (z - trace.depth) for z in (0.0, 7.0, 15.0)]
    assert min(reach) == pytest.approx(0)
    assert max(reach) > 5
    assert trace.normal == pytest.approx(-(np.array(face_plane(SHELF, "bottom")[0]) @ frame[:3, :3]))


def test_trace_coordinates_lead_back():
    trace = trace_of(upright(-9, 0, 197), *face_plane(SHELF, "bottom"))
    xy = np.array([[10.0, 150.0], [60.0, 210.0]])
    inside, along = trace.coordinates(xy)
    assert trace.place(inside, along) == pytest.approx(xy)
    assert inside == pytest.approx([50.0, -10.0])


def test_columns_measure_where_the_wood_begins():
    region = box(0, 0, 50, 190).union(box(50, 0, 100, 180))
    trace = trace_of(upright(-9, 0, 197), *face_plane(SHELF, "bottom"))
    along, first, last = columns(region, trace, STEP)
    assert len(along) == 50
    assert sorted(set(first.round(6))) == [10.0, 20.0]
    assert last == pytest.approx(200.0)


def test_runs_join_small_gaps_and_drop_short_ones():
    along = np.arange(0.5, 40, 1.0)
    ends = (along < 10) | ((along > 12) & (along < 20)) | ((along > 30) & (along < 32))
    assert runs_of(along, ends, 1.0, 5.0, joining=4.0) == ((0.0, 20.0),)
    assert runs_of(along, ends, 1.0, 5.0, joining=2.0) == ((0.0, 10.0), (12.0, 20.0))
    assert runs_of(along, ends & False, 1.0, 5.0, joining=4.0) == ()
