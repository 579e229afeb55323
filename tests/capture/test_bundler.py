"""Bundler files: cameras project as the manual of Bundler v0.3 says."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kerfwright.capture import View, open_capture
from kerfwright.capture.bundler import read_bundler
from kerfwright.errors import CaptureError

SIZE = (60, 40)


@pytest.fixture
def image(tmp_path) -> Path:
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), np.zeros((SIZE[1], SIZE[0], 3), np.uint8))
    return path


def text(turn, shift, focal=50.0, k1=0.0, k2=0.0) -> str:
    rows = [[focal, k1, k2], *turn, shift]
    return "# Bundle file v0.3\n1 0\n" + "".join(" ".join(map(repr, map(float, row))) + "\n" for row in rows)


def write(folder: Path, content: str, names: str = "a.png\n") -> Path:
    (folder / "bundle.out").write_text(content)
    (folder / "list.txt").write_text(names, encoding="utf-8")
    return folder / "bundle.out"


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    st.lists(st.floats(-5, 5), min_size=3, max_size=3),
    st.floats(10, 500),
    st.floats(-0.2, 0.2),
    st.floats(-0.05, 0.05),
)
def test_projects_as_the_manual_says(tmp_path_factory, rotation, shift, focal, k1, k2):
    folder = tmp_path_factory.mktemp("bundler")
    cv2.imwrite(str(folder / "a.png"), np.zeros((SIZE[1], SIZE[0], 3), np.uint8))
    turn = Rotation.from_rotvec(rotation).as_matrix()
    (read,) = read_bundler(write(folder, text(turn, shift, focal, k1, k2)), lambda name: folder / name)
    in_bundler = np.random.default_rng(0).uniform((-1, -1, -5), (1, 1, -3), (20, 3))  # in front: along -z
    world = (in_bundler - shift) @ turn
    plane = -in_bundler[:, :2] / in_bundler[:, 2:]
    square = (plane**2).sum(axis=1, keepdims=True)
    from_centre = focal * (1 + k1 * square + k2 * square**2) * plane  # y up, origin in mid-image
    expected = [SIZE[0] / 2, SIZE[1] / 2] + from_centre * [1, -1]
    pixels, depth = View("a", folder, read.camera, read.camera_from_capture).project(world)
    np.testing.assert_allclose(pixels, expected, atol=1e-6)
    np.testing.assert_allclose(depth, -in_bundler[:, 2], atol=1e-9)


@pytest.mark.parametrize(
    "name",
    [
        "a.png",
        "a.png 0 1234.5",
        "a.png 0 1.2345e3",
        "  a.png\t",
        "my photo 7.png 0 55",
        "my photo 7.png",
        "Straße é.png",
    ],
)
def test_names_of_the_list(tmp_path, image, name):
    asked = []
    read_bundler(write(tmp_path, text(np.eye(3), np.zeros(3)), name + "\r\n"), lambda n: asked.append(n) or image)
    assert asked == [name.removesuffix("0 1234.5").removesuffix("0 1.2345e3").removesuffix("0 55").strip()]


def test_unregistered_cameras_are_left_out(tmp_path, image):
    zero = "0 0 0\n" * 5
    content = text(np.eye(3), np.zeros(3)).replace("1 0\n", "3 0\n", 1).split("\n", 2)
    body = zero + content[2] + zero
    read = read_bundler(write(tmp_path, "\n".join([*content[:2], body]), "x.png\na.png\ny.png\n"), lambda name: image)
    assert [r.name for r in read] == ["a.png"]


GOOD = text(np.eye(3), np.zeros(3))


@pytest.mark.parametrize(
    ("content", "names", "told"),
    [
        ("", "a.png\n", "number of cameras"),
        ("# v0.3\n-4 0\n", "a.png\n", "number of cameras: -4"),
        ("# v0.3\n1000000000000 0\n", "a.png\n", r"list.txt: images: 1: bundle.out has 1000000000000"),
        (GOOD[: len(GOOD) // 2], "a.png\n", "cut short"),
        (GOOD, "a.png\nb.png\n", "images: 2: bundle.out has 1 cameras"),
        (GOOD.replace("50.0", "50,0"), "a.png\n", "camera 0: 50,0: use a decimal point"),
        (GOOD.replace("50.0", "nan"), "a.png\n", "camera 0: nan"),
        (GOOD.replace("50.0", "-50"), "a.png\n", "camera 0 f: -50"),
        (text(2 * np.eye(3), np.zeros(3)), "a.png\n", "camera 0 rotation"),
        (text(np.diag([1, 1, -1]), np.zeros(3)), "a.png\n", "camera 0 rotation"),
        (GOOD.replace("50.0 0.0 0.0", "50.0 0.0"), "a.png\n", "five lines of three numbers"),
    ],
)
def test_bad_files_are_told(tmp_path, image, content, names, told):
    with pytest.raises(CaptureError, match=told) as error:
        read_bundler(write(tmp_path, content, names), lambda name: image)
    assert "\n" not in str(error.value)


def test_list_is_needed(tmp_path, image):
    path = write(tmp_path, GOOD)
    (tmp_path / "list.txt").unlink()
    with pytest.raises(CaptureError, match=r"list\.txt: file: missing"):
        read_bundler(path, lambda name: image)


def test_same_capture_by_both_formats(capture_folder):
    """The Bundler file of a COLMAP model: the same views."""
    by_colmap = open_capture(capture_folder).views
    flip = np.diag([1.0, -1.0, -1.0])
    blocks = [
        text(flip @ v.camera_from_world[:3, :3], flip @ v.camera_from_world[:3, 3], v.camera.focal).split("\n", 2)[2]
        for v in by_colmap
    ]
    (capture_folder / "bundle").mkdir()
    write(
        capture_folder / "bundle",
        f"# Bundle file v0.3\n{len(blocks)} 0\n" + "".join(blocks),
        "".join(f"images/{v.name}\n" for v in by_colmap),
    )
    for file in (capture_folder / "sparse" / "0").iterdir():
        file.unlink()
    by_bundler = open_capture(capture_folder).views
    assert [v.path for v in by_bundler] == [v.path for v in by_colmap]
    points = np.random.default_rng(0).uniform(-0.2, 0.2, (30, 3))
    for a, b in zip(by_colmap, by_bundler, strict=True):
        np.testing.assert_allclose(a.project(points)[0], b.project(points)[0], atol=1e-6)
