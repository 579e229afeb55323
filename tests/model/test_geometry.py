"""Geometry of cut paths against closed formulas."""

import numpy as np
import pytest

from kerfwright.model import Arc, Bezier, Circle, CutPath, Line, Loop
from kerfwright.model.geometry import (
    arc_bulge,
    arc_circle,
    arc_from_bulge,
    edge_length,
    edge_points,
    edge_tangents,
    loop_distance,
    loop_length,
    mirror_path,
    path_area,
    path_polygon,
    reverse_loop,
    sample_edge,
    sample_loop,
    signed_area,
    transform_edge,
    transform_path,
)

EDGES = [
    Line(start=(1, 2), end=(30, -4)),
    Arc(start=(3, 0), mid=(0, 3), end=(-3, 0)),
    Arc(start=(3, 0), mid=(0, -3), end=(0, 3)),
    Circle(centre=(4, 5), radius=6, clockwise=True),
    Bezier(start=(0, 0), control_1=(10, 30), control_2=(40, -20), end=(50, 5)),
    Bezier(start=(0, 0), control_1=(0, 0), control_2=(40, 20), end=(50, 5)),
]


def stadium() -> CutPath:
    """A 100 x 40 slot shape with a round hole of radius 10."""
    outer = Loop(
        edges=(
            Line(start=(0, 0), end=(100, 0)),
            Arc(start=(100, 0), mid=(120, 20), end=(100, 40)),
            Line(start=(100, 40), end=(0, 40)),
            Arc(start=(0, 40), mid=(-20, 20), end=(0, 0)),
        )
    )
    return CutPath(outer=outer, holes=(Loop(edges=(Circle(centre=(50, 20), radius=10, clockwise=True),)),))


@pytest.mark.parametrize("edge", EDGES, ids=lambda e: e.kind)
def test_tangents_are_the_derivative_and_samples_keep_the_chord_tolerance(edge):
    t = np.linspace(0.001, 0.999, 400)
    step = 1e-6
    difference = edge_points(edge, t + step) - edge_points(edge, t - step)
    difference /= np.linalg.norm(difference, axis=1, keepdims=True)
    np.testing.assert_allclose(edge_tangents(edge, t), difference, atol=1e-5)
    fine = edge_points(edge, np.linspace(0, 1, 20001))
    assert edge_length(edge) == pytest.approx(np.linalg.norm(np.diff(fine, axis=0), axis=1).sum(), rel=1e-6)
    import shapely

    coarse = shapely.linestrings(sample_edge(edge, 0.05))
    assert shapely.distance(shapely.points(fine), coarse).max() <= 0.05 + 1e-9


def test_arc_passes_through_its_points_either_way_round():
    for mid, turn in (((0, 3), 1), ((0, -3), -1)):
        arc = Arc(start=(3, 0), mid=mid, end=(-3, 0))
        centre, radius, sweep = arc_circle(arc)
        np.testing.assert_allclose(centre, 0, atol=1e-12)
        assert radius == pytest.approx(3) and sweep == pytest.approx(turn * np.pi)
        again = arc_from_bulge(arc.start, arc.end, arc_bulge(arc))
        np.testing.assert_allclose(again.mid, mid, atol=1e-12)


def test_collinear_arc_is_refused():
    with pytest.raises(ValueError, match="collinear"):
        arc_circle(Arc(start=(0, 0), mid=(1, 1), end=(2, 2)))


def test_area_and_length_are_exact():
    path = stadium()
    assert path_area(path) == pytest.approx(100 * 40 + np.pi * 400 - np.pi * 100, abs=1e-9)
    assert loop_length(path.outer) == pytest.approx(200 + 40 * np.pi)
    assert signed_area(path.holes[0]) == pytest.approx(-100 * np.pi)
    bezier = Loop(edges=(EDGES[4], Line(start=(50, 5), end=(0, 0))))
    points = sample_loop(bezier, 1e-6)
    x, y = points.T
    shoelace = (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    assert signed_area(bezier) == pytest.approx(shoelace, rel=1e-6)
    assert signed_area(reverse_loop(bezier)) == pytest.approx(-signed_area(bezier))


def test_transforms_keep_senses_area_and_shape():
    path = stadium()
    turned = transform_path(path, np.array([[0.6, -0.8, 7], [0.8, 0.6, -3]]))
    mirrored = mirror_path(turned)
    for other in (turned, mirrored):
        assert path_area(other) == pytest.approx(path_area(path))
        assert signed_area(other.outer) > 0 > signed_area(other.holes[0])
        assert path_polygon(other).is_valid
        assert all(type(e.clockwise) is bool for hole in other.holes for e in hole.edges if isinstance(e, Circle))
    np.testing.assert_allclose(edge_points(mirrored.outer.edges[-1], [0])[0] * (-1, 1), turned.outer.edges[0].end)
    with pytest.raises(ValueError, match="similarity"):
        transform_edge(path.outer.edges[1], np.array([[2.0, 0, 0], [0, 1, 0]]))


def test_distance_to_loop():
    found = loop_distance(stadium().outer, [(50, 20), (50, 41), (125, 20)])
    np.testing.assert_allclose(found, [20, 1, 5], atol=0.01)
