"""Beziers as arcs: within tolerance, smooth, few."""

import itertools

import numpy as np
import pytest
import shapely

from kerfwright.model import Arc, Bezier, Line, Loop
from kerfwright.model.arcs import arc_loop, bezier_arcs
from kerfwright.model.geometry import edge_end, edge_points, edge_start, edge_tangents, sample_loop, signed_area

CURVES = {
    "bow": Bezier(start=(300, 60), control_1=(220, 110), control_2=(80, 10), end=(0, 60)),
    "quarter": Bezier(start=(50, 0), control_1=(50, 27.6142), control_2=(27.6142, 50), end=(0, 50)),
    "hook": Bezier(start=(0, 0), control_1=(120, 0), control_2=(120, 60), end=(0, 80)),
    "straight": Bezier(start=(0, 0), control_1=(10, 5), control_2=(50, 25), end=(60, 30)),
    "tight": Bezier(start=(0, 0), control_1=(100, 20), control_2=(-60, 20), end=(40, 0)),
    "degenerate": Bezier(start=(0, 0), control_1=(0, 0), control_2=(40, 30), end=(60, 0)),
}


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("tolerance", [0.05, 0.005])
def test_arcs_follow_the_curve(name, tolerance):
    bezier = CURVES[name]
    arcs = bezier_arcs(bezier, tolerance)
    assert edge_start(arcs[0]) == pytest.approx(bezier.start) and edge_end(arcs[-1]) == pytest.approx(bezier.end)
    for a, b in itertools.pairwise(arcs):
        assert edge_end(a) == pytest.approx(edge_start(b), abs=1e-9)
    curve = shapely.linestrings(edge_points(bezier, np.linspace(0, 1, 4001)))
    chain = shapely.linestrings(sample_loop(Loop(edges=(*arcs, Line(start=bezier.end, end=bezier.start))), 1e-4))
    assert shapely.hausdorff_distance(curve, chain) <= tolerance * 1.02 + 2e-4


@pytest.mark.parametrize("name", ["bow", "quarter", "hook"])
def test_arcs_join_smoothly_and_are_few(name):
    arcs = bezier_arcs(CURVES[name], 0.05)
    for a, b in itertools.pairwise(arcs):
        leave, enter = edge_tangents(a, [1.0])[0], edge_tangents(b, [0.0])[0]
        assert leave @ enter > np.cos(0.005)
    assert len(arcs) <= 16


def test_a_straight_bezier_becomes_lines():
    assert all(isinstance(e, Line) for e in bezier_arcs(CURVES["straight"], 0.05))


def test_loops_keep_their_area_and_their_other_edges():
    bow = CURVES["bow"]
    loop = Loop(edges=(bow, Line(start=(0, 60), end=(0, 0)), Line(start=(0, 0), end=(300, 0)),
                       Arc(start=(300, 0), mid=(310, 30), end=(300, 60))))  # fmt: skip
    arcs = arc_loop(loop, 0.05)
    assert arcs.edges[-3:] == loop.edges[-3:]
    assert signed_area(arcs) == pytest.approx(signed_area(loop), rel=1e-4)
