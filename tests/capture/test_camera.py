"""Camera models against OpenCV's own projection, and back."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from kerfwright.capture import Camera

MATRIX = np.array([[800, 0, 322.5], [0, 790, 238.25], [0, 0, 1]])
HEAD = (800, 790, 322.5, 238.25)
POINTS = np.c_[np.random.default_rng(0).uniform(-0.6, 0.6, (400, 2)), np.ones(400)] * np.linspace(1, 3, 400)[:, None]
LENSES = {
    "OPENCV": (-0.2, 0.05, 0.001, -0.002),
    "FULL_OPENCV": (-0.2, 0.05, 0.001, -0.002, 0.01, 0.02, -0.03, 0.004),
    "OPENCV_FISHEYE": (-0.05, 0.01, 0.001, -0.002),
}


@pytest.mark.parametrize("model", LENSES)
def test_as_opencv_projects(model):
    camera = Camera(model, 640, 480, (*HEAD, *LENSES[model]))
    lens, none = np.array(LENSES[model]), np.zeros(3)
    if "FISHEYE" in model:
        expected = cv2.fisheye.projectPoints(POINTS[:, None], none, none, MATRIX, lens)[0][:, 0]
    else:
        expected = cv2.projectPoints(POINTS, none, none, MATRIX, lens)[0][:, 0]
    np.testing.assert_allclose(camera.project(POINTS), expected, atol=1e-9)
    np.testing.assert_allclose(camera.undistort(expected), POINTS[:, :2] / POINTS[:, 2:], atol=1e-10)


@pytest.mark.parametrize(
    ("simple", "full"),
    [
        (("SIMPLE_RADIAL_FISHEYE", (800, 320, 240, 0.02)), ("OPENCV_FISHEYE", (800, 800, 320, 240, 0.02, 0, 0, 0))),
        (("RADIAL_FISHEYE", (800, 320, 240, 0.02, -0.01)), ("FISHEYE", (800, 800, 320, 240, 0.02, -0.01, 0, 0, 0))),
        (("RADIAL", (800, 320, 240, -0.1, 0.02)), ("BROWN", (800, 800, 320, 240, -0.1, 0.02, 0, 0, 0, 0, 0))),
        (("OPENCV", (*HEAD, -0.1, 0.02, 1e-3, 2e-3)), ("BROWN", (*HEAD, -0.1, 0.02, 0, 0, 1e-3, 2e-3, 0))),
    ],
)
def test_models_that_are_parts_of_others(simple, full):
    a, b = (Camera(model, 640, 480, params) for model, params in (simple, full))
    np.testing.assert_allclose(a.project(POINTS), b.project(POINTS), atol=1e-10)


def test_a_strong_fisheye_is_undone():
    camera = Camera("OPENCV_FISHEYE", 640, 480, (250, 250, 320, 240, 0.05, -0.01, 0, 0))
    angle = np.radians(np.linspace(1, 78, 200))
    rays = np.c_[np.tan(angle), 0.3 * np.tan(angle), np.ones(200)]
    np.testing.assert_allclose(camera.undistort(camera.project(rays)), rays[:, :2], rtol=1e-6)


def test_beyond_the_fold_nothing_is_in_the_picture():
    camera = Camera("SIMPLE_RADIAL", 640, 480, (500, 320, 240, -0.3))
    assert camera.fold == pytest.approx(1 / np.sqrt(0.9), abs=2e-3), "where r - 0.3 r^3 turns back"
    inside, outside = camera.project(np.array([[1.0, 0, 1], [1.2, 0, 1]]))
    assert np.isfinite(inside).all() and np.isnan(outside).all()
    assert Camera("PINHOLE", 640, 480, (500, 500, 320, 240)).fold == np.inf
