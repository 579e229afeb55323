"""COLMAP models: what is written is read back, and damage is told in one line."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kerfwright.capture import Camera, View, write_colmap_text
from kerfwright.capture.camera import COLMAP_MODELS
from kerfwright.capture.colmap import find_colmap, read_colmap
from kerfwright.errors import CaptureError

NUMBERS = st.floats(-1e6, 1e6, allow_nan=False)
NAMES = st.text(st.characters(exclude_categories=("Cs", "Cc", "Zl", "Zp", "Zs")), min_size=1, max_size=12).map(
    lambda s: f"a {s} é.jpg"
)


@st.composite
def views(draw) -> View:
    model = draw(st.sampled_from(sorted(COLMAP_MODELS)))
    lengths = st.floats(1, 1e5)
    params = tuple(draw(lengths if name in ("f", "fx", "fy") else st.floats(-2, 2)) for name in COLMAP_MODELS[model])
    camera = Camera(model, draw(st.integers(1, 20000)), draw(st.integers(1, 20000)), params)
    pose = np.eye(4)
    turn = np.array([draw(st.floats(-1, 1)) for _ in range(4)])
    pose[:3, :3] = Rotation.from_quat(turn if np.linalg.norm(turn) > 1e-3 else [0, 0, 0, 1.0]).as_matrix()
    pose[:3, 3] = [draw(NUMBERS) for _ in range(3)]
    return View(draw(NAMES), Path("-"), camera, pose)


def assert_same(images, written):
    assert [i.name for i in images] == [v.name for v in written]
    for image, view in zip(images, written, strict=True):
        assert image.camera == view.camera
        np.testing.assert_allclose(image.camera_from_capture[:3, :3], view.camera_from_world[:3, :3], atol=1e-12)
        np.testing.assert_array_equal(image.camera_from_capture[:, 3], view.camera_from_world[:, 3])


@settings(max_examples=60, deadline=None)
@given(st.lists(views(), min_size=1, max_size=4))
def test_text_round_trip(tmp_path_factory, written):
    folder = tmp_path_factory.mktemp("colmap")
    write_colmap_text(folder, written)
    assert_same(read_colmap(folder), written)


@settings(max_examples=60, deadline=None)
@given(st.lists(views(), min_size=1, max_size=4))
def test_binary_round_trip(tmp_path_factory, write_binary, written):
    folder = tmp_path_factory.mktemp("colmap")
    write_binary(folder, written)
    assert_same(read_colmap(folder), written)


CAMERAS = "# list\n1 PINHOLE 64 48 50 50 32 24\n"
IMAGE = "1 1 0 0 0 0.1 0.2 0.3 1 a.png\n"


@pytest.fixture
def model(tmp_path):
    def write(cameras=CAMERAS, images=IMAGE, encoding="utf-8"):
        (tmp_path / "cameras.txt").write_bytes(cameras.encode(encoding))
        (tmp_path / "images.txt").write_bytes(images.encode(encoding))
        return tmp_path

    return write


@pytest.mark.parametrize(
    "images",
    [
        IMAGE + "\n" + IMAGE.replace("a.png", "b.png") + "\n",
        IMAGE + "1.5 2.5 -1 3.5 4.5 7\n" + IMAGE.replace("a.png", "b.png") + "1 2 3\n",
        IMAGE + IMAGE.replace("a.png", "b.png"),  # without the empty lines
        "# comment\n" + IMAGE + "\n# comment\n" + IMAGE.replace("a.png", "b.png"),
        (IMAGE + "\n" + IMAGE.replace("a.png", "b.png") + "\n").replace("\n", "\r\n"),
        "\ufeff" + IMAGE + "\n" + IMAGE.replace("a.png", "b.png"),
    ],
    ids=["empty", "points", "left out", "comments", "CRLF", "byte order mark"],
)
def test_lines_of_points(model, images):
    assert [i.name for i in read_colmap(model(images=images))] == ["a.png", "b.png"]


def test_three_word_name_after_points(model):
    images = IMAGE + "1 2 3\n" + IMAGE.replace("a.png", "my 2 3.png") + "\n"
    assert [i.name for i in read_colmap(model(images=images))] == ["a.png", "my 2 3.png"]


def test_quaternion_is_normalised(model):
    pose = read_colmap(model(images=IMAGE.replace("1 1 0 0 0", "1 2 0 0 2")))[0].camera_from_capture
    np.testing.assert_allclose(pose[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


@pytest.mark.parametrize(
    ("cameras", "images", "told"),
    [
        (
            CAMERAS.replace("PINHOLE", "THIN_PRISM_FISHEYE"),
            IMAGE,
            ("cameras.txt: line 2 model: THIN_PRISM_FISHEYE", "undistort"),
        ),
        (CAMERAS.replace("PINHOLE", "MYCAM"), IMAGE, ("cameras.txt: line 2 model: MYCAM",)),
        (CAMERAS.replace(" 24", ""), IMAGE, ("line 2 parameters: 3", "PINHOLE has 4")),
        (CAMERAS.replace(" 24", " 24,5"), IMAGE, ("parameter 4: 24,5", "decimal point")),
        (CAMERAS.replace(" 24", " nan"), IMAGE, ("parameter 4: nan",)),
        (CAMERAS.replace("50 50", "50 -50"), IMAGE, ("line 2 fy: -50",)),
        (CAMERAS.replace("64 48", "64 0"), IMAGE, ("line 2 height: 0",)),
        (CAMERAS.replace("64 48", "64 ４８"), IMAGE, ("line 2 height",)),
        (CAMERAS.replace("64 48", "1" * 5000 + " 48"), IMAGE, ("line 2 width: 111",)),
        (CAMERAS.replace("64 48 50 50 32 24", ""), IMAGE, ("line 2: 1 PINHOLE", "expected CAMERA_ID")),
        ("", IMAGE, ("images.txt: line 1 camera id: 1", "no such camera")),
        (CAMERAS, IMAGE.replace("1 a.png", "7 a.png"), ("images.txt: line 1 camera id: 7",)),
        (CAMERAS, IMAGE.replace("0.2", "0,2"), ("line 1 TY: 0,2", "decimal point")),
        (CAMERAS, IMAGE.replace("0.2", "inf"), ("line 1 TY: inf",)),
        (CAMERAS, IMAGE.replace("1 1 0 0 0", "1 0 0 0 0"), ("line 1 quaternion",)),
        (CAMERAS, "1 1 0 0 0 0.1 0.2\n", ("line 1: 1 1 0 0 0 0.1 0.2", "expected IMAGE_ID")),
    ],
)
def test_bad_text_is_told(model, cameras, images, told):
    with pytest.raises(CaptureError) as error:
        read_colmap(model(cameras, images))
    assert all(part in str(error.value) for part in told), str(error.value)
    assert "\n" not in str(error.value) and len(str(error.value)) < 500


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_other_encodings_are_told(model, encoding):
    with pytest.raises(CaptureError, match="save the file as UTF-8"):
        read_colmap(model(cameras="# é\n" + CAMERAS, encoding=encoding))


def test_binary_comes_first_and_needs_both(tmp_path, write_binary, shapes):
    view = shapes["ring"](2, 1.0, 0.5, np.zeros(3), tmp_path)
    write_colmap_text(tmp_path, view[:1])
    write_binary(tmp_path, view)
    assert len(read_colmap(tmp_path)) == 2
    (tmp_path / "images.bin").unlink()
    assert len(read_colmap(tmp_path)) == 1
    (tmp_path / "images.txt").unlink()
    with pytest.raises(CaptureError, match=r"images\.txt: file: missing"):
        read_colmap(tmp_path)


@pytest.mark.parametrize("place", ["sparse/0", "sparse", "."])
def test_model_is_found(tmp_path, place):
    assert find_colmap(tmp_path) is None
    (tmp_path / place).mkdir(parents=True, exist_ok=True)
    (tmp_path / place / "cameras.txt").write_text(CAMERAS)
    assert find_colmap(tmp_path) == tmp_path / place


def test_every_cut_of_a_binary_model_is_told(tmp_path, write_binary, shapes):
    write_binary(tmp_path, shapes["ring"](2, 1.0, 0.5, np.zeros(3), tmp_path))
    for name in ("cameras.bin", "images.bin"):
        whole = (tmp_path / name).read_bytes()
        for end in range(len(whole)):
            (tmp_path / name).write_bytes(whole[:end])
            with pytest.raises(CaptureError, match=r"cut short"):
                read_colmap(tmp_path)
        (tmp_path / name).write_bytes(whole)


@pytest.mark.parametrize(
    ("name", "at", "value", "told"),
    [
        ("cameras.bin", 0, struct.pack("<Q", 10**12), "cut short"),
        ("cameras.bin", 12, struct.pack("<i", 7), "FOV"),
        ("cameras.bin", 12, struct.pack("<i", -3), "number -3"),
        ("cameras.bin", 16, struct.pack("<Q", 10**12), "camera 0 width"),
        ("images.bin", 0, struct.pack("<Q", 10**18), "cut short"),
        ("images.bin", 12, struct.pack("<d", np.nan), "image 0"),
        ("images.bin", 68, struct.pack("<I", 99), "camera id: 99"),
        ("images.bin", 72, b"\xff\xfe", "UTF-8"),
        ("images.bin", 78, struct.pack("<Q", 2**63), "cut short"),
    ],
)
def test_bad_binary_is_told(tmp_path, write_binary, shapes, name, at, value, told):
    write_binary(tmp_path, shapes["ring"](2, 1.0, 0.5, np.zeros(3), tmp_path))
    data = bytearray((tmp_path / name).read_bytes())
    data[at : at + len(value)] = value
    (tmp_path / name).write_bytes(data)
    with pytest.raises(CaptureError, match=told) as error:
        read_colmap(tmp_path)
    assert "\n" not in str(error.value)
