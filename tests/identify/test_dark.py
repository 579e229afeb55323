"""Boards seen in rags: two small patches that face away from each other, and nothing else there."""

import numpy as np
import pytest

from clouds import box_cloud, cloud_only
from kerfwright.capture.types import Cloud
from kerfwright.identify import IdentifyOptions, identify

OPTIONS = IdentifyOptions()
SEAT = ((-250.0, -100.0, 280.0), (250.0, 100.0, 300.0))
LEGS = tuple(((x, -100.0, 0.0), (x + 20, 100.0, 280.0)) for x in (-240.0, 220.0))
STRETCHER = ((-220.0, -8.0, 220.0), (220.0, 8.0, 280.0))


def in_the_dark(cloud: Cloud, keep) -> Cloud:
    """The cloud with only those points of the stretcher's long sides that `keep` (of x and z) picks: two small rags."""
    x = cloud.points
    own = (np.abs(np.abs(x[:, 1]) - 8) < 1) & (np.abs(x[:, 0]) < 219) & (x[:, 2] > 221) & (x[:, 2] < 279)
    under = (np.abs(x[:, 2] - 220) < 1) & (np.abs(x[:, 0]) < 219) & (np.abs(x[:, 1]) < 9)
    left = ~under & (~own | own & keep(x[:, 0], x[:, 2]))
    return Cloud(x[left], cloud.normals[left])


def stretchers(cloud: Cloud):
    sheets = identify(cloud_only(cloud), OPTIONS).sheets
    return [s for s in sheets if abs(s.normal[1]) > 0.99]


def thinned(share: float):
    """Every n-th place of the stretcher, chosen by its own digits."""
    return lambda x, z: (np.abs(np.sin(x * 12.9898 + z * 78.233) * 43758.5453) % 1 < share) & (np.abs(x) < 160)


@pytest.mark.parametrize("share", [0.1, 0.15, 0.25])
def test_a_stretcher_in_the_shadow_is_a_board(share):
    cloud = in_the_dark(box_cloud(SEAT, *LEGS, STRETCHER, spacing=3.0), thinned(share))
    (found,) = stretchers(cloud)
    assert found.thickness.value == pytest.approx(16, abs=1.0)
    assert found.region.area > 0.2 * 440 * 60
    assert len(identify(cloud_only(cloud), OPTIONS).sheets) == 4


def test_one_side_alone_is_none():
    cloud = in_the_dark(box_cloud(SEAT, *LEGS, STRETCHER, spacing=3.0), thinned(0.1))
    one_side = cloud.points[:, 1] < 7
    beyond = (cloud.points[:, 1] >= 7) & (np.abs(cloud.points[:, 1] - 8) < 1) & (cloud.points[:, 2] < 279)
    beyond &= (np.abs(cloud.points[:, 0]) < 219)
    assert beyond.sum() > 20
    assert not stretchers(cloud.select(one_side | ~beyond))


def test_what_other_boards_explain_is_none():
    assert len(identify(cloud_only(box_cloud(SEAT, *LEGS, spacing=3.0)), OPTIONS).sheets) == 3
