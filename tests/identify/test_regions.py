import numpy as np
import pytest
from shapely.geometry import Point

from kerfwright.identify.regions import Raster, occupancy, polygons

SPACING = 2.0
CELL = 3.0


def spread(shape, spacing: float, seed: int = 0) -> np.ndarray:
    """Points at random inside a polygon, one for each spacing squared."""
    import shapely

    rng = np.random.default_rng(seed)
    low_x, low_y, high_x, high_y = shape.bounds
    count = int((high_x - low_x) * (high_y - low_y) / spacing**2)
    xy = rng.uniform((low_x, low_y), (high_x, high_y), (count, 2))
    return xy[shapely.contains_xy(shape, xy[:, 0], xy[:, 1])]


def traced(xy: np.ndarray, min_area: float = 400.0, min_hole: float = 200.0):
    raster = Raster.around(xy, CELL)
    return polygons(raster, occupancy(raster, xy, SPACING), min_area, min_hole)


def mean_error(piece, truth) -> float:
    """Mean distance between two outlines, mm."""
    return piece.symmetric_difference(truth).area / truth.length


def test_disc_with_a_hole():
    ring = Point(5, -3).buffer(100).difference(Point(15, -3).buffer(30))
    (piece,) = traced(spread(ring, SPACING))
    assert len(piece.interiors) == 1
    assert mean_error(piece, ring) < CELL
    assert piece.interiors[0].centroid.distance(Point(15, -3)) < CELL / 2


def test_a_veil_of_thin_points_is_not_wood():
    ring = Point(0, 0).buffer(100).difference(Point(0, 0).buffer(40))
    veil = spread(Point(0, 0).buffer(40), 8 * SPACING)
    assert len(veil) > 10
    (piece,) = traced(np.concatenate([spread(ring, SPACING), veil]))
    assert len(piece.interiors) == 1
    assert mean_error(piece, ring) < CELL


def test_a_face_seen_badly_on_one_side_is_whole():
    left, right = Point(0, 0).buffer(100).intersection(Point(-100, 0).buffer(100)), Point(0, 0).buffer(100)
    points = np.concatenate([spread(left, SPACING), spread(right.difference(left), 1.6 * SPACING)])
    (piece,) = traced(points)
    assert mean_error(piece, right) < CELL


def test_holes_below_the_smallest_are_filled():
    ring = Point(0, 0).buffer(100).difference(Point(0, 0).buffer(15))
    (piece,) = traced(spread(ring, SPACING), min_hole=2000.0)
    assert not piece.interiors


def test_pieces_come_apart_largest_first_and_small_ones_are_left_out():
    small, large, speck = Point(-200, 0).buffer(40), Point(0, 0).buffer(80), Point(150, 0).buffer(12)
    pieces = traced(np.concatenate([spread(s, SPACING) for s in (small, large, speck)]), min_area=1000.0)
    assert len(pieces) == 2
    assert pieces[0].centroid.x == pytest.approx(0, abs=2)
    assert pieces[1].centroid.x == pytest.approx(-200, abs=2)


def test_raster_leads_from_points_to_cells_and_back():
    raster = Raster.around(np.array([[-10.0, 5.0], [30.0, 9.0]]), 2.0)
    point = np.array([[7.3, 6.1]])
    (cell,) = np.argwhere(raster.counts(point))
    assert raster.counts(point).sum() == 1
    assert np.abs(raster.to_plane(cell[None].astype(float)) - point).max() <= 1.0
