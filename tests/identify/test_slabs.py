from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from clouds import box_cloud, pose
from kerfwright.identify import IdentifyOptions
from kerfwright.identify.bars import Bar
from kerfwright.identify.primitives import look_around
from kerfwright.identify.sheets import join_across, to_sheet
from kerfwright.identify.slabs import (
    Slab,
    _above_floor,
    _ends_above,
    _is_air,
    _is_parted,
    _Scene,
    footprint,
    plane_frame,
)
from kerfwright.identify.thickness import ThicknessHypothesis
from kerfwright.model import Origin

REACH = 4.0


def slab(frame, region, thickness=18.0, evidence="opposite", error=0.2, **rest) -> Slab:
    sides = {"top": (), "bottom": (), "free_share": 0.0} | rest
    return Slab(frame, ThicknessHypothesis(thickness, error, evidence, 1.0), region, **sides)


def shelf_pieces(**rest) -> list[Slab]:
    """A shelf at z = 0..18 in two pieces, 18 mm apart about x = 0."""
    return [slab(pose(), box(-150, 0, -9, 100), top=(0,)), slab(pose(), box(9, 0, 150, 100), top=(1,), **rest)]


def upright(low: float, high: float) -> Slab:
    """A board across the gap: x from -9 to 9, z from low to high."""
    return slab(pose((-9, 0, 0), (0, 1, 0), (0, 0, 1)), box(0, low, 100, high))


def test_pieces_are_joined_over_the_end_of_another_board():
    """The board below stops at the shelf: its end covers the gap in the points of the shelf's underside."""
    below = upright(-200, 0)
    joined = join_across([*shelf_pieces(), below], REACH)
    assert len(joined) == 2
    assert joined[0] is below
    assert joined[1].region.symmetric_difference(box(-150, 0, 150, 100)).area < 20
    assert joined[1].top == (0, 1)


def test_pieces_stay_apart_where_another_board_runs_through():
    assert len(join_across([*shelf_pieces(), upright(-200, 218)], REACH)) == 3


def test_pieces_stay_apart_where_nothing_covers_the_gap():
    assert len(join_across(shelf_pieces(), REACH)) == 2
    elsewhere = slab(pose((300, 0, 0), (0, 1, 0), (0, 0, 1)), box(0, -200, 100, 0))
    assert len(join_across([*shelf_pieces(), elsewhere], REACH)) == 3


def test_pieces_at_other_heights_stay_apart():
    left, right = shelf_pieces()
    higher = slab(pose((0, 0, 10)), right.region)
    assert len(join_across([left, higher, upright(-200, 0)], REACH)) == 3


def test_three_pieces_become_one():
    left, right = shelf_pieces()
    far = slab(pose(), box(168, 0, 300, 100))
    ends = [upright(-200, 0), slab(pose((150, 0, 0), (0, 1, 0), (0, 0, 1)), box(0, -200, 100, 0))]
    joined = join_across([left, right, far, *ends], REACH)
    assert len(joined) == 3
    assert joined[-1].region.area == pytest.approx(450 * 100, rel=1e-3)


def test_the_better_known_thickness_stays():
    left, right = shelf_pieces(error=0.01)
    right = slab(pose(), right.region, thickness=18.3, error=0.01)
    assert join_across([left, right, upright(-200, 0)], REACH)[-1].thickness.value == 18.3


def test_footprint_is_the_section_of_the_other_board():
    shelf = slab(pose(), box(-150, 0, 150, 100))
    assert footprint(upright(-200, 218), shelf).equals_exact(box(-9, 0, 9, 100), 1e-9) or footprint(
        upright(-200, 218), shelf
    ).symmetric_difference(box(-9, 0, 9, 100)).area == pytest.approx(0, abs=1e-6)
    assert footprint(upright(30, 200), shelf).is_empty


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (0.6, 0, 0.8), (0.48, 0.6, -0.64)])
def test_plane_frame_is_right_handed_with_y_upward(normal):
    frame = plane_frame(np.array(normal, float), np.array([1.0, 2, 3]))
    assert frame[:3, :3] @ frame[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert frame[:3, 2] == pytest.approx(normal)
    assert frame[:3, 3].tolist() == [1, 2, 3]
    assert frame[2, 1] > 0.1 or abs(normal[2]) >= 0.9


def test_perimeters_of_holes_count_in_the_cut_surface():
    plate = slab(pose(), box(0, 0, 100, 100), thickness=10.0)
    ring = slab(pose(), box(0, 0, 100, 100).difference(box(10, 10, 90, 90)), thickness=10.0)
    assert plate.cut_ratio == pytest.approx(400 * 10 / 1e4)
    assert ring.cut_ratio == pytest.approx(720 * 10 / 3600)
    assert ring.volume == pytest.approx(36000)


@pytest.fixture(scope="module")
def board():
    """A rough sheet made of a slab 4 mm too large all round, over a cloud of the true board."""
    cloud = box_cloud(((-150, -100, 0), (150, 100, 20)), spacing=3.0)
    around = look_around(cloud, IdentifyOptions())
    rough = slab(pose(), box(-154, -104, 154, 104), thickness=20.0)
    return cloud, to_sheet("board_01", rough, cloud, around, IdentifyOptions())


def test_rough_board_ends_at_its_cut_faces(board):
    _, sheet = board
    assert sheet.region.symmetric_difference(box(-150, -100, 150, 100)).area / 1000 < 0.5
    assert sheet.thickness.value == 20.0
    assert sheet.thickness.origin is Origin.MEASURED
    assert sheet.thickness_seen


def test_rough_board_knows_its_points(board):
    cloud, sheet = board
    top, bottom, cut = sheet.top_idx, sheet.bottom_idx, sheet.cut_idx
    assert cloud.points[top, 2] == pytest.approx(20, abs=1.1)
    assert cloud.points[bottom, 2] == pytest.approx(0, abs=1.1)
    assert (np.abs(cloud.normals[cut, 2]) < 0.5).mean() > 0.95
    assert not (set(top) & set(bottom) or set(top) & set(cut) or set(bottom) & set(cut))
    assert len(top) + len(bottom) + len(cut) > 0.9 * len(cloud)


def test_inferred_thickness_is_not_called_seen():
    cloud = box_cloud(((-150, -100, 0), (150, 100, 20)), spacing=3.0)
    rough = slab(pose(), box(-150, -100, 150, 100), 20.0, evidence="inferred")
    sheet = to_sheet("b", rough, cloud, look_around(cloud, IdentifyOptions()), IdentifyOptions())
    assert not sheet.thickness_seen
    assert sheet.thickness.origin is Origin.INFERRED


def edge(value: float, support: float) -> ThicknessHypothesis:
    return ThicknessHypothesis(value, 0.1, "photos", support)


@pytest.mark.parametrize(("photos", "above"), [
    ([edge(9.0, 4.2), edge(30.0, 2.4)], True), ([edge(9.0, 4.2), edge(30.0, 4.0)], False), ([edge(9.0, 3.0)], False),
    ([edge(30.0, 5.0)], False), ([], False),
])  # fmt: skip
def test_a_clear_end_above_the_floor_is_believed(photos, above):
    assert _ends_above(photos, 30.0) is above


@pytest.mark.parametrize(("height", "value", "evidence"), [
    (8.0, 8.0, "ground"), (30.0, 16.0, "inferred"), (1.0, 16.0, "inferred"),
])  # fmt: skip
def test_no_guessed_thickness_goes_through_the_floor(height, value, evidence):
    scene = SimpleNamespace(thickness_limits=(2.0, 80.0), around=SimpleNamespace(noise=0.2))
    guess = ThicknessHypothesis(16.0, 6.0, "inferred", 1.0)
    level = _above_floor(guess, plane_frame(np.array([0, 0, 1.0]), np.array([0, 0, height])), scene)
    assert (level.value, level.evidence) == (value, evidence)
    upright_frame = plane_frame(np.array([1.0, 0, 0]), np.array([0, 0, height]))
    assert _above_floor(guess, upright_frame, scene) is guess


@pytest.mark.parametrize(("frame", "parted"), [
    (box(-200, 0, 200, 300), True),  # goes on to both sides of the feet
    (box(-200, 0, 12, 300), False),  # ends with them: they may go on
])  # fmt: skip
def test_feet_on_both_sides_of_a_frame_are_no_bar(frame, parted):
    """A frame at y = -10..10 with a foot 20 mm thick before and behind it, x = -10..10, and the bar between their ends.
    """
    upright = np.array([[1.0, 0, 0, 0], [0, 0, -1, 10], [0, 1, 0, 0], [0, 0, 0, 1]])
    across = slab(upright, frame.difference(box(-10, 0, 10, 50)), 20.0)
    spans = ((10, 0, 90, 50), (-90, 0, -10, 50))
    feet = [slab(pose((-10, 0, 0), (0, 1, 0), (0, 0, 1)), box(*span), 20.0) for span in spans]
    bar_frame = np.array([[0, 0, 1.0, -10], [0, 1, 0, 0], [-1, 0, 0, 25], [0, 0, 0, 1]])
    bar = Bar(bar_frame, ThicknessHypothesis(20.0, 0.1, "ends", 1.0), box(-25, -90, 25, 90), (0, 1))
    ends = [np.array([[0.0, y, z] for z in (10, 25, 40)]) for y in (90.0, -90.0)]
    assert _is_parted(SimpleNamespace(fringe=8.0), bar, ends, [across, *feet]) is parted
    assert not _is_parted(SimpleNamespace(fringe=8.0), bar, ends, feet)


def seen_through_at(x: float) -> _Scene:
    """A scene of D = 500 in which cameras saw through a layer of 20 mm about some x: one compartment of a row."""
    cloud = SimpleNamespace(diameter=500.0)
    free = SimpleNamespace(votes=lambda places: np.where(np.abs(places[:, 0] - x) < 10, 3, 0))
    around = SimpleNamespace(spacing=1.0)
    return _Scene(SimpleNamespace(cloud=cloud), around, [], free, IdentifyOptions(), None)


@pytest.mark.parametrize(("thickness", "x", "air"), [(60.0, 40, True), (60.0, 900, False), (24.0, 40, False)])
def test_a_thickness_that_reaches_through_a_compartment_is_none(thickness, x, air):
    frame = plane_frame(np.array([0.0, 0, 1]), np.array([0.0, 0, 100]))
    corners = np.array([[0.0, 0, 100], [400, 0, 100], [400, 80, 100], [0, 80, 100]])
    piece = Polygon(((corners - frame[:3, 3]) @ frame[:3, :3])[:, :2])
    guess = ThicknessHypothesis(thickness, 0.2, "photos", 5.0)
    assert _is_air(seen_through_at(x), frame, piece, guess) == air


def test_only_thick_boards_must_not_be_seen_through_at_all():
    scene = seen_through_at(0)
    assert (scene.most_free(24.0), scene.most_free(26.0)) == (0.25, 0.02)
