"""The photographs chosen show the object whole and from different sides; a scaled view sees the same."""

from pathlib import Path

import numpy as np
import pytest

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import View
from kerfwright.report.views import best_views, scaled

CAMERA = Camera("OPENCV", 403, 301, (420.0, 415.0, 203.0, 148.0, -0.1, 0.02, 0.001, -0.002))
POINTS = np.random.default_rng(0).uniform(-60, 60, (500, 3))


def view(name: str, azimuth: float, distance: float = 500.0, off: float = 0.0) -> View:
    """Looks from an azimuth (degrees) at the origin, turned aside by `off` degrees."""
    a, b = np.radians([azimuth, azimuth + 180 + off])
    forward = np.array([np.cos(b), np.sin(b), 0])
    turn = np.array([[np.sin(b), -np.cos(b), 0], [0, 0, -1], forward])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, -turn @ (distance * np.array([np.cos(a), np.sin(a), 0]))
    return View(name, Path(name), CAMERA, pose)


def test_views_are_spread_round_the_object():
    views = [view(f"{a}", a) for a in range(0, 360, 10)]
    azimuths = [int(v.name) for v in best_views(views, POINTS, 4)]
    assert np.diff([*azimuths, azimuths[0] + 360]).min() >= 80 and azimuths == sorted(azimuths)


def test_views_that_miss_the_object_or_see_it_from_afar_are_left():
    views = [view("good", 0), view("away", 90, off=180), view("cut", 180, off=27), view("far", 270, 5000)]
    assert [v.name for v in best_views(views, POINTS, 4)] == ["good"]
    assert best_views(views[1:2], POINTS, 4) == [] and best_views([], POINTS) == []


@pytest.mark.parametrize("width", [100, 200, 402])
def test_a_scaled_view_sees_the_same(width):
    whole = view("v", 30)
    small, photo = scaled(whole, np.zeros((301, 403, 3), np.uint8), width)
    assert photo.shape[:2] == (small.camera.height, small.camera.width) and small.camera.width == width
    factor = np.array([small.camera.width / 403, small.camera.height / 301])
    np.testing.assert_allclose(small.project(POINTS)[0], whole.project(POINTS)[0] * factor, atol=1e-9)


def test_a_view_is_never_made_larger():
    whole, photo = view("v", 0), np.zeros((301, 403, 3), np.uint8)
    assert scaled(whole, photo, 900) == (whole, photo)
