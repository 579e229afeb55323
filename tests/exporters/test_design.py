"""How boards are drawn in programs: outlines run on past the faces that cut them, along their own curves."""

from itertools import pairwise

import numpy as np
import pytest
import shapely

from kerfwright.model import Arc, Bezier, Line, Loop, Model
from kerfwright.model.geometry import edge_length, edge_points, sample_loop
from kerfwright_exporters.design import OVERDRAW, design_boards
from kerfwright_exporters.extend import extended_edge
from simple import bevel, board, stool

ARC = Arc(start=(0, 0), mid=(30, 12), end=(60, 0))
CUBIC = Bezier(start=(0, 0), control_1=(20, 30), control_2=(50, -10), end=(80, 5))


@pytest.mark.parametrize("edge", [ARC, CUBIC], ids=["arc", "cubic"])
@pytest.mark.parametrize("at_end", [True, False])
def test_a_longer_curve_runs_along_the_old_one(edge, at_end):
    longer = extended_edge(edge, 3.0, at_end)
    assert edge_length(longer) - edge_length(edge) == pytest.approx(3.0, rel=0.1)
    kept = (edge.start, longer.start) if at_end else (edge.end, longer.end)
    assert kept[0] == kept[1]
    line = shapely.LineString(edge_points(longer, np.linspace(0, 1, 20001)))
    points = shapely.points(edge_points(edge, np.linspace(0, 1, 101)))
    assert shapely.distance(points, line).max() < 1e-5


def test_curves_are_not_drawn_on_without_end():
    tight = Arc(start=(1, 0), mid=(0, 1), end=(-1, 0))
    assert edge_length(extended_edge(tight, 100.0, True)) <= 1.26 * np.pi


def test_sides_that_lean_together_do_not_cross():
    """Moved out along its neighbours, the short edge would turn round: they meet 10 mm from it."""
    short = [(0, 0), (100, 0), (140, 200), (-40, 200)]
    leaning = [(0, 0), (10, 0), (205, 200), (-195, 200)]
    for points in (short, leaning):
        edges = tuple(Line(start=a, end=b) for a, b in zip(points, points[1:] + points[:1], strict=True))
        one = board(Loop(edges=edges), bevels=(bevel(points[0], points[1], 20.0),))
        (design,) = design_boards(Model(boards=(one,)))
        ring = shapely.LinearRing(sample_loop(design.outline))
        assert ring.is_simple and design.outline != one.cut_path.outer
        assert np.ptp(sample_loop(design.outline)[:, 1]) == pytest.approx(200 + OVERDRAW)


def test_no_end_of_a_curve_lies_on_the_face_that_cuts_it():
    side = Arc(start=(100, 0), mid=(115, 50), end=(100, 100))
    rest = [(100, 100), (0, 100), (0, 0), (100, 0)]
    edges = (side, *(Line(start=a, end=b) for a, b in pairwise(rest)))
    one = board(Loop(edges=edges), bevels=(bevel((0, 0), (100, 0), 20.0),))
    (design,) = design_boards(Model(boards=(one,)))
    (arc,) = (e for e in design.outline.edges if isinstance(e, Arc))
    assert arc.start[1] < -50 - 1 and arc.end[1] == pytest.approx(50)  # drawn about the middle of the board


def test_neighbours_cut_in_the_order_of_the_contacts():
    designs = design_boards(stool())
    assert [[(c.board, c.face) for c in d.cuts] for d in designs] == [[], [(0, "bottom")], [(0, "bottom")]]
