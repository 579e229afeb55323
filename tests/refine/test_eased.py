"""Boundaries of boards whose edges are rounded over, moved outward to the points on their cut faces."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import box
from shapely.geometry.polygon import orient

from clouds import pose, sheet
from kerfwright.assemble.types import ConstraintSegment
from kerfwright.refine import BoundaryLoop
from kerfwright.refine.eased import moved_to_cut_faces, stereo_of

THICKNESS, DIAMETER, NOISE = 18.0, 300.0, 0.1
TRUE = box(0, 0, 200, 120)
LEFT = ConstraintSegment(np.array([0.0, 120]), np.array([0.0, 0]), "contact", 0.15)


def traced(inside: float) -> tuple[BoundaryLoop, ...]:
    """The boundary as the photographs show it, that much inside the board; the left side on its contact."""
    points = np.array(box(0, inside, 200 - inside, 120 - inside).segmentize(1.0).exterior.coords)[:-1]
    return (BoundaryLoop(points, np.full(len(points), 0.2)),)


def cloud(bias: float, sides: tuple[int, ...] = (0, 1, 2)) -> SimpleNamespace:
    """Points on three cut faces of the board, on its top, all `bias` too far out."""
    rng = np.random.default_rng(1)
    corners = np.array([(200, 0), (200, 120), (0, 120), (0, 0)], float)
    outward = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)], float)
    points, normals = [], []
    for k in sides:
        off = rng.normal(bias, NOISE, (1500, 1))
        flat = corners[k] + rng.random((1500, 1)) * (corners[(k + 1) % 4] - corners[k]) + off * outward[k]
        points.append(np.column_stack([flat, rng.uniform(2, 16, 1500)]))
        normals.append(np.tile([*outward[k], 0.0], (1500, 1)))
    top = np.column_stack([rng.uniform(5, 115, (500, 2)), THICKNESS + rng.normal(bias, NOISE, 500)])
    points, normals = np.vstack([top, *points]), np.vstack([np.tile([0, 0, 1.0], (500, 1)), *normals])
    return SimpleNamespace(points=points, normals=normals, diameter=DIAMETER)


def moved(inside: float, bias: float, **options):
    points = cloud(bias, **options)
    board = sheet("board_01", pose((0, 0, 0)), THICKNESS, TRUE, top_idx=np.arange(500))
    loops = traced(inside)
    return loops, moved_to_cut_faces(loops, board, (LEFT,), points, stereo_of((board,), points))


@pytest.mark.parametrize("bias", [0.0, 0.4])
def test_an_eased_board_is_as_large_as_its_cut_faces_say(bias):
    _, (loop,) = moved(1.2, bias)
    assert loop.points[:, 0].max() == pytest.approx(200, abs=0.15)
    assert loop.points[:, 1].max() == pytest.approx(120, abs=0.15)


def test_sides_that_no_points_show_are_eased_as_much():
    _, (loop,) = moved(1.2, 0.0, sides=(0, 1))
    assert loop.points[:, 1].min() == pytest.approx(0, abs=0.25)


def test_a_board_traced_much_too_small_grows_only_where_points_show_it():
    before, (loop,) = moved(3.0, 0.0, sides=(0, 1))
    assert loop.points[:, 0].max() == pytest.approx(200, abs=0.15)
    below = (before[0].points[:, 1] < 3.5) & (before[0].points[:, 0] < 190)
    assert np.array_equal(loop.points[below], before[0].points[below])


def test_a_bite_is_taken_off_where_cut_faces_show_the_edge():
    bite = box(60, 118.5, 90, 130)
    points = np.array(orient(TRUE.difference(bite)).segmentize(1.0).exterior.coords)[:-1]
    loops = (BoundaryLoop(points, np.full(len(points), 0.2)),)
    seen = cloud(0.0)
    board = sheet("board_01", pose((0, 0, 0)), THICKNESS, TRUE, top_idx=np.arange(500))
    (loop,) = moved_to_cut_faces(loops, board, (LEFT,), seen, stereo_of((board,), seen))
    bitten = (points[:, 0] > 64) & (points[:, 0] < 86) & (points[:, 1] > 110)
    assert loop.points[bitten, 1] == pytest.approx(120, abs=0.2)
    assert np.array_equal(loop.points[points[:, 1] < 110], points[points[:, 1] < 110])


def test_what_lies_on_a_contact_stays_there():
    before, (loop,) = moved(1.2, 0.0)
    on = before[0].points[:, 0] < 1e-9
    assert np.array_equal(loop.points[on], before[0].points[on])


@pytest.mark.parametrize(("inside", "bias"), [(0.0, 0.0), (0.2, 0.0), (0.0, 0.5)])
def test_boundaries_that_agree_with_the_cloud_less_its_bias_stay(inside, bias):
    before, after = moved(inside, bias)
    assert after is before


def test_without_faces_nothing_is_known_of_the_cloud():
    board = sheet("board_01", pose((0, 0, 0)), THICKNESS, TRUE)
    stereo = stereo_of((board,), cloud(0.0))
    assert (stereo.bias, stereo.noise) == (0.0, np.inf)


def test_the_face_of_a_thin_board_on_an_edge_is_not_where_that_edge_ends():
    seen = cloud(0.0)
    board = sheet("board_01", pose((0, 0, 0)), THICKNESS, TRUE, top_idx=np.arange(500))
    back = sheet("board_02", pose((0, 0, 0)), 1.2, TRUE, top_idx=np.arange(500, len(seen.points)))
    loops = traced(1.2)
    stereo = replace(stereo_of((board,), seen), on_faces=stereo_of((board, back), seen).on_faces)
    assert moved_to_cut_faces(loops, board, (LEFT,), seen, stereo) is loops
