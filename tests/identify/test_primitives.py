import numpy as np
import pytest

from clouds import box_cloud, with_flipped
from kerfwright.capture.types import Cloud
from kerfwright.errors import StageError
from kerfwright.identify import IdentifyOptions
from kerfwright.identify.primitives import find_planes, look_around, plane_fit

BOARD = ((-150, -100, 0), (150, 100, 20))
OPTIONS = IdentifyOptions()


def planes_of(cloud):
    return find_planes(cloud, look_around(cloud, OPTIONS), OPTIONS)


def by_axis(planes) -> dict[tuple, float]:
    """Offset by rounded normal of the six largest planes."""
    return {tuple(np.round(p.normal).astype(int)): p.offset for p in planes[:6]}


SIX = {(1, 0, 0): 150, (-1, 0, 0): 150, (0, 1, 0): 100, (0, -1, 0): 100, (0, 0, 1): 20, (0, 0, -1): 0}


@pytest.fixture(scope="module")
def cloud():
    return box_cloud(BOARD, spacing=3.0)


def test_faces_of_a_box_are_found_within_a_tenth_of_a_millimetre(cloud):
    found = by_axis(planes_of(cloud))
    assert found.keys() == SIX.keys()
    assert found == pytest.approx(SIX, abs=0.1)


def test_normals_are_found_within_a_tenth_of_a_degree_on_broad_faces(cloud):
    for plane in planes_of(cloud)[:2]:
        assert np.degrees(np.arccos(abs(plane.normal[2]))) < 0.1


def test_noise_is_the_noise_of_the_cloud(cloud):
    assert planes_of(cloud)[0].sigma == pytest.approx(0.1, rel=0.15)
    assert look_around(cloud, OPTIONS).noise == pytest.approx(0.1, rel=0.25)


def test_planes_come_largest_first_and_share_no_point(cloud):
    planes = planes_of(cloud)
    sizes = [len(p.point_idx) for p in planes]
    assert sizes == sorted(sizes, reverse=True)
    everything = np.concatenate([p.point_idx for p in planes])
    assert len(np.unique(everything)) == len(everything) > 0.85 * len(cloud)


def test_flipped_normals_change_nothing(cloud):
    found = by_axis(planes_of(with_flipped(cloud, 0.1)))
    assert found.keys() == SIX.keys()
    assert found == pytest.approx(SIX, abs=0.1)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_changes_no_label(cloud, scale):
    plain, scaled = planes_of(cloud), planes_of(Cloud(cloud.points * scale, cloud.normals))
    assert [p.point_idx.tolist() for p in scaled] == [p.point_idx.tolist() for p in plain]
    assert scaled[0].sigma == pytest.approx(scale * plain[0].sigma, rel=1e-6)


def test_ten_kilometres_from_the_origin_changes_no_plane(cloud):
    away = planes_of(Cloud(cloud.points + 1e7, cloud.normals))
    plain = planes_of(cloud)
    assert [len(p.point_idx) for p in away[:6]] == [len(p.point_idx) for p in plain[:6]]
    assert away[0].normal == pytest.approx(plain[0].normal, abs=1e-6)


def test_same_cloud_gives_the_same_planes_to_the_last_bit(cloud):
    first, second = planes_of(cloud), planes_of(cloud)
    assert [p.normal.tobytes() for p in first] == [p.normal.tobytes() for p in second]


def test_two_ends_of_one_plane_are_two_patches():
    """A patch is connected: two boards on one plane are told apart by their places."""
    cloud = box_cloud(((-200, 0, 0), (-60, 140, 20)), ((60, 0, 0), (200, 140, 20)))
    tops = [p for p in planes_of(cloud) if p.normal[2] > 0.99]
    assert sorted(np.sign(p.centroid[0]) for p in tops[:2]) == [-1, 1]


def test_too_few_points_are_refused_with_their_number():
    cloud = box_cloud(BOARD)
    with pytest.raises(StageError, match=r"points: 40: at least 64"):
        look_around(cloud.select(np.arange(40)), OPTIONS)


def test_points_without_a_plane_are_refused():
    rng = np.random.default_rng(0)
    normals = rng.standard_normal((3000, 3))
    cloud = Cloud(rng.uniform(-1, 1, (3000, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True))
    with pytest.raises(StageError, match="no plane found"):
        planes_of(cloud)


def test_plane_fit_leaves_strays_out():
    rng = np.random.default_rng(3)
    points = rng.uniform(-100, 100, (1000, 3)) * [1, 1, 0] + [0, 0, 7] + 0.1 * rng.standard_normal((1000, 3))
    points[:150, 2] += rng.uniform(5, 20, 150)
    normal, offset, _, sigma = plane_fit(points, np.array([0, 0, -1.0]))
    assert normal == pytest.approx([0, 0, -1], abs=2e-3)
    assert offset == pytest.approx(-7, abs=0.03)
    assert sigma == pytest.approx(0.1, rel=0.3)
