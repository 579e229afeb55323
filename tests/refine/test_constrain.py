"""A rectangle of wood, x 0 to 100, y 0 to 60, and a segment above it, right to left, wood below."""

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.outlines import constrained_region
from kerfwright.refine.constrain import outline_region, to_loops
from kerfwright.refine.types import BoundaryLoop, Outline

REACH, BEYOND = 20.0, 25.0


def segment(start, end, origin="contact") -> ConstraintSegment:
    return ConstraintSegment(np.array(start, float), np.array(end, float), origin, 0.15)


def above(y: float, low: float = 0, high: float = 100, origin="contact") -> ConstraintSegment:
    return segment((high, y), (low, y), origin)


def constrained(region, *segments):
    return constrained_region(region, segments, REACH, BEYOND)


def signed_area(points: np.ndarray) -> float:
    ahead = np.roll(points, -1, axis=0)
    return float(0.5 * (points[:, 0] * ahead[:, 1] - points[:, 1] * ahead[:, 0]).sum())


def difference(a, b) -> float:
    return a.symmetric_difference(b).area


def outline(*rings, error=0.4) -> Outline:
    loops = [BoundaryLoop(np.array(r, float), np.full(len(r), error), k > 0) for k, r in enumerate(rings)]
    return Outline(tuple(loops), "images")


def test_a_region_that_stops_short_runs_on_to_its_segment():
    assert difference(constrained(box(0, 0, 100, 56), above(60)), box(0, 0, 100, 60)) < 1.0


def test_a_ragged_edge_is_filled_too():
    ragged = Polygon([(0, 0), (100, 0), (100, 55), (70, 58), (50, 54), (20, 59), (0, 56)])
    assert difference(constrained(ragged, above(60)), box(0, 0, 100, 60)) < 2.0


def test_a_region_that_goes_beyond_is_cut_off():
    assert difference(constrained(box(0, 0, 100, 70), above(60)), box(0, 0, 100, 60)) < 1.0


def test_a_region_out_of_reach_is_left_alone():
    assert difference(constrained(box(0, 0, 100, 60 - REACH - 5), above(60)), box(0, 0, 100, 60 - REACH - 5)) < 0.5


def test_a_step_beside_the_segment_stays():
    """A tongue reaches the segment, the shoulder beside it, 15 mm lower, does not."""
    stepped = box(0, 0, 60, 57).union(box(60, 0, 100, 45))
    assert difference(constrained(stepped, above(60)), box(0, 0, 60, 60).union(box(60, 0, 100, 45))) < 5.0


def test_nothing_is_filled_beside_the_segment():
    found = constrained(box(0, 0, 100, 56), above(60, high=50))
    assert difference(found, box(0, 0, 100, 56).union(box(0, 56, 50, 60))) < 1.0


def test_an_arch_that_begins_within_a_ground_segment_stays():
    """The foot's inner edge is slanted: 2 mm above the floor at the end of the segment."""
    leg = Polygon([(0, 0), (30, 0), (36, 2), (40, 60), (0, 60)])
    assert difference(constrained(leg, segment((0, 0), (36, 0), "ground")), leg) < 1.0


def test_wood_beside_a_ground_segment_is_not_cut():
    """A foot stands on the floor; the other goes lower only in the tracing, beside the segment."""
    leg = box(0, 0, 40, 100).union(box(60, -3, 100, 100)).union(box(0, 80, 100, 100))
    found = constrained(leg, segment((0, 0), (40, 0), "ground"))
    assert found.bounds[1] == pytest.approx(-3)
    found = constrained(leg, segment((60, 0), (100, 0), "ground"))
    assert found.bounds[1] == pytest.approx(0, abs=1e-6)


def test_two_segments_close_the_corner():
    found = constrained(box(0, 0, 95, 56), above(60), segment((100, 0), (100, 60)))
    assert difference(found, box(0, 0, 100, 60)) < 1.0


def test_holes_of_an_outline_are_holes_of_its_region():
    ring = [(0, 0), (100, 0), (100, 60), (0, 60)]
    hole = [(40, 20), (40, 40), (60, 40), (60, 20)]
    assert outline_region(outline(ring, hole)).area == pytest.approx(6000 - 400)


def test_loops_keep_the_material_on_the_left():
    region = Polygon(box(0, 0, 100, 60).exterior.coords[::-1], [box(40, 20, 60, 40).exterior.coords])
    loops = to_loops(region, outline([(0, 0), (100, 0), (100, 60), (0, 60)]), (), 1.0)
    areas = [signed_area(loop.points) for loop in loops]
    assert areas == pytest.approx([6000, -400], rel=0.01)
    assert [loop.is_hole for loop in loops] == [False, True]


def test_loops_are_evenly_spaced():
    (loop,) = to_loops(box(0, 0, 100, 60), outline([(0, 0), (100, 0), (100, 60), (0, 60)]), (), 1.0)
    gaps = np.hypot(*(np.roll(loop.points, -1, axis=0) - loop.points).T)
    assert len(loop.points) == 320
    assert gaps == pytest.approx(np.ones(320))


def test_specks_are_no_holes():
    region = box(0, 0, 100, 60).difference(box(50, 30, 54, 34))
    assert len(to_loops(region, outline([(0, 0), (100, 0), (100, 60), (0, 60)]), (), 1.0)) == 1


def test_points_on_a_segment_are_as_sure_as_the_segment_and_others_as_the_outline():
    traced = outline(np.asarray(box(0, 0, 100, 60).segmentize(1.0).exterior.coords)[:-1], error=0.4)
    (loop,) = to_loops(box(0, 0, 100, 60), traced, (above(60),), 1.0)
    on = np.abs(loop.points[:, 1] - 60) < 0.01
    assert (loop.standard_error[on] == 0.15).all()
    assert (loop.standard_error[~on] == 0.4).all()


def test_points_that_nobody_traced_are_less_sure_the_further_they_are():
    traced = outline(np.asarray(box(0, 0, 100, 40).segmentize(1.0).exterior.coords)[:-1], error=0.4)
    (loop,) = to_loops(box(0, 0, 100, 60), traced, (), 1.0)
    far = loop.points[:, 1] > 59.9
    assert loop.standard_error[far].min() > 3 * 0.4 + 0.2 * 19
