"""Compiled distances to edges: against points laid densely along them, and derivatives against differences."""

import numpy as np
import pytest

from kerfwright.refine.curves.feet import WIDTH, assigned, edge_feet, edge_residuals, normal_sums
from kerfwright.refine.curves.ranges import ARC, CUBIC, LINE

LINE_ROW = np.array([10.0, 5.0, 90.0, 25.0, 0, 0, 0, 0])
ARC_ROW = np.array([10.0, 5.0, 90.0, 25.0, 0.6, 0, 0, 0])  # bows to the right of its chord, by .6 of half of it
BACK_ROW = np.array([90.0, 25.0, 10.0, 5.0, -1.3, 0, 0, 0])  # more than half a circle
CUBIC_ROW = np.array([10.0, 5.0, 90.0, 25.0, 30.0, 60.0, 70.0, -20.0])
EDGES = [(LINE, LINE_ROW, 4), (ARC, ARC_ROW, 5), (ARC, BACK_ROW, 5), (CUBIC, CUBIC_ROW, 8)]


def along(kind: int, e: np.ndarray, count: int = 20001) -> np.ndarray:
    """Points of an edge by its definition, not by the code under test."""
    a, b = e[:2], e[2:4]
    t = np.linspace(0, 1, count)[:, None]
    if kind == LINE:
        return a + t * (b - a)
    if kind == CUBIC:
        s = 1 - t
        return s**3 * a + 3 * s * s * t * e[4:6] + 3 * s * t * t * e[6:8] + t**3 * b
    chord, sagitta = np.hypot(*(b - a)), e[4] * np.hypot(*(b - a)) / 2
    right = np.array([b[1] - a[1], a[0] - b[0]]) / chord
    radius = (chord**2 / 4 + sagitta**2) / (2 * sagitta)
    centre = (a + b) / 2 + (sagitta - radius) * right
    start = np.arctan2(*(a - centre)[::-1])
    angle = start + t[:, 0] * 4 * np.arctan(e[4])
    return centre + abs(radius) * np.c_[np.cos(angle), np.sin(angle)]


@pytest.fixture(scope="module")
def places() -> np.ndarray:
    return np.random.default_rng(3).uniform((-40, -60), (140, 100), (300, 2))


@pytest.mark.parametrize(("kind", "row", "unknowns"), EDGES)
def test_distance_is_to_the_nearest_point(kind, row, unknowns, places):
    nearest = np.array([np.hypot(*(along(kind, row) - p).T).min() for p in places])
    close = nearest < 12 if kind == CUBIC else np.full(len(places), True)  # from far away Newton may take another hill
    t, normal, signed = edge_feet(kind, row, places)
    assert np.abs(signed)[close] == pytest.approx(nearest[close], abs=2e-3)
    assert np.hypot(*normal.T) == pytest.approx(np.ones(len(places)))
    assert ((t >= 0) & (t <= 1)).all()


@pytest.mark.parametrize(("kind", "row", "unknowns"), EDGES)
def test_left_is_positive(kind, row, unknowns):
    path = along(kind, row)
    middle, ahead = path[10000], path[10001] - path[9999]
    left = np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead)
    signed = edge_feet(kind, row, np.array([middle + 2 * left, middle - 2 * left]))[2]
    assert signed == pytest.approx([2, -2], abs=1e-3)


@pytest.mark.parametrize(("kind", "row", "unknowns"), EDGES)
def test_derivatives(kind, row, unknowns, places):
    path = along(kind, row, 60)
    points = path + np.random.default_rng(1).normal(0, 2, path.shape)
    signed, slope = edge_residuals(kind, row, points)
    kept = np.abs(signed) > 0.05  # on the edge's own ends the distance has a kink
    for k in range(unknowns):
        step = np.zeros(WIDTH)
        step[k] = 1e-5
        change = (edge_residuals(kind, row + step, points)[0] - edge_residuals(kind, row - step, points)[0]) / 2e-5
        assert slope[kept, k] == pytest.approx(change[kept], abs=2e-4), k
    assert not slope[:, unknowns:].any()


def test_samples_near_a_node_go_to_the_nearer_edge():
    edges = np.zeros((4, WIDTH))
    corners = np.array([(0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0)])
    edges[:, :4] = np.c_[corners, np.roll(corners, -1, axis=0)]
    points = np.concatenate(
        [np.linspace(a, b, 50, endpoint=False) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
    )
    ranges = np.array([(5, 55), (55, 105), (105, 155), (155, 205)])  # wrong by five samples, round the loop
    distance, edge = assigned(np.full(4, LINE), edges, ranges, points, 10)
    assert distance == pytest.approx(np.zeros(200), abs=1e-9)
    assert (np.bincount(edge) >= 49).all()
    far = assigned(np.full(4, LINE), edges, ranges, points, 1)[0]
    assert np.abs(far).max() > 4, "beyond the reach a sample stays with its range"


def test_normal_matrix_is_the_sum_over_samples():
    kinds, edges = np.array([CUBIC, LINE]), np.array([CUBIC_ROW, [90.0, 25.0, 10.0, 5.0, 0, 0, 0, 0]])
    points = np.concatenate([along(CUBIC, CUBIC_ROW, 40), along(LINE, edges[1], 40)])
    points = points + np.random.default_rng(2).normal(0, 0.5, points.shape)
    sigma, weight, edge = np.full(80, 0.4), np.full(80, 1.7), np.repeat([0, 1], 40)
    blocks, right, chi2 = normal_sums(kinds, edges, edge, points, sigma, weight, 4.0)
    total = 0.0
    for k in (0, 1):
        r, slope = edge_residuals(kinds[k], edges[k], points[edge == k])
        ratio = 1 + (r / 1.6) ** 2
        pull = blocks[k] - slope.T @ (slope * (1.7 / ratio**2)[:, None])
        chord = np.hypot(80, 20)  # handles are pulled to its thirds; nothing else is
        handles = [0] * 4 + [0.25 / chord**2 if kinds[k] == CUBIC else 0] * 4
        assert pull == pytest.approx(np.diag(handles), abs=1e-9)
        assert right[k, :4] == pytest.approx(-(slope.T @ (1.7 / ratio**2 * r))[:4])
        total += float((1.7 * r**2 / ratio).sum())
    assert chi2 == pytest.approx(total)
