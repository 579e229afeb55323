"""A wall at y = 0, seen from y < 0."""

from pathlib import Path

import numpy as np
import pytest

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.identify.freespace import see_through
from kerfwright.model import Scale
from kerfwright.synthetic.cameras import looking_at

CAMERA = Camera("PINHOLE", 320, 240, (300.0, 300.0, 160.0, 120.0))
SPACING = 2.0


def wall(facing: float = -1.0) -> Cloud:
    x, z = (g.ravel() for g in np.meshgrid(np.arange(-200, 201, SPACING), np.arange(-150, 151, SPACING)))
    return Cloud(np.c_[x, np.zeros(len(x)), z], np.tile([0.0, facing, 0.0], (len(x), 1)))


def free_space(cloud: Cloud, *centres: tuple[float, float, float]):
    poses = [looking_at(np.array(centre, float), np.zeros(3)) for centre in centres]
    views = tuple(View(f"{k}", Path(f"{k}.png"), CAMERA, pose) for k, pose in enumerate(poses))
    return see_through(Capture("wall", views, cloud, Scale(millimetres_per_unit=1.0)), SPACING, margin=5.0)


def votes(free, *places) -> list[int]:
    return free.votes(np.array(places, float)).tolist()


def test_in_front_of_a_seen_surface_is_free_and_behind_it_is_not():
    free = free_space(wall(), (0, -800, 0))
    assert votes(free, (0, -100, 0), (30, -20, 40), (0, 50, 0), (0, 400, 10)) == [1, 1, 0, 0]


def test_nothing_closer_than_the_margin_is_free():
    free = free_space(wall(), (0, -800, 0))
    assert votes(free, (0, -4, 0), (0, 0, 0), (0, -6, 0)) == [0, 0, 1]


def test_a_surface_that_faces_away_says_nothing():
    """The ray crossed a surface that stereo missed: there may be wood anywhere along it."""
    assert votes(free_space(wall(facing=1.0), (0, -800, 0)), (0, -100, 0), (0, 50, 0)) == [0, 0]


def test_nothing_is_known_beside_the_surface():
    assert votes(free_space(wall(), (0, -800, 0)), (260, -10, 0), (0, -10, 190), (5000, 0, 0)) == [0, 0, 0]


def test_nothing_behind_the_camera_is_free():
    assert votes(free_space(wall(), (0, -800, 0)), (0, -900, 0)) == [0]


def test_every_view_votes():
    free = free_space(wall(), (0, -800, 0), (-200, -700, 100), (100, -900, -50))
    assert votes(free, (0, -100, 0)) == [3]


def test_a_sparse_cloud_draws_closed():
    """Map pixels follow the spacing of the cloud: no hole in a wall of points 8 mm apart."""
    rng = np.random.default_rng(0)
    cloud = wall()
    sparse = cloud.select(rng.random(len(cloud)) < 0.08)
    view = View("0", Path("0.png"), CAMERA, looking_at(np.array([0, -800.0, 0]), np.zeros(3)))
    free = see_through(Capture("wall", (view,), sparse, Scale(millimetres_per_unit=1.0)), 10.0, margin=5.0)
    grid = np.array([(x, -60.0, z) for x in range(-100, 101, 10) for z in range(-80, 81, 10)])
    assert free.votes(grid).mean() > 0.75


@pytest.mark.parametrize("place", [(0, -100, 0), (0, 100, 0)])
def test_no_views_know_nothing(place):
    free = free_space(wall(), (0, -800, 0))
    blind = type(free)((), (), free.pixel, free.margin)
    assert votes(blind, place) == [0]
