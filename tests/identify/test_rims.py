"""A board of 300 x 200 x 20 mm whose rough outline is 4 mm too large, as stereo makes it."""

import numpy as np
import pytest
import shapely
from shapely.geometry import box

from clouds import box_cloud, pose
from kerfwright.identify import IdentifyOptions
from kerfwright.identify.primitives import look_around
from kerfwright.identify.rims import cut_points, outline_samples, trace_rim

BOARD = ((-150, -100, 0), (150, 100, 20))
TRUE = box(-150, -100, 150, 100)
ROUGH = box(-154, -104, 154, 104)
TOP = pose((0, 0, 20))


@pytest.fixture(scope="module")
def seen():
    cloud = box_cloud(BOARD, spacing=3.0)
    return cloud, look_around(cloud, IdentifyOptions())


def rim_of(seen, region=ROUGH):
    return trace_rim(TOP, region, *seen, 20.0, spacing=1.25, width=12.0)


def away_from_corners(places: np.ndarray) -> np.ndarray:
    return (np.abs(places[:, 0]) < 140) | (np.abs(places[:, 1]) < 90)


def test_outline_moves_onto_the_cut_faces(seen):
    rim = rim_of(seen)
    inner = rim.seen & away_from_corners(rim.places)
    assert inner.mean() > 0.85
    distance = shapely.distance(TRUE.boundary, shapely.points(rim.places[inner]))
    assert np.median(distance) < 0.1
    assert np.quantile(distance, 0.95) < 0.5


def test_its_error_is_that_of_the_cloud_where_seen_and_of_the_search_elsewhere(seen):
    cloud = seen[0].select(seen[0].normals[:, 0] < 0.9)  # the cut face at +x was never seen
    rim = rim_of((cloud, look_around(cloud, IdentifyOptions())))
    right = (rim.places[:, 0] > 150) & (np.abs(rim.places[:, 1]) < 80)
    left = (rim.places[:, 0] < -145) & (np.abs(rim.places[:, 1]) < 80)
    assert not rim.seen[right].any()
    assert rim.places[right, 0] == pytest.approx(154.0)
    assert (rim.error[right] == 6.0).all()
    assert rim.seen[left].mean() > 0.95
    assert np.median(rim.error[left]) < 0.5


def test_normals_point_away_from_the_wood_round_holes_too():
    ring = box(-50, -50, 50, 50).difference(box(-20, -20, 20, 20))
    places, outward, number = outline_samples(ring, 2.0)
    assert np.linalg.norm(outward, axis=1) == pytest.approx(1)
    assert not shapely.contains_xy(ring, *(places + 0.5 * outward).T).any()
    assert set(number) == {0, 1}
    assert np.bincount(number).tolist() == [200, 80]


def test_cut_points_face_outward_and_lie_within_the_depth(seen):
    cloud, around = seen
    cut = cut_points(TOP, outline_samples(ROUGH, 1.25), cloud, around, 12.0, 12.0)
    assert len(cut.idx) > 200
    assert cut.depth.max() <= 12.0
    assert np.abs(around.normals[cut.idx, 2]).max() < 0.5
    assert np.median(cut.offset) == pytest.approx(-4.0, abs=0.1)


def test_faces_of_another_board_that_look_inward_are_no_cut_points():
    """A neighbour stands 5 mm off; its face looks at this board and must not pull the outline outward."""
    cloud = box_cloud(BOARD, ((155, -100, -60), (175, 100, 60)), spacing=3.0)
    rim = rim_of((cloud, look_around(cloud, IdentifyOptions())))
    right = rim.seen & (rim.places[:, 0] > 140) & (np.abs(rim.places[:, 1]) < 80)
    assert right.any()
    assert np.median(rim.places[right, 0]) == pytest.approx(150, abs=0.3)
