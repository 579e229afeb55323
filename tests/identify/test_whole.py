"""Boards made whole: run on to what they end on, filled out in the dark, parted at gaps that stereo spanned."""

import numpy as np
import pytest
import shapely
from shapely.geometry import box

from clouds import cloud_only, pose, sheet
from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.gaps import filled_out
from kerfwright.identify.grooves import parted
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.reaching import Scene
from kerfwright.identify.run_on import run_on
from kerfwright.identify.visibility import Obstacles

BLIND = FreeSpace((), (), 1.0, 1.0)
OPTIONS = WholeOptions()
ROOM = np.array([[-200.0, -150, 0], [200, 150, 300]])  # spans the cloud; D is 400
UP = np.array([0.0, 0, 1])


class Open(FreeSpace):
    """Cameras that saw through everything."""

    def votes(self, x_in_world):
        return np.full(len(x_in_world), 9)


def cloud_of(points: np.ndarray, normals: np.ndarray) -> Cloud:
    return Cloud(np.concatenate([ROOM, points]), np.concatenate([np.tile(UP, (2, 1)), normals]))


def scene(sheets, cloud, free=BLIND) -> Scene:
    return Scene(tuple(sheets), cloud, Photos(cloud_only(cloud)), Obstacles(sheets, 400 / 60), free, OPTIONS)


def shelf_and_foot(top: float):
    """A level board whose underside is at z = 200, and an upright one under it that the cloud shows up to `top`."""
    shelf = sheet("shelf", pose((0, 0, 200)), 18.0, (-150, 0, 150, 100))
    foot = sheet("foot", pose((0, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 0, 100, top))
    return shelf, foot


def test_a_board_that_fades_out_goes_on_to_the_one_above():
    sheets = shelf_and_foot(160)
    (shelf, foot), joints = run_on(scene(sheets, cloud_of(np.zeros((0, 3)), np.zeros((0, 3)))))
    assert foot.region.bounds == pytest.approx((0, 0, 100, 200), abs=2.0)
    assert [(j.a, j.b) for j in joints] == [(0, 1)]
    assert shelf.region.equals(sheets[0].region)


def test_a_board_whose_end_is_seen_stays():
    shelf, foot = shelf_and_foot(160)
    y = np.arange(0, 100, 2.0)
    end = np.stack([np.full(len(y), 9.0), y, np.full(len(y), 160.0)], axis=1)
    cloud = cloud_of(end, np.tile(UP, (len(y), 1)))
    ended = sheet("foot", foot.world_from_board, 18.0, foot.region, cut_idx=np.arange(2, 2 + len(y)))
    assert run_on(scene((shelf, ended), cloud))[0][1].region.bounds[3] == pytest.approx(160)


def test_a_board_over_which_cameras_saw_stays():
    sheets, cloud = shelf_and_foot(160), cloud_of(np.zeros((0, 3)), np.zeros((0, 3)))
    free = Open((), (), 1.0, 1.0)
    assert run_on(scene(sheets, cloud, free))[0][1].region.bounds[3] == pytest.approx(160)


def test_a_foot_that_ends_near_the_floor_stands_on_it():
    foot = sheet("foot", pose((0, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 7, 100, 150))
    (found,), _ = run_on(scene((foot,), cloud_of(np.zeros((0, 3)), np.zeros((0, 3)))))
    assert found.region.bounds[1] == pytest.approx(0, abs=0.1)


def face(low_x, low_y, high_x, high_y, spacing, z=18.0):
    """Points all over a rectangle."""
    x, y = np.meshgrid(np.arange(low_x + spacing / 2, high_x, spacing), np.arange(low_y + spacing / 2, high_y, spacing))
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)


def board_seen(name, region, points, start, **rest):
    return sheet(name, pose(), 18.0, region, top_idx=np.arange(start, start + len(points)), **rest)


@pytest.mark.parametrize(
    ("spacing", "arm", "filled"), [(8.0, -60, True), (2.8, -60, False), (2.0, -60, False), (8.0, 120, False)]
)
def test_bays_of_a_board_in_the_dark_are_filled(spacing, arm, filled):
    """Beside boards seen well, one of an L's shape: in rags its bay is the cloud's, else it is the wood's, as an arch
    in the dark is; a small bay is left to the photographs.
    """
    ell = shapely.union_all([box(-150, -100, 150, 0), box(-150, -100, arm, 100)])
    well, rags = face(-150, -100, 150, 100, 2.0), face(-150, -100, 150, 100, spacing)
    rags = rags[shapely.contains_xy(ell, rags[:, 0], rags[:, 1])]
    points = np.concatenate([well, well, rags])
    cloud = cloud_of(points, np.tile(UP, (len(points), 1)))
    whole = box(-150, -100, 150, 100)
    boards = (
        board_seen("well", whole, well, 2), board_seen("twin", whole, well, 2 + len(well)),
        board_seen("rags", ell, rags, 2 + 2 * len(well)),
    )
    assert (filled_out(boards, cloud, BLIND, OPTIONS)[2].region.area > 1.01 * ell.area) == filled


def tops(gap: float, sag: float, turn: float = 0.0, spacing: float = 1.5):
    """Two boards side by side, taken for one by stereo that sags by so much over the gap, or shows little there."""
    points = face(-150, -100, 150, 100, spacing)
    over = np.abs(points[:, 1]) < gap / 2
    points[over, 2] -= sag
    points = points if sag else points[~over | (np.arange(len(points)) % 5 == 0)]
    c, s = np.cos(turn), np.sin(turn)
    points[:, :2] = points[:, :2] @ np.array([[c, s], [-s, c]])
    cloud = cloud_of(points, np.tile(UP, (len(points), 1)))
    region = shapely.affinity.rotate(box(-150, -100, 150, 100), turn, (0, 0), use_radians=True)
    return board_seen("board_01", region, points, 2), cloud


@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_boards_side_by_side_are_parted_at_the_gap(turn):
    board, cloud = tops(8.0, 1.5, turn)
    (one, other), names = parted((board,), cloud)
    assert one.region.distance(other.region) == pytest.approx(8.0, abs=2.0)
    assert min(one.region.area, other.region.area) == pytest.approx(300 * 96, rel=0.03)
    assert [one.name, other.name] == ["board_01", "board_02"]
    assert names == {"board_01": ("board_01", "board_02")}
    assert len(one.top_idx) + len(other.top_idx) < len(board.top_idx), "each has its own points"


@pytest.mark.parametrize(("gap", "sag"), [(8.0, 0.2), (8.0, 0.0), (1.0, 1.5), (40.0, 1.5)])
def test_what_is_no_groove_parts_nothing(gap, sag):
    """Noise; a dark stripe that stereo missed; eased edges of boards that touch; a step as wide as a board."""
    board, cloud = tops(gap, sag)
    assert parted((board,), cloud)[0] == (board,)


def test_a_board_that_stands_in_the_groove_explains_it():
    board, cloud = tops(8.0, 1.5)
    fin = sheet("fin", pose((0, -4, 18), (1, 0, 0), (0, 0, 1)), 8.0, (-150, 0, 150, 90))
    assert [s.name for s in parted((board, fin), cloud)[0]] == ["board_01", "fin"]


def test_a_groove_that_stops_short_parts_nothing():
    board, cloud = tops(8.0, 1.5)
    points = cloud.points.copy()
    points[points[:, 0] > 60, 2] = np.where(points[points[:, 0] > 60, 2] < 200, 18.0, 300.0)
    assert len(parted((board,), Cloud(points, cloud.normals))[0]) == 1
