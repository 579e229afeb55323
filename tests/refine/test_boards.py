import numpy as np
import pytest

from clouds import pose, sheet, turned
from kerfwright.assemble.types import ConstraintSegment
from kerfwright.model import Circle, CutPath, Loop
from kerfwright.model.frames import matrix
from kerfwright.model.geometry import sample_loop, signed_area
from kerfwright.refine.boards import to_board
from simple import polygon

UPRIGHT = pose((30, 40, 50), (0, 1, 0), (0, 0, 1))


def rotated(points, degrees: float) -> list[tuple[float, float]]:
    turn = turned("z", degrees)[:2, :2]
    return [tuple(turn @ np.array(p) + [7.0, -4.0]) for p in points]


SHAPE = [(0, 0), (50, 0), (50, 120), (10, 120), (0, 100)]  # longest edge: 120 along y


def made(points, frame=UPRIGHT, segments=()):
    path = CutPath(outer=polygon(points))
    return to_board(sheet("b", frame, 18.0, (0, 0, 1, 1)), path, segments, "images", ("a note",))


@pytest.mark.parametrize("degrees", [0.0, 33.0, 180.0, -71.0])
def test_x_runs_along_the_longest_edge_and_the_corner_is_the_origin(degrees):
    board = made(rotated(SHAPE, degrees))
    points = sample_loop(board.cut_path.outer)
    assert points.min(axis=0) == pytest.approx([0, 0], abs=1e-9)
    assert points.max(axis=0) == pytest.approx([120, 50], abs=1e-9)
    first = max(board.cut_path.outer.edges, key=lambda e: np.hypot(*np.subtract(e.end, e.start)))
    assert np.subtract(first.end, first.start) == pytest.approx([120, 0], abs=1e-9)


@pytest.mark.parametrize("degrees", [0.0, 33.0, -71.0])
def test_the_material_stays_where_it_was(degrees):
    points = rotated(SHAPE, degrees)
    board = made(points)
    before = np.c_[np.array(points), np.zeros(5)] @ UPRIGHT[:3, :3].T + UPRIGHT[:3, 3]
    own = np.array([e.start for e in board.cut_path.outer.edges])
    frame = matrix(board.model_from_board)
    assert np.c_[own, np.zeros(5)] @ frame[:3, :3].T + frame[:3, 3] == pytest.approx(before, abs=1e-9)
    assert frame[:3, :3] @ frame[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    assert frame[:3, 2] == pytest.approx(UPRIGHT[:3, 2])
    assert signed_area(board.cut_path.outer) == pytest.approx(signed_area(polygon(points)))


def test_what_is_known_of_the_board_is_handed_on():
    board = made(SHAPE)
    assert (board.name, board.outline_origin, board.notes) == ("b", "images", ("a note",))
    assert board.thickness.value == 18.0
    assert board.bevels == ()


def test_a_round_board_lies_at_the_origin():
    path = CutPath(outer=Loop(edges=(Circle(centre=(40.0, 30.0), radius=25.0),)))
    board = to_board(sheet("disc", UPRIGHT, 18.0, (0, 0, 1, 1)), path, (), "cloud")
    (circle,) = board.cut_path.outer.edges
    assert circle.centre == pytest.approx((25.0, 25.0))
    frame = matrix(board.model_from_board)
    assert frame[:3, :3] @ [25, 25, 0] + frame[:3, 3] == pytest.approx(UPRIGHT[:3, :3] @ [40, 30, 0] + UPRIGHT[:3, 3])


def slanted(degrees: float, depth: float = 0.0) -> ConstraintSegment:
    """Along the edge y = 120 from x = 50 to 10; wood below."""
    normal = np.array([0, np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    return ConstraintSegment(np.array([50.0, 120]), np.array([10.0, 120]), "contact", 0.15, normal, depth, contact=3)


@pytest.mark.parametrize("degrees", [15.0, -30.0])
def test_a_slanted_segment_becomes_a_bevel(degrees):
    board = made(SHAPE, segments=(slanted(degrees, depth=18.0),))
    (bevel,) = board.bevels
    assert bevel.angle.value == pytest.approx(degrees)
    assert bevel.contact == 3
    frame = matrix(board.model_from_board)
    expected = UPRIGHT[:3, :3] @ slanted(degrees).normal
    assert frame[:3, :3] @ np.array(bevel.normal) == pytest.approx(expected)
    place = frame[:3, :3] @ np.array(bevel.point) + frame[:3, 3]
    assert place == pytest.approx(UPRIGHT[:3, :3] @ [30, 120, 18] + UPRIGHT[:3, 3])
    assert np.linalg.norm(np.subtract(bevel.end, bevel.start)) == pytest.approx(40)


def test_a_segment_that_no_edge_follows_makes_no_bevel():
    away = slanted(15.0)
    shift = np.array([0.0, 5.0])
    moved = ConstraintSegment(away.start + shift, away.end + shift, "contact", 0.15, away.normal, 0.0, contact=3)
    assert made(SHAPE, segments=(moved,)).bevels == ()


def test_a_square_cut_is_no_bevel():
    square = ConstraintSegment(np.array([50.0, 120]), np.array([10.0, 120]), "contact", 0.15)
    assert made(SHAPE, segments=(square,)).bevels == ()
