"""Moving captures to the world frame: the same object whatever frame, scale and floor it comes with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from kerfwright.capture import Capture, Cloud, PrepareOptions, prepare
from kerfwright.capture.frame import moved, rotation_between, similarity
from kerfwright.errors import CaptureError
from kerfwright.model import Scale

METRES = Scale(millimetres_per_unit=1000.0)


@pytest.fixture(scope="session")
def stool(shapes, tmp_path_factory):
    """Makes a capture of the stool in metres, standing on z = 0; more clouds may join it."""

    def make(*more, seed=0, views=True):
        generator = np.random.default_rng(seed)
        ring = shapes["ring"](8, 0.9, 0.5, np.array([0, 0, 0.2]), tmp_path_factory.getbasetemp()) if views else ()
        return Capture("stool", tuple(ring), shapes["joined"](shapes["stool"](generator), *more), METRES)

    return make


@pytest.fixture(scope="session")
def on_floor(stool, shapes):
    """The stool with the floor round it, under the top as well."""
    return stool(shapes["floor"](np.random.default_rng(5)))


def assert_world(capture, *, lost=0.0):
    """The stool upright in millimetres about the origin, on z = 0."""
    low, high = np.percentile(capture.cloud.points, (0.2, 99.8), axis=0)
    np.testing.assert_allclose((high - low)[:2], (400, 300), atol=2)
    np.testing.assert_allclose((high + low)[:2] / 2, 0, atol=1)
    assert abs(high[2] - 400) < 1 and -1 < low[2] < 3 + lost
    faces = np.abs(capture.cloud.normals).max(axis=1)  # every face looks along an axis
    assert np.degrees(np.arccos(np.median(faces))) < 0.1


def assert_consistent(prepared, original):
    """What a view shows of a point stays where it was."""
    capture_from_world = prepared.capture_from_world
    points = prepared.cloud.points[::50]
    before = points @ capture_from_world[:3, :3].T + capture_from_world[:3, 3]
    for a, b in zip(original.views, prepared.views, strict=True):
        np.testing.assert_allclose(a.project(before)[0], b.project(points)[0], atol=1e-6)
        np.testing.assert_allclose(b.camera_from_world[:3, :3] @ b.camera_from_world[:3, :3].T, np.eye(3), atol=1e-9)
    tree = cKDTree(original.cloud.points)
    size = original.cloud.diameter
    assert tree.query(before)[0].max() < 1e-9 * size + 1e-9 * np.abs(original.cloud.points).max()


def test_object_alone(stool):
    capture = stool()
    prepared = prepare(capture)
    assert_world(prepared)
    assert_consistent(prepared, capture)
    assert len(prepared.cloud) == len(capture.cloud)
    assert any("no floor was found" in note for note in prepared.notes)


def test_floor_is_levelled_and_left_out(on_floor, stool):
    tilt = similarity(1.0, Rotation.from_euler("xyz", [4, -3, 25], degrees=True).as_matrix(), np.array([0.3, -2, 0.7]))
    tilted = moved(on_floor, tilt)
    tilted = replace(tilted, capture_from_world=np.eye(4))
    prepared = prepare(tilted)
    assert_world(prepared)
    assert_consistent(prepared, tilted)
    up = (prepared.capture_from_world[:3, 2] / np.linalg.norm(prepared.capture_from_world[:3, 2])) @ tilt[:3, :3]
    assert np.degrees(np.arccos(up[2])) < 0.05
    assert "tilted by 5.0" in prepared.notes[0]
    count = len(stool().cloud)
    assert 0.985 * count < len(prepared.cloud) < 1.005 * count


def test_floor_height(on_floor):
    origin = prepare(on_floor).capture_from_world[:3, 3]
    assert abs(origin[2]) < 1e-4  # metres


@settings(max_examples=6, deadline=None)
@given(
    st.floats(-180, 180),
    st.floats(-2, 3).map(lambda e: 10.0**e),
    st.lists(st.floats(-1e4, 1e4), min_size=3, max_size=3),
    st.booleans(),
)
def test_turning_moving_scaling_changes_nothing(stool, on_floor, yaw, scale, shift, with_floor):
    capture = on_floor if with_floor else stool()
    turn = Rotation.from_euler("z", yaw, degrees=True).as_matrix()
    other = moved(capture, similarity(scale, turn, scale * np.array(shift)))
    other = replace(other, capture_from_world=np.eye(4), scale=Scale(millimetres_per_unit=1000 / scale, origin="given"))
    here, there = prepare(capture), prepare(other)
    assert len(here.cloud) == len(there.cloud)
    np.testing.assert_allclose(there.cloud.points, here.cloud.points, atol=1e-3)
    for a, b in zip(here.views, there.views, strict=True):
        np.testing.assert_allclose(b.centre, a.centre, atol=1e-3)


def test_shuffled_points_change_nothing(on_floor):
    order = np.random.default_rng(3).permutation(len(on_floor.cloud))
    shuffled = replace(on_floor, cloud=on_floor.cloud.select(order))
    here, there = prepare(on_floor).cloud.points, prepare(shuffled).cloud.points
    assert abs(len(here) - len(there)) < 0.002 * len(here)
    distance = cKDTree(here).query(there)[0]
    assert np.percentile(distance, 99) < 0.1


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0), (0, 0, -1), (0.5, 0.5, 0.7), (-0.3, 0.2, -0.9)])
def test_floor_is_found_whatever_is_up(on_floor, direction):
    """A wrong --up is put right where the cloud shows the floor."""
    direction = np.array(direction) / np.linalg.norm(direction)
    turned = moved(on_floor, similarity(1.0, rotation_between(np.array([0, 0, 1.0]), direction), np.zeros(3)))
    prepared = prepare(replace(turned, capture_from_world=np.eye(4)))
    assert_world(prepared)


@pytest.mark.parametrize("degrees", [2.0, 4.0, 8.0])
def test_tilted_object_without_floor_is_levelled_by_its_boards(stool, degrees):
    capture = stool()
    tilt = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, -0.8, 0])).as_matrix()
    prepared = prepare(moved(capture, similarity(1.0, tilt, np.zeros(3))))
    assert_world(prepared)
    up = prepared.capture_from_world[:3, 2] / np.linalg.norm(prepared.capture_from_world[:3, 2])
    assert np.degrees(np.arccos(np.clip(up[2], -1, 1))) < 0.1  # capture_from_world leads back to before the tilt
    assert any("level" in note for note in prepared.notes)


def test_strays_are_left_out(stool, generator):
    strays = Cloud(generator.uniform(-3, 3, (60, 3)), np.tile([0.0, 0.0, 1.0], (60, 1)))
    capture = stool(strays)
    prepared = prepare(capture)
    assert_world(prepared)
    assert len(prepared.cloud) <= len(capture.cloud) - 55
    assert any("stray points" in note for note in prepared.notes)


def test_the_object_that_the_cameras_look_at_is_kept(stool, shapes, generator):
    other = shapes["box"]((1.5, 0, 0), (2.1, 0.5, 0.5), 5e-3, generator)
    capture = stool(other)
    assert len(other) > len(stool().cloud) / 2
    prepared = prepare(capture)
    assert_world(prepared)
    assert any("another object" in note for note in prepared.notes)


def test_both_on_one_floor(stool, shapes, generator):
    other = shapes["box"]((0.8, 0, 0), (1.1, 0.3, 0.3), 5e-3, generator)
    prepared = prepare(stool(other, shapes["floor"](generator, half=1.4, spacing=1e-2)))
    assert_world(prepared)


def test_thin_board_on_the_floor_survives(shapes, generator, tmp_path):
    board = shapes["box"]((-0.2, -0.1, 0), (0.2, 0.1, 0.006), 4e-3, generator, 2e-4)
    board = board.select(board.points[:, 2] > 1e-3)
    floor = shapes["floor"](generator)
    hidden = (np.abs(floor.points[:, :2]) < [0.2, 0.1]).all(axis=1)
    views = tuple(shapes["ring"](8, 0.9, 0.5, np.zeros(3), tmp_path))
    prepared = prepare(Capture("board", views, shapes["joined"](board, floor.select(~hidden)), METRES))
    top = prepared.cloud.normals[:, 2] > 0.9
    assert top.sum() > 0.98 * (board.normals[:, 2] > 0.9).sum()
    assert np.median(prepared.cloud.points[top, 2]) == pytest.approx(6, abs=0.1)


@pytest.mark.parametrize("noise", [5e-4, 2e-3])
def test_frayed_floor_leaves_no_islands(stool, shapes, generator, noise):
    carpet = shapes["floor"](generator, noise=noise, spacing=4e-3)
    tufts = carpet.points[generator.random(len(carpet)) < 0.01] + [0, 0, 4 * noise]
    prepared = prepare(stool(carpet, Cloud(tufts, np.tile([0.0, 0.0, 1.0], (len(tufts), 1)))))
    assert_world(prepared, lost=4000 * noise)
    beyond = np.abs(prepared.cloud.points[:, 0]) > 220
    assert beyond.mean() < 1e-3


def test_no_crop_keeps_every_point(on_floor):
    prepared = prepare(on_floor, PrepareOptions(crop=False))
    assert len(prepared.cloud) == len(on_floor.cloud)
    low = prepared.cloud.points[prepared.cloud.points[:, 2] < 1, 2]
    assert len(low) > 10_000 and abs(np.median(low)) < 0.05  # the floor, at z = 0


def test_given_ground(on_floor, stool):
    prepared = prepare(stool(), PrepareOptions(ground=0.1))
    assert prepared.capture_from_world[2, 3] == pytest.approx(0.1)
    assert prepared.cloud.points[:, 2].min() >= 0


def test_nothing_above_the_ground_is_told(stool):
    with pytest.raises(CaptureError, match=r"points above the floor: 0: .*--ground"):
        prepare(stool(), PrepareOptions(ground=5.0))


def test_without_views(stool):
    assert_world(prepare(stool(views=False)))


def test_same_input_same_bytes(on_floor):
    here, there = prepare(on_floor), prepare(on_floor)
    assert here.cloud.points.tobytes() == there.cloud.points.tobytes()
    assert here.capture_from_world.tobytes() == there.capture_from_world.tobytes()


@pytest.mark.parametrize("kind", ["ball", "plane", "line", "two planes"])
def test_odd_clouds_do_not_crash(kind, generator):
    x = generator.normal(size=(3000, 3))
    if kind == "ball":
        points = normals = x / np.linalg.norm(x, axis=1, keepdims=True)
    else:
        flat = {"plane": [1, 1, 0], "line": [1, 0, 0], "two planes": [1, 1, 0]}[kind]
        points = x * flat + (np.outer(np.arange(3000) % 2, [0, 0, 5.0]) if kind == "two planes" else 0)
        normals = np.tile([0.0, 0.0, 1.0], (3000, 1))
    prepared = prepare(Capture(kind, (), Cloud(points, normals), METRES))
    assert np.isfinite(prepared.cloud.points).all() and len(prepared.cloud) >= 100


def test_a_box_keeps_what_is_in_it_in_the_files_coordinates(capture_folder):
    from kerfwright.capture import crop_options, open_capture

    opened = open_capture(capture_folder, up="x")
    cropped = prepare(opened, PrepareOptions(**crop_options("-0.25,-0.2,0.3,0.25,0.2,0.5")))
    original = cropped.cloud.points @ cropped.capture_from_world[:3, :3].T + cropped.capture_from_world[:3, 3]
    assert original[:, 2].min() > 0.3 and len(original) > 1000
    assert any("--crop left" in note for note in cropped.notes)


def test_without_cropping_every_point_is_kept(capture_folder):
    from kerfwright.capture import crop_options, open_capture

    opened = open_capture(capture_folder)
    assert len(prepare(opened, PrepareOptions(**crop_options("none"))).cloud) == len(opened.cloud)


@pytest.mark.parametrize("text", ["", "all", "1,2,3", "0,0,0,1,1,nan", "1,0,0,0,1,1", "5,5,5,6,6,6"])
def test_what_is_no_box_is_told(capture_folder, text):
    from kerfwright.capture import crop_options, open_capture
    from kerfwright.errors import OptionError

    with pytest.raises(OptionError, match="--crop: "):
        prepare(open_capture(capture_folder), PrepareOptions(**crop_options(text)))
