import numpy as np
import pytest
from shapely.geometry import box

from clouds import box_cloud, pose, shelf_capture
from kerfwright.capture.types import Cloud
from kerfwright.identify import IdentifyOptions
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.primitives import find_planes, look_around
from kerfwright.identify.rims import trace_rim
from kerfwright.identify.thickness import (
    ThicknessHypothesis,
    from_cut_faces,
    from_opposite,
    from_photos,
    reaches_ground,
    sharpened,
)

BOARD = ((-150, -100, 0), (150, 100, 20))
REGION = box(-150, -100, 150, 100)
TOP = pose((0, 0, 20))
LIMITS = (2.0, 60.0)
OPTIONS = IdentifyOptions()


@pytest.fixture(scope="module")
def seen():
    cloud = box_cloud(BOARD, spacing=3.0)
    around = look_around(cloud, OPTIONS)
    return cloud, around, find_planes(cloud, around, OPTIONS)


def opposite(seen, region=REGION, limits=LIMITS):
    cloud, _, planes = seen
    return from_opposite(TOP, region, planes, cloud.points, limits, 4.0)


def test_opposite_plane_gives_the_thickness(seen):
    (found,) = opposite(seen)
    assert found.value == pytest.approx(20, abs=0.05)
    assert found.evidence == "opposite"
    assert found.support == pytest.approx(REGION.area, rel=0.1)  # points near the corners lean too much to belong to it


def test_opposite_plane_elsewhere_or_out_of_limits_is_none(seen):
    assert opposite(seen, region=box(500, 0, 700, 100)) == []
    assert opposite(seen, limits=(2.0, 19.0)) == []
    assert opposite(seen, limits=(21.0, 60.0)) == []


def test_faces_that_look_the_same_way_are_not_opposite():
    """A shelf 40 mm lower shows its top: the gap is air, not wood."""
    cloud = box_cloud(BOARD, ((-150, -100, -40), (150, 100, -20)), spacing=4.0)
    planes = find_planes(cloud, look_around(cloud, OPTIONS), OPTIONS)
    values = [h.value for h in from_opposite(TOP, REGION, planes, cloud.points, (2.0, 100.0), 4.0)]
    assert sorted(values) == pytest.approx([20, 60], abs=0.1)


def test_cut_faces_end_at_the_thickness():
    """A board that lies on the floor: its underside was never seen."""
    cloud = box_cloud(BOARD, spacing=3.0)
    cloud = cloud.select(cloud.normals[:, 2] > -0.5)
    found = from_cut_faces(TOP, REGION, cloud, look_around(cloud, OPTIONS), LIMITS)
    assert found[0].evidence == "cut"
    assert found[0].value == pytest.approx(20, abs=1.5)
    assert abs(found[0].value - 20) < 2 * found[0].standard_error


def test_no_cut_faces_no_thickness():
    cloud = box_cloud(BOARD, spacing=3.0)
    cloud = cloud.select(np.abs(cloud.normals[:, 2]) > 0.5)
    assert from_cut_faces(TOP, REGION, cloud, look_around(cloud, OPTIONS), LIMITS) == []


@pytest.mark.parametrize(
    ("frame", "region", "truth"),
    [
        (pose((0, 0, 218)), box(-150, -90, 150, 90), 18.0),
        (pose((-120, 0, 100), (0, -1, 0), (0, 0, 1)), box(-80, -100, 80, 100), 15.0),
        (pose((120, 0, 100), (0, 1, 0), (0, 0, 1)), box(-80, -100, 80, 100), 15.0),
    ],
    ids=["top", "left", "right"],
)
def test_photographs_show_the_thickness_within_half_a_millimetre(frame, region, truth):
    """Two millimetres a pixel: the strongest edges behind the sheet plane's own."""
    capture = shelf_capture()
    around = look_around(capture.cloud, OPTIONS)
    diameter = capture.cloud.diameter
    rim = trace_rim(frame, region, capture.cloud, around, diameter / 40, spacing=diameter / 400, width=10.0)
    found = from_photos(frame, rim, Photos(capture), (diameter / 250, diameter / 6), step=diameter / 2000)
    assert min(abs(h.value - truth) for h in found[:2]) < 0.5


def test_photographs_sharpen_a_thickness_by_its_weight():
    coarse = ThicknessHypothesis(18.4, 0.4, "opposite", 1000.0)
    sharp = ThicknessHypothesis(18.0, 0.2, "photos", 5.0)
    found = sharpened(coarse, [sharp])
    assert found.value == pytest.approx((18.4 / 0.16 + 18.0 / 0.04) / (1 / 0.16 + 1 / 0.04))
    assert found.standard_error == pytest.approx((1 / 0.16 + 1 / 0.04) ** -0.5)
    assert found.evidence == "opposite"


@pytest.mark.parametrize(("value", "support"), [(25.0, 9.0), (18.0, 1.2)], ids=["elsewhere", "faint"])
def test_photographs_that_say_something_else_change_nothing(value, support):
    coarse = ThicknessHypothesis(18.4, 0.4, "opposite", 1000.0)
    assert sharpened(coarse, [ThicknessHypothesis(value, 0.2, "photos", support)]) is coarse


SHELF_TOP = pose((0, 0, 30))
SHELF_REGION = box(0, 0, 300, 200)


@pytest.mark.parametrize(("boxes", "reaches"), [
    ([((0, 0, 0), (300, 200, 30))], True),  # solid down to the floor
    ([((0, 0, 22), (300, 200, 30))], False),  # air below
    ([((0, 0, 22), (300, 200, 30)), ((-5, -5, 0), (0, 205, 100)), ((300, -5, 0), (305, 205, 100))], False),
])  # fmt: skip
def test_only_cut_faces_of_its_own_take_a_board_down_to_the_floor(boxes, reaches):
    cloud = box_cloud(*boxes, spacing=3.0)
    assert reaches_ground(SHELF_TOP, SHELF_REGION, cloud, look_around(cloud, IdentifyOptions()), 30.0) is reaches


def test_strays_below_a_shelf_do_not_take_it_down_to_the_floor():
    rng = np.random.default_rng(3)
    shelf = box_cloud(((0, 0, 22), (300, 200, 30)), spacing=3.0)
    few = np.c_[rng.uniform(0, 300, 60), np.zeros(60), rng.uniform(0, 22, 60)]
    cloud = Cloud(np.concatenate([shelf.points, few]), np.concatenate([shelf.normals, np.tile([0, -1.0, 0], (60, 1))]))
    assert not reaches_ground(SHELF_TOP, SHELF_REGION, cloud, look_around(cloud, IdentifyOptions()), 30.0)
