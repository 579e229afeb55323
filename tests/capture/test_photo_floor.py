"""The floor that only the photographs show."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kerfwright.capture import Camera, Capture, PrepareOptions, prepare
from kerfwright.capture.frame import moved, similarity
from kerfwright.capture.photo_floor import floor_in_photos
from kerfwright.model import Scale

DEPTH = 0.006  # metres of the floor below z = 0, where the cloud ends


def photograph(view, texture, depth=DEPTH, cell=0.004):
    """Write what the view sees of a textured floor at z = -depth."""
    rows, columns = np.mgrid[0 : view.camera.height, 0 : view.camera.width] + 0.5
    rays = np.c_[view.camera.undistort(np.stack([columns.ravel(), rows.ravel()], axis=1)), np.ones(rows.size)]
    rays = rays @ view.camera_from_world[:3, :3]
    reach = (-depth - view.centre[2]) / rays[:, 2]
    xy = (view.centre[:2] + reach[:, None] * rays[:, :2]) / cell + np.array(texture.shape[::-1]) / 2
    maps = xy.reshape(*rows.shape, 2).astype(np.float32)
    grey = cv2.remap(texture, maps[..., 0], maps[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_WRAP)
    view.path.parent.mkdir(exist_ok=True)
    cv2.imwrite(str(view.path), cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))


@pytest.fixture(scope="module")
def make(shapes, tmp_path_factory):
    """A capture of the stool whose photographs show a floor with texture of an amplitude, in grey levels."""

    def capture(amplitude=40.0, params=()):
        folder = tmp_path_factory.mktemp("photos")
        generator = np.random.default_rng(4)
        views = shapes["ring"](8, 0.9, 0.5, np.array([0, 0, 0.1]), folder, (320, 240))
        camera = (
            replace(views[0].camera, model="OPENCV", params=(*views[0].camera.params, *params))
            if params
            else views[0].camera
        )
        views = [replace(view, camera=camera) for view in views]
        noise = cv2.GaussianBlur(generator.normal(size=(600, 600)).astype(np.float32), None, 1.2)
        texture = np.clip(128 + amplitude * noise / noise.std(), 0, 255).astype(np.uint8)
        for view in views:
            photograph(view, texture)
        return Capture("stool", tuple(views), shapes["stool"](generator), Scale(millimetres_per_unit=1000.0))

    return capture


@pytest.fixture(scope="module")
def photographed(make):
    return make()


def test_height(photographed):
    floor = floor_in_photos(photographed.views, photographed.cloud, 0.001)
    assert floor.views == 8
    assert floor.offset == pytest.approx(-DEPTH, abs=3e-4)
    assert floor.height == pytest.approx(-DEPTH, abs=3e-4)
    assert np.degrees(np.arccos(floor.normal[2])) < 0.05


def test_distorted_photographs(make):
    capture = make(params=(-0.15, 0.05, 1e-3, -1e-3))
    assert isinstance(capture.views[0].camera, Camera) and capture.views[0].camera.distortion.any()
    assert floor_in_photos(capture.views, capture.cloud, 0.001).offset == pytest.approx(-DEPTH, abs=4e-4)


@pytest.mark.parametrize("degrees", [0.5, 1.4])
def test_small_tilt_is_put_right(photographed, degrees):
    tilt = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0.8, 0])).as_matrix()
    tilted = moved(photographed, similarity(1.0, tilt, np.array([5.0, -3.0, 2.0])))
    prepared = prepare(tilted)
    up = prepared.capture_from_world[:3, 2] / np.linalg.norm(prepared.capture_from_world[:3, 2])
    assert np.degrees(np.arccos(min(1, up[2]))) < 0.05
    assert any("photographs was tilted" in note for note in prepared.notes)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_any_scale_and_place(photographed, scale):
    turn = Rotation.from_euler("z", 40, degrees=True).as_matrix()
    other = moved(photographed, similarity(scale, turn, scale * np.array([100.0, -50.0, 7.0])))
    other = replace(other, capture_from_world=np.eye(4), scale=Scale(millimetres_per_unit=1000 / scale))
    here, there = prepare(photographed), prepare(other)
    assert len(here.cloud) == len(there.cloud)
    np.testing.assert_allclose(there.cloud.points, here.cloud.points, atol=0.05)
    assert np.percentile(here.cloud.points[:, 2], 0.1) == pytest.approx(1000 * DEPTH, abs=2.5)


def test_plain_floor_shows_nothing(make):
    capture = make(amplitude=0.0)
    assert floor_in_photos(capture.views, capture.cloud, 0.001) is None


def test_photographs_may_be_left_out(photographed):
    prepared = prepare(photographed, PrepareOptions(photos=False))
    assert np.percentile(prepared.cloud.points[:, 2], 0.1) < 3
    assert any("no floor was found" in note for note in prepared.notes)


def test_too_few_views(photographed):
    assert floor_in_photos(photographed.views[:2], photographed.cloud, 0.001) is None
    flat = [view for view in photographed.views if view.centre[2] < 0]
    assert floor_in_photos(flat, photographed.cloud, 0.001) is None
