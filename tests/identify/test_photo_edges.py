"""A plane z = 0, dark on one side of x = EDGE, photographed from z < 0 at one millimetre a pixel."""

import cv2
import numpy as np
import pytest

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.identify.photo_edges import Photos, refine_peak, sweep_edge
from kerfwright.model import Scale

EDGE = 3.37
FOCAL = 400.0
PLACES = np.c_[np.zeros(40), np.linspace(-60, 60, 40), np.zeros(40)]
ALONG_X = np.array([1.0, 0, 0])
OFFSETS = np.arange(-8, 8, 0.1)


def photograph(path, shift: float, edge: float, noise: float, rng) -> View:
    """A view from (shift, 0, -FOCAL): a pixel's brightness is the share of it on the bright side."""
    columns = np.arange(320)
    at = (edge - shift) + 160.0
    bright = np.clip(at - columns, 0, 1)
    image = 60 + 120 * np.tile(bright, (240, 1)) + noise * rng.standard_normal((240, 320))
    assert cv2.imwrite(str(path), np.clip(np.round(image), 0, 255).astype(np.uint8))
    pose = np.eye(4)
    pose[:3, 3] = [-shift, 0, FOCAL]
    return View(path.name, path, Camera("PINHOLE", 320, 240, (FOCAL, FOCAL, 160.0, 120.0)), pose)


def photos_of(tmp_path, edge: float = EDGE, noise: float = 4.0, views: int = 6) -> Photos:
    rng = np.random.default_rng(1)
    made = tuple(photograph(tmp_path / f"{k}.png", 11.3 * k - 30, edge, noise, rng) for k in range(views))
    cloud = Cloud(np.zeros((1, 3)), np.array([[0, 0, -1.0]]))
    return Photos(Capture("edge", made, cloud, Scale(millimetres_per_unit=1.0)))


@pytest.mark.parametrize("edge", [EDGE, -4.81, 0.0])
def test_an_edge_is_found_within_a_fifth_of_a_millimetre(tmp_path, edge):
    photos = photos_of(tmp_path, edge)
    found = sweep_edge(photos, PLACES, ALONG_X, OFFSETS, np.ones((6, len(PLACES)), bool))
    assert found.best == pytest.approx(edge, abs=0.2)
    assert found.views == 6
    assert found.contrast > 3
    assert found.standard_error < 0.3


def test_offsets_run_along_the_direction(tmp_path):
    found = sweep_edge(photos_of(tmp_path), PLACES, -ALONG_X, OFFSETS, np.ones((6, len(PLACES)), bool))
    assert found.best == pytest.approx(-EDGE, abs=0.2)


def test_each_place_may_have_its_own_direction(tmp_path):
    """Places on both sides of the edge, each swept towards it."""
    places, direction = PLACES.copy(), np.tile(ALONG_X, (len(PLACES), 1))
    places[20:, 0], direction[20:] = 2 * EDGE, -ALONG_X
    found = sweep_edge(photos_of(tmp_path), places, direction, OFFSETS, np.ones((6, len(PLACES)), bool))
    assert found.best == pytest.approx(EDGE, abs=0.2)


def test_only_views_that_see_the_places_are_asked(tmp_path):
    visible = np.zeros((6, len(PLACES)), bool)
    visible[[1, 4]] = True
    assert sweep_edge(photos_of(tmp_path), PLACES, ALONG_X, OFFSETS, visible).views == 2


def test_no_view_no_answer(tmp_path):
    photos = photos_of(tmp_path)
    assert sweep_edge(photos, PLACES, ALONG_X, OFFSETS, np.zeros((6, len(PLACES)), bool)) is None
    outside = PLACES + np.array([1000, 0, 0])
    assert sweep_edge(photos, outside, ALONG_X, OFFSETS, np.ones((6, len(PLACES)), bool)) is None


@pytest.mark.parametrize("count", [0, 1, 3, 4])
def test_a_sweep_too_short_for_a_peak_tells_nothing(tmp_path, count):
    every = np.ones((6, len(PLACES)), bool)
    assert sweep_edge(photos_of(tmp_path), PLACES, ALONG_X, OFFSETS[:count], every) is None
    assert sweep_edge(photos_of(tmp_path), PLACES, ALONG_X, OFFSETS[:5], every).views == 6


def test_a_plain_face_stands_out_nowhere(tmp_path):
    photos = photos_of(tmp_path, edge=1000.0)
    plain = sweep_edge(photos, PLACES, ALONG_X, OFFSETS, np.ones((6, len(PLACES)), bool))
    assert plain.contrast < 2


def test_colours_are_read_at_pixel_centres_and_are_missing_outside(tmp_path):
    photos = photos_of(tmp_path, noise=0.0)
    pixels = np.array([[[10.5, 100.5], [300.5, 100.5], [-3.0, 50.0], [500.0, 50.0]]])
    on_plane = pixels - [160, 120] - photos.views[0].camera_from_world[:2, 3]  # a pixel is a millimetre at z = 0
    colours = photos.colours(0, np.concatenate([on_plane, np.zeros((1, 4, 1))], axis=2))
    assert colours.shape == (1, 4, 3)
    assert colours[0, :2, 0] == pytest.approx([180, 60])
    assert np.isnan(colours[0, 2:]).all()


def test_peak_of_a_parabola_is_exact():
    x = np.array([-1.0, 0, 1])
    assert refine_peak(5 - (x - 0.3) ** 2) == pytest.approx(0.3)
    assert refine_peak(np.array([1.0, 1.0, 1.0])) == 0
