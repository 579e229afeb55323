"""Fitting cut paths: constraints, bumps and notches, exactness, errors."""

from itertools import combinations

import numpy as np
import pytest

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.errors import OptionError, StageError
from kerfwright.model import Arc, Circle, CutPath, Line, Loop, Origin
from kerfwright.model.geometry import edge_tangents
from kerfwright.refine.curves import CurveOptions, fit_curves, fit_cut_path
from kerfwright.refine.curves.path import check_path
from kerfwright.refine.types import BoundaryLoop

NOISE = 0.4


def boundary(corners, seed=0, noise=NOISE, hole=False):
    """A polygon's boundary, a point a millimetre, with smooth noise."""
    corners = np.asarray(corners, float)
    sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    points = np.vstack([np.linspace(a, b, max(2, round(np.linalg.norm(b - a))), endpoint=False) for a, b in sides])
    kernel = np.exp(-(np.arange(-10, 11) ** 2) / 12.5)
    white = np.random.default_rng(seed).normal(size=(len(points) + 20, 2))
    smooth = np.column_stack([np.convolve(w, kernel / np.sqrt((kernel**2).sum()), "valid") for w in white.T])
    return BoundaryLoop(points + noise * smooth, np.full(len(points), max(noise, 0.2)), hole)


def segment(a, b, error=0.2):
    return ConstraintSegment(np.array(a, float), np.array(b, float), "contact", error)


def nearest_node(loop, point):
    return min(float(np.hypot(e.start[0] - point[0], e.start[1] - point[1])) for e in loop.edges)


def bumped(depth, width, side="cosine"):
    """A 300 x 100 rectangle whose lower side has a bump or a notch into the material in its middle."""
    base = boundary([(0, 0), (300, 0), (300, 100), (0, 100)], seed=3)
    points = base.points.copy()
    near = (np.abs(points[:, 0] - 110) < width / 2) & (points[:, 1] < 20)
    if side == "cosine":
        points[near, 1] += depth * np.cos(np.pi * (points[near, 0] - 110) / width) ** 2
    return BoundaryLoop(points, base.standard_error)


def stepped(shift):
    """A 300 x 100 rectangle whose lower side is moved inwards by shift(x)."""
    base = boundary([(0, 0), (300, 0), (300, 100), (0, 100)], seed=5, noise=0.1)
    points = base.points.copy()
    lower = points[:, 1] < 20
    points[lower, 1] += shift(points[lower, 0])
    return BoundaryLoop(points, base.standard_error)


def test_a_side_traced_along_both_lines_of_an_eased_edge_is_one_line():
    path = fit_cut_path([stepped(lambda x: 1.3 * (np.abs(x - 120) < 70))])
    assert [e.kind for e in path.outer.edges] == ["line"] * 4


@pytest.mark.parametrize("inner", [lambda x: x > 170, lambda x: x < 130, lambda x: np.abs(x - 120) < 70])
def test_where_a_side_was_traced_on_two_levels_the_board_ends_at_the_outer_one(inner):
    path = fit_cut_path([stepped(lambda x: 1.9 * inner(x))])
    assert [e.kind for e in path.outer.edges] == ["line"] * 4
    lower = min(path.outer.edges, key=lambda e: e.start[1] + e.end[1])
    assert (lower.start[1], lower.end[1]) == pytest.approx((0, 0), abs=0.15)


@pytest.mark.parametrize("shift", [lambda x: 6.0 * (np.abs(x - 120) < 70), lambda x: 3 * (1 - ((x - 150) / 150) ** 2)])
def test_high_steps_and_even_bows_stay(shift):
    edges = fit_cut_path([stepped(shift)]).outer.edges
    assert len(edges) > 4 or "arc" in {e.kind for e in edges}


def test_corner_of_two_constraints_closes_though_the_boundary_cuts_it_off():
    cut_off = boundary([(0, 0), (200, 0), (200, 95), (195, 100), (0, 100)])
    path = fit_cut_path([cut_off], [segment((200.3, 10), (200.3, 80)), segment((150, 100.4), (20, 100.4))])
    assert len(path.outer.edges) == 4
    assert nearest_node(path.outer, (200.3, 100.4)) < 1e-9
    assert sum(e.origin == Origin.IMPLIED for e in path.outer.edges) == 2


def test_constrained_line_is_exact_and_meets_its_free_neighbour():
    fit = fit_curves([boundary([(0, 0), (200, 0), (200, 100), (0, 100)])], [segment((20, -0.7), (150, -0.7), 0.3)])
    lowest = [e for e in fit.path.outer.edges if max(e.start[1], e.end[1]) < 1]
    assert len(lowest) == 1 and len(fit.path.outer.edges) == 4
    assert abs(lowest[0].start[1] + 0.7) < 1e-9 and abs(lowest[0].end[1] + 0.7) < 1e-9
    assert lowest[0].standard_error == 0.3


def test_feet_on_both_sides_of_an_arch_follow_one_constraint():
    angle = np.linspace(np.pi, 0, 60)
    arch = np.column_stack([150 + 60 * np.cos(angle), 60 * np.sin(angle)])
    points = [(0, 0), *arch, (300, 0), (300, 200), (0, 200)]
    fit = fit_curves([boundary(points)], [segment((0, 0.5), (300, 0.5))])
    assert [s.constraint for s in fit.edges[0]].count(0) == 2
    assert sum(e.kind == "arc" for e in fit.path.outer.edges) == 1
    assert len(fit.path.outer.edges) == 6


def test_segment_that_the_boundary_does_not_follow_is_ignored():
    loop = boundary([(0, 0), (200, 0), (200, 100), (0, 100)])
    fit = fit_curves([loop], [segment((194, 10), (194, 80), 0.1), segment((100, 0), (100, 100), 0.1)])
    assert all(s.constraint is None for s in fit.edges[0])


def test_short_bump_neither_bends_nor_tilts_a_long_line():
    fit = fit_curves([bumped(3.5, 20)])
    low = [e for e in fit.path.outer.edges if max(e.start[1], e.end[1]) < 5]
    assert len(low) == 1
    assert abs(np.arctan2(low[0].end[1] - low[0].start[1], low[0].end[0] - low[0].start[0])) < np.radians(0.15)
    assert abs((low[0].start[1] + low[0].end[1]) / 2) < 0.4
    assert len(fit.notes) == 1 and "near (110, " in fit.notes[0]


@pytest.mark.parametrize("width, depth", [(5.5, 8), (12, 5), (30, 20)])
def test_notch_stays(width, depth):
    corners = [(0, 0), (120, 0), (120, depth), (120 + width, depth), (120 + width, 0), (300, 0), (300, 100), (0, 100)]
    path = fit_cut_path([boundary(corners, noise=0.25)])
    assert len(path.outer.edges) == 8
    assert max(nearest_node(path.outer, c) for c in corners) < 2.0


def test_smooth_closed_loop_has_no_node_at_the_start():
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    loop = BoundaryLoop(80 * np.column_stack([np.cos(angle), np.sin(angle)]) + 30, np.full(400, 0.3))
    circle = fit_cut_path([loop]).outer.edges
    assert len(circle) == 1 and isinstance(circle[0], Circle)
    assert abs(circle[0].radius - 80) < 0.01 and np.hypot(circle[0].centre[0] - 30, circle[0].centre[1] - 30) < 0.01


def test_round_hole_runs_clockwise_and_path_is_valid():
    angle = np.linspace(0, -2 * np.pi, 100, endpoint=False)
    hole = BoundaryLoop(15 * np.column_stack([np.cos(angle), np.sin(angle)]) + 50, np.full(100, 0.3), True)
    path = fit_cut_path([boundary([(0, 0), (200, 0), (200, 100), (0, 100)]), hole])
    assert path.holes[0].edges[0].clockwise


def test_nodes_are_shared_to_the_last_bit_and_right_angles_are_right():
    edges = fit_cut_path([boundary([(0, 0), (211, 0), (211, 93), (0, 93)], seed=5)]).outer.edges
    assert all(edges[k - 1].end == edges[k].start for k in range(4))
    directions = [edge_tangents(e, np.zeros(1))[0] for e in edges]
    for a, b in combinations(directions, 2):
        assert min(abs(a @ b), abs(a[0] * b[1] - a[1] * b[0])) < 1e-9


def test_lines_that_are_truly_tilted_stay_tilted():
    path = fit_cut_path([boundary([(0, 0), (300, 0), (290, 150), (0, 150)], seed=2)])
    (tilted,) = [e for e in path.outer.edges if min(e.start[0], e.end[0]) > 200]
    assert abs(np.degrees(np.arctan2(tilted.end[0] - tilted.start[0], tilted.end[1] - tilted.start[1])) + 3.81) < 0.4


def test_same_input_gives_the_same_path():
    loop = boundary([(0, 0), (200, 0), (200, 100), (0, 100)])
    assert fit_cut_path([loop]) == fit_cut_path([loop])


def test_result_does_not_depend_on_where_the_boundary_starts_or_on_units_of_noise():
    loop = boundary([(0, 0), (200, 0), (200, 100), (0, 100)], seed=7)
    turned = BoundaryLoop(np.roll(loop.points, 91, axis=0), loop.standard_error)
    a, b = fit_cut_path([loop]), fit_cut_path([turned])
    assert max(nearest_node(a.outer, e.start) for e in b.outer.edges) < 0.15
    coarse = BoundaryLoop(4 * loop.points, 4 * loop.standard_error)
    large = fit_cut_path([coarse], (), CurveOptions(correlation_length=20))
    assert [e.kind for e in large.outer.edges] == ["line"] * 4


def test_standard_error_of_a_long_line_is_that_of_many_observations():
    edges = fit_cut_path([boundary([(0, 0), (400, 0), (400, 300), (0, 300)])]).outer.edges
    assert all(isinstance(e, Line) and NOISE / 20 < e.standard_error < NOISE / 2 for e in edges)


@pytest.mark.parametrize(
    "points, sigma, message",
    [
        ([(0, 0), (1, 0)], 0.5, "at least 3"),
        ([(0, 0), (0, 0), (50, 0), (50, 0)], 0.5, "at least 3"),
        ([(0, 0), (50, 0), (50, 50), (0, 50)], 0.0, "standard_error"),
        ([(0, 0), (50, 0), (np.nan, 50), (0, 50)], 0.5, "not finite"),
    ],
)
def test_boundaries_that_cannot_be_fitted_are_refused(points, sigma, message):
    with pytest.raises(StageError, match=message):
        fit_cut_path([BoundaryLoop(np.array(points, float), np.full(len(points), sigma))])


def test_path_that_crosses_itself_is_refused():
    with pytest.raises(StageError, match="crosses itself"):
        fit_cut_path([boundary([(0, 0), (200, 100), (200, 0), (0, 100)], noise=0)])


def test_no_loops_and_senseless_options_are_refused():
    with pytest.raises(StageError, match="none found"):
        fit_cut_path([])
    with pytest.raises(OptionError, match="correlation_length"):
        CurveOptions(correlation_length=0)


def test_relations_can_be_left_out():
    loops = [boundary([(0, 0), (200, 0), (200, 100), (0, 100)])]
    with_them, without = (fit_curves(loops, options=CurveOptions(use_relations=on)) for on in (True, False))
    assert any(r.startswith("parallel") for r in with_them.relations)
    assert without.relations == ()
    assert without.chi2 < with_them.chi2


def test_a_path_with_an_arc_shrunk_to_a_point_is_refused_not_a_crash():
    """As relations between edges made one of the stool's."""
    corners = [(0.0, 0.0), (90.0, 0.0), (90.0, 60.0), (90.0, 60.00000000000001)]
    edges = [Line(start=a, end=b) for a, b in ((corners[0], corners[1]), (corners[1], corners[2]))]
    edges += [Arc(start=corners[2], mid=corners[2], end=corners[3]), Line(start=corners[3], end=corners[0])]
    with pytest.raises(StageError, match="collinear"):
        check_path(CutPath(outer=Loop(edges=tuple(edges))))


def corner_missed(error):
    """A rectangle one of whose corners was traced 12 mm beside itself, with the standard error given there."""
    loop = boundary([(0, 0), (200, 0), (200, 70), (212, 85), (200, 100), (0, 100)], noise=0.2)
    there = (loop.points[:, 0] > 190) & (loop.points[:, 1] > 66)
    return BoundaryLoop(loop.points, np.where(there, error, loop.standard_error))


def test_what_was_traced_in_doubt_is_left_out():
    path = fit_cut_path([corner_missed(1.6)])
    assert len(path.outer.edges) == 4
    assert nearest_node(path.outer, (200, 100)) < 1.0


def test_what_was_traced_for_sure_stays():
    assert nearest_node(fit_cut_path([corner_missed(0.2)]).outer, (212, 85)) < 1.5
