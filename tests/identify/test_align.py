"""Boards whose points say almost, but not quite, that they are square."""

from dataclasses import replace

import numpy as np
import pytest

from clouds import sheet, turned
from kerfwright.assemble import AssembleOptions
from kerfwright.capture.types import Cloud
from kerfwright.identify.align import align_sheets
from kerfwright.identify.primitives import plane_fit

OPTIONS = AssembleOptions()
Z, X, Y = np.eye(4), turned("y", 90.0), turned("x", -90.0)


def boards(*frames: np.ndarray, thickness: float = 18.0, size: float = 300.0, noise: float = 0.15):
    """Sheets whose frames are fitted to noisy points of their two sides, and the cloud."""
    rng = np.random.default_rng(2)
    sheets, points, normals = [], [], []
    for k, frame in enumerate(frames):
        both = []
        for z, sign in ((thickness, 1.0), (0.0, -1.0)):
            x = np.c_[rng.uniform(0, size, (800, 2)), np.full(800, z)] + noise * rng.standard_normal((800, 3))
            both.append(sum(map(len, points)) + np.arange(800))
            points.append(x @ frame[:3, :3].T + frame[:3, 3])
            normals.append(np.tile(sign * frame[:3, 2], (800, 1)))
        sheets.append(sheet(f"b{k}", frame, thickness, (0, 0, size, size), top_idx=both[0], bottom_idx=both[1]))
    return tuple(sheets), Cloud(np.concatenate(points), np.concatenate(normals))


def at(frame: np.ndarray, x: float, y: float, z: float) -> np.ndarray:
    moved = frame.copy()
    moved[:3, 3] = x, y, z
    return moved


def square_residual(sheets) -> float:
    """How far from parallel or square the worst pair is."""
    dots = [abs(a.normal @ b.normal) for k, a in enumerate(sheets) for b in sheets[:k]]
    return max(min(d, abs(1 - d)) for d in dots)


def test_nearly_square_boards_become_exactly_square():
    frames = (Z, at(turned("y", 90.2), 0, 0, 300), at(turned("x", -90.25), 0, 300, 0))
    sheets, cloud = boards(*frames)
    assert square_residual(sheets) > 3e-3
    aligned, _ = align_sheets(sheets, cloud, OPTIONS)
    assert square_residual(aligned) < 1e-9


def test_redundant_equations_do_not_stop_the_solver():
    """Nine boards in three directions: every pair across directions says the same twice."""
    wobble = [(0.1, -0.15), (-0.12, 0.05), (0.02, 0.14)]
    frames = [
        at(turned("y", a) @ base @ turned("x", b), 400.0 * k, 50.0 * n, 30.0 * k)
        for n, base in enumerate((Z, X, Y))
        for k, (a, b) in enumerate(wobble)
    ]
    aligned, errors = align_sheets(*boards(*frames), OPTIONS)
    assert square_residual(aligned) < 1e-9
    assert len(errors) == 9


@pytest.mark.parametrize("degrees", [5.0, 20.0])
def test_a_tilted_board_stays_tilted(degrees):
    sheets, cloud = boards(Z, at(X, 0, 0, 300), at(turned("y", 90.0 - degrees), 400, 0, 300))
    aligned, _ = align_sheets(sheets, cloud, OPTIONS)
    tilt = np.degrees(np.arccos(abs(aligned[1].normal @ aligned[2].normal)))
    assert tilt == pytest.approx(degrees, abs=0.05)
    assert abs(aligned[0].normal @ aligned[1].normal) < 1e-9


def test_each_board_keeps_its_own_offset():
    """Three parallel boards share a direction; none of them drifts from its points."""
    sheets, cloud = boards(Z, at(turned("y", 0.2), 100, 50, 200), at(turned("x", 0.25), -40, 10, 431.7))
    aligned, _ = align_sheets(sheets, cloud, OPTIONS)
    for before, after in zip(sheets, aligned, strict=True):
        assert after.normal == pytest.approx(aligned[0].normal, abs=1e-12)
        tops = after.to_board(cloud.points[before.top_idx])[:, 2]
        assert np.median(tops) == pytest.approx(after.thickness.value, abs=0.12)


def test_one_direction_is_fitted_to_all_boards_that_share_it():
    """The mean of four boards is nearer to the truth than their worst is."""
    frames = [at(turned("x", a), 0, 0, 100.0 * k) for k, a in enumerate((0.12, -0.12, 0.06, -0.06))]
    aligned, _ = align_sheets(*boards(*frames), OPTIONS)
    assert np.degrees(np.arccos(min(aligned[0].normal[2], 1.0))) < 0.05  # degrees; the worst is off by 0.12


@pytest.mark.parametrize("noise", [1e-6, 0.0])
def test_alignment_leaves_exact_boards_where_they_are(noise):
    sheets, cloud = boards(Z, at(X, 0, 0, 300), noise=noise)
    aligned, _ = align_sheets(sheets, cloud, OPTIONS)
    for before, after in zip(sheets, aligned, strict=True):
        assert after.world_from_board == pytest.approx(before.world_from_board, abs=1e-5)


def test_a_sharper_cloud_gives_a_smaller_angular_error():
    sharp, blurred = (align_sheets(*boards(Z, noise=n), OPTIONS)[1][0] for n in (0.05, 0.5))
    assert sharp < blurred / 5
    assert plane_fit(np.eye(3).repeat(2, 0), np.array([0, 0, 1.0]))[0] @ [0, 0, 1.0] > 0


def test_same_boards_give_the_same_bytes():
    sheets, cloud = boards(Z, at(turned("y", 90.2), 0, 0, 300))
    first, second = (align_sheets(sheets, cloud, OPTIONS)[0] for _ in range(2))
    assert [s.world_from_board.tobytes() for s in first] == [s.world_from_board.tobytes() for s in second]


def test_a_few_points_of_the_other_side_move_no_board():
    """Thickness or points of a hardly seen underside may be wrong; the top is where its many points are."""
    (board,), cloud = boards(Z)
    rng = np.random.default_rng(7)
    stray = np.c_[rng.uniform(0, 300, (40, 2)), np.full(40, -1.0) + 0.1 * rng.standard_normal(40)]
    cloud = Cloud(np.r_[cloud.points, stray], np.r_[cloud.normals, np.tile([0, 0, -1.0], (40, 1))])
    board = replace(board, bottom_idx=len(cloud.points) - 40 + np.arange(40))
    (aligned,), _ = align_sheets((board,), cloud, OPTIONS)
    tops = aligned.to_board(cloud.points[board.top_idx])[:, 2]
    assert np.median(tops) == pytest.approx(18.0, abs=0.2)
