"""A divider deep in a case: its front and back edges stand in the light, its faces are seen in rags."""

import numpy as np
import pytest

from clouds import box_cloud, cloud_only
from kerfwright.capture.types import Cloud
from kerfwright.identify import IdentifyOptions, identify

CASE = (
    ((-250.0, 0.0, 0.0), (250.0, 200.0, 15.0)), ((-250.0, 0.0, 200.0), (250.0, 200.0, 215.0)),
    ((-265.0, 0.0, 0.0), (-250.0, 200.0, 215.0)), ((250.0, 0.0, 0.0), (265.0, 200.0, 215.0)),
)  # fmt: skip
DIVIDER = ((40.0, 0.0, 15.0), (52.0, 200.0, 200.0))


def in_the_dark(deep: float, few: float | None = None, back: bool = True) -> Cloud:
    """The case with a share of the points of the divider's faces down to a depth, or a few of its right one; its back
    edge may be left out.
    """
    cloud = box_cloud(*CASE, DIVIDER, spacing=3.0)
    x, n = cloud.points, cloud.normals
    inside = (x[:, 0] > 38) & (x[:, 0] < 54) & (x[:, 2] > 16) & (x[:, 2] < 199)
    chance = np.abs(np.sin(x[:, 1] * 12.9898 + x[:, 2] * 78.233) * 43758.5453) % 1
    place = (x[:, 1] > 60) & (x[:, 1] < 100) & (x[:, 2] > 60) & (x[:, 2] < 100)
    far = np.where(place, few, 0.0) if few is not None else 0.1
    kept = (x[:, 1] < deep) & (chance < np.where(n[:, 0] < 0, 0.1, far))
    faces, behind = inside & (np.abs(n[:, 0]) > 0.9), inside & (n[:, 1] > 0.9)
    return cloud.select(~faces & ~behind | faces & kept | behind & back)


def divider(cloud: Cloud):
    sheets = identify(cloud_only(cloud), IdentifyOptions()).sheets
    found = [s for s in sheets if abs(s.normal[0]) > 0.99 and -200 < s.world_from_board[0, 3] < 200]
    assert len(found) < 2 and len(sheets) == 4 + len(found)
    return found[0] if found else None


def depths(sheet):
    """From where to where the board goes back into the case, mm."""
    ring = np.asarray(sheet.region.exterior.coords)[:, :2]
    y = sheet.to_world(np.c_[ring, np.zeros(len(ring))])[:, 1]
    return y.min(), y.max()


def test_a_divider_seen_in_front_goes_back_to_its_edge() -> None:
    cloud = in_the_dark(90.0)
    low, high = depths(divider(cloud))
    assert (low, high) == (pytest.approx(0, abs=5), pytest.approx(200, abs=5))


def test_nothing_is_run_on_to_an_end_that_nobody_saw() -> None:
    assert depths(divider(in_the_dark(90.0, back=False)))[1] < 110


@pytest.mark.parametrize(("few", "found"), [(0.25, True), (0.0, False)])
def test_one_face_and_a_few_points_of_the_other_make_a_board(few, found) -> None:
    board = divider(in_the_dark(190.0, few))
    assert (board is not None) == found
    assert not found or board.thickness.value == pytest.approx(12, abs=0.3)
