"""Opening a capture, and what is said when something is missing."""

from __future__ import annotations

import shutil

import cv2
import numpy as np
import pytest

from kerfwright.capture import Cloud, open_capture, write_ply
from kerfwright.errors import CaptureError, OptionError


def test_opens(capture_folder):
    capture = open_capture(capture_folder)
    assert capture.name == "stool" and len(capture.views) == 8 and capture.notes == ()
    assert capture.scale.millimetres_per_unit == 1000 and capture.scale.origin == "assumed"
    np.testing.assert_array_equal(capture.capture_from_world, np.eye(4))
    assert capture.views[0].image().shape == (48, 64, 3)
    np.testing.assert_allclose(np.linalg.norm(capture.cloud.normals, axis=1), 1)


def test_given_scale(capture_folder):
    scale = open_capture(str(capture_folder), millimetres_per_unit=25.4).scale
    assert scale.millimetres_per_unit == 25.4 and scale.origin == "given"


@pytest.mark.parametrize("scale", [0, -1, float("nan"), float("inf")])
def test_impossible_scale(capture_folder, scale):
    with pytest.raises(OptionError, match="--scale"):
        open_capture(capture_folder, millimetres_per_unit=scale)


@pytest.mark.parametrize(
    ("up", "axis"),
    [
        ("x", (1, 0, 0)),
        ("-x", (-1, 0, 0)),
        ("Y", (0, 1, 0)),
        ("-y", (0, -1, 0)),
        ("z", (0, 0, 1)),
        ("+z", (0, 0, 1)),
        ("-z", (0, 0, -1)),
        ("0,3,4", (0, 0.6, 0.8)),
        (" 1e3, 0, 0 ", (1, 0, 0)),
    ],
)
def test_up_becomes_z(capture_folder, up, axis):
    plain, turned = open_capture(capture_folder), open_capture(capture_folder, up=up)
    np.testing.assert_allclose(turned.capture_from_world[:3, :3] @ [0, 0, 1], axis, atol=1e-12)
    assert np.linalg.det(turned.capture_from_world) == pytest.approx(1)
    back = turned.cloud.points @ turned.capture_from_world[:3, :3].T
    np.testing.assert_allclose(back, plain.cloud.points, atol=1e-12)
    for a, b in zip(plain.views, turned.views, strict=True):
        np.testing.assert_allclose(a.project(plain.cloud.points)[0], b.project(turned.cloud.points)[0], atol=1e-8)


@pytest.mark.parametrize("up", ["", "w", "zz", "--z", "0,0,0", "1,2", "1,2,nan", "a,b,c", "1,2,3,4", "inf,0,0"])
def test_impossible_up(capture_folder, up):
    with pytest.raises(OptionError, match="--up"):
        open_capture(capture_folder, up=up)


def remove(folder, *names):
    for name in names:
        shutil.rmtree(folder / name) if (folder / name).is_dir() else (folder / name).unlink()


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["images"], r"stool: images: none: put"),
        (["sparse"], r"stool: cameras: none: put"),
        (["cloud.ply"], r"stool: cloud: none: put"),
        ([f"images/{k}.png" for k in range(5)], r"sparse/0: image: 0\.png: no such file in .*images, nor 4 more"),
        (["sparse/0/images.txt"], r"sparse/0/images\.txt: file: missing"),
        (["."], r"stool: capture: no such folder"),
    ],
)
def test_missing_parts_are_told(capture_folder, names, told):
    remove(capture_folder, *(names if names != ["."] else ["../stool"]))
    with pytest.raises(CaptureError, match=told) as error:
        open_capture(capture_folder)
    assert "\n" not in str(error.value)


def test_a_photograph_with_two_cameras_is_told(capture_folder):
    poses = capture_folder / "sparse" / "0" / "images.txt"
    lines = poses.read_text().splitlines()
    again = lines[2].split(maxsplit=1)[1]
    poses.write_text("\n".join([*lines, f"99 {again}", ""]) + "\n")
    with pytest.raises(CaptureError, match=r"images: \S+\.png: two cameras have this photograph"):
        open_capture(capture_folder)


def test_a_file_is_no_capture(capture_folder):
    with pytest.raises(CaptureError, match="no such folder"):
        open_capture(capture_folder / "cloud.ply")


def test_image_of_another_size_is_told(capture_folder):
    cv2.imwrite(str(capture_folder / "images" / "2.png"), np.zeros((10, 12, 3), np.uint8))
    with pytest.raises(CaptureError, match=r"2\.png: image size: 12x10: its camera says 64x48"):
        open_capture(capture_folder)


def cloud_of(points):
    return Cloud(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))


@pytest.mark.parametrize(
    ("points", "told"),
    [
        (np.zeros((3, 3)), "cloud.ply: points: 3: at least"),
        (np.zeros((0, 3)), "cloud.ply: points: 0: at least"),
        (np.ones((500, 3)), "all are at one place"),
        (
            np.where(np.arange(1500).reshape(500, 3) == 21, np.nan, 1.0 * np.arange(1500).reshape(500, 3)),
            "cloud.ply: vertex 7: .*nan.*remove",
        ),
        (
            np.where(np.arange(1500).reshape(500, 3) == 22, np.inf, 1.0 * np.arange(1500).reshape(500, 3)),
            "cloud.ply: vertex 7: .*inf.*remove",
        ),
    ],
)
def test_useless_clouds_are_told(capture_folder, points, told):
    write_ply(capture_folder / "cloud.ply", cloud_of(points))
    with pytest.raises(CaptureError, match=told) as error:
        open_capture(capture_folder)
    assert "\n" not in str(error.value)


def test_choice_of_cloud(capture_folder, generator):
    def put(name, count):
        write_ply(capture_folder / name, cloud_of(generator.normal(size=(count, 3))))

    (capture_folder / "cloud.ply").unlink()
    put("b.ply", 200)
    assert len(open_capture(capture_folder).cloud) == 200
    put("a.PLY", 300)
    assert len(open_capture(capture_folder).cloud) == 300
    put("fused.ply", 150)
    assert len(open_capture(capture_folder).cloud) == 150
    put("cloud.ply", 120)
    assert len(open_capture(capture_folder).cloud) == 120
