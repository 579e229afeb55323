"""Photographs kept in memory, and shrunk to fit there."""

import gc

import cv2
import numpy as np
import pytest

from kerfwright.capture import photos
from kerfwright.capture.camera import CAMERA_MODELS, LENS_TERMS, Camera
from kerfwright.capture.photos import lightened, photograph
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.model import Scale

WIDTH, HEIGHT = 101, 78


def capture_of(path, views=3):
    rng = np.random.default_rng(1)
    camera = Camera("OPENCV", WIDTH, HEIGHT, (90.0, 91.0, 50.0, 40.0, -0.1, 0.02, 0.001, -0.002))
    pixels = cv2.GaussianBlur(rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8), None, 3)
    cv2.imwrite(str(path / "0.png"), pixels)
    cloud = Cloud(rng.normal(size=(10, 3)), np.tile([0.0, 0.0, 1.0], (10, 1)))
    made = tuple(View(f"{k}", path / "0.png", camera, np.eye(4)) for k in range(views))
    return Capture("test", made, cloud, Scale(millimetres_per_unit=1.0, origin="assumed"))


def test_decoded_once_and_dropped_with_its_view(tmp_path):
    capture = capture_of(tmp_path)
    view = capture.views[0]
    assert photograph(view) is photograph(view)
    before = len(photos._DECODED)
    del capture, view
    gc.collect()
    assert len(photos._DECODED) == before - 1


def test_small_photographs_stay_as_they_are(tmp_path):
    capture = capture_of(tmp_path)
    assert lightened(capture) is capture


def test_shrunk_photographs_show_the_same_places(tmp_path):
    capture = capture_of(tmp_path)
    light = lightened(capture, most_bytes=3 * 3 * WIDTH * HEIGHT // 8)
    view, full = light.views[0], capture.views[0]
    assert view.shrink == 3
    assert "3 x 3 pixels" in light.notes[-1]
    assert view.image().shape == (HEIGHT // 3, WIDTH // 3, 3)
    assert np.allclose(view.image()[5, 7], full.image()[15:18, 21:24].reshape(9, 3).mean(axis=0), atol=0.6)
    places = np.random.default_rng(2).uniform([-0.3, -0.3, 1], [0.3, 0.3, 2], (50, 3))
    assert np.allclose(view.project(places)[0] * 3, full.project(places)[0], atol=1e-9)


@pytest.mark.parametrize("model", sorted(CAMERA_MODELS))
def test_every_camera_shrinks(model):
    values = {"f": 900.0, "fx": 900.0, "fy": 905.0, "cx": 800.0, "cy": 600.0} | dict.fromkeys(LENS_TERMS, 0.01)
    camera = Camera(model, 1601, 1200, tuple(values[name] for name in CAMERA_MODELS[model]))
    places = np.random.default_rng(2).uniform([-0.3, -0.3, 1], [0.3, 0.3, 2], (50, 3))
    assert np.allclose(camera.scaled(1 / 4).project(places) * 4, camera.project(places), atol=1e-9)
    assert (camera.scaled(1 / 4).width, camera.scaled(1 / 4).height) == (400, 300)
