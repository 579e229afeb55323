"""Cameras of other programs: points project where the program's own formula says, to 1e-4 pixels."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest

import exports
from kerfwright.capture import Cloud, open_capture, write_ply
from kerfwright.errors import CaptureError

WRITERS = {
    "RealityCapture CSV": exports.rc_csv,
    "RealityCapture XMP": exports.rc_xmp,
    "Metashape": exports.metashape,
    "Metashape fisheye": partial(exports.metashape, kind="fisheye"),
    **{
        f"Meshroom {'.'.join(map(str, version))} {kind}": partial(exports.meshroom, version=version, kind=kind)
        for version, kind in (
            ((1, 0, 0), "radial3"),
            ((1, 2, 0), "radial3"),
            ((1, 2, 1), "brown"),
            ((1, 2, 3), "radial3"),
            ((1, 2, 6), "radial3"),
            ((1, 2, 6), "brown"),
            ((1, 2, 6), "fisheye4"),
        )
    },
    "nerfstudio": exports.nerfstudio,
    "nerfstudio fisheye": partial(exports.nerfstudio, model="OPENCV_FISHEYE"),
    **{
        f"OpenMVG {kind}": partial(exports.openmvg, kind=kind)
        for kind in ("pinhole", "pinhole_radial_k1", "pinhole_radial_k3", "pinhole_brown_t2", "fisheye")
    },
}
SCENE = exports.scene()


@pytest.fixture
def written(tmp_path):
    """Write a capture with the cameras of a program; returns its folder and the pixels of each camera."""

    def write(writer):
        exports.images(tmp_path)
        points = np.repeat(SCENE.points, 3, axis=0)
        write_ply(tmp_path / "cloud.ply", Cloud(points, np.tile([0, 0, 1.0], (len(points), 1))), double=True)
        return tmp_path, writer(tmp_path, SCENE)

    return write


@pytest.mark.parametrize("name", WRITERS)
def test_points_project_where_the_program_says(written, name):
    folder, pixels = written(WRITERS[name])
    capture = open_capture(folder)
    assert [view.path.name for view in capture.views] == list(exports.NAMES)
    worst = max(np.abs(v.project(SCENE.points)[0] - p).max() for v, p in zip(capture.views, pixels, strict=True))
    assert worst < 1e-4, f"{worst:.3g} px"


@pytest.mark.parametrize("name", WRITERS)
def test_the_way_back_from_pixels(written, name):
    folder, pixels = written(WRITERS[name])
    for k, (view, at) in enumerate(zip(open_capture(folder).views, pixels, strict=True)):
        x = SCENE.in_camera(k)
        np.testing.assert_allclose(view.camera.undistort(at), x[:, :2] / x[:, 2:], atol=1e-6)


@pytest.mark.parametrize("name", WRITERS)
def test_what_does_not_belong_to_a_lens_is_not_folded_into_the_picture(written, name):
    folder, _ = written(WRITERS[name])
    camera = open_capture(folder).views[0].camera
    r = np.linspace(0.01, 30, 3000)
    x, _ = camera.project(np.stack([r, np.zeros_like(r), np.ones_like(r)], axis=1)).T
    x = x[np.isfinite(x)]
    assert len(x) > 50 and (np.diff(x) > 0).all()


def test_missing_photographs_are_left_out_and_told(written):
    for writer in (exports.rc_csv, exports.meshroom):
        folder, _ = written(writer)
        (folder / "images" / exports.NAMES[1]).unlink()
        capture = open_capture(folder)
        assert len(capture.views) == 3
        assert any("1 of 4 photographs with cameras are not there" in note for note in capture.notes)
        for path in (folder / "cameras.csv", folder / "cameras.sfm"):
            path.unlink(missing_ok=True)


def test_two_files_of_one_program_are_refused(written):
    folder, _ = written(exports.rc_csv)
    (folder / "more.csv").write_bytes((folder / "cameras.csv").read_bytes())
    (folder / "list of parts.csv").write_text("name,length\nleg,400\n")
    with pytest.raises(CaptureError, match=r"cameras: cameras\.csv, more\.csv: keep one file of RealityCapture"):
        open_capture(folder)


def test_a_cloud_of_other_coordinates_is_refused(written):
    folder, _ = written(exports.nerfstudio)
    points = np.repeat(SCENE.points, 3, axis=0) + np.array([0, 50, 0])
    write_ply(folder / "cloud.ply", Cloud(points, np.tile([0, 0, 1.0], (len(points), 1))), double=True)
    with pytest.raises(CaptureError, match=r"in view of a camera: 0\.0 %: .*different coordinates"):
        open_capture(folder)


def test_other_xmp_is_passed_over(written):
    folder, _ = written(exports.rc_xmp)
    (folder / "images" / "lightroom.xmp").write_text('<x:xmpmeta xmlns:x="adobe:ns:meta/"></x:xmpmeta>')
    assert len(open_capture(folder).views) == 4


def edited(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.parametrize(
    ("writer", "file", "old", "new", "told"),
    [
        (exports.rc_csv, "cameras.csv", "0.05,-0.01,0.004,0.0011,-0.0007", "0,0,0,0,0", "row 1 k1: -0.12: .*division"),
        (exports.rc_csv, "cameras.csv", ",27.5,", ",27,5,", "row 1: .*16 columns"),
        (exports.rc_csv, "cameras.csv", ",27.5,", ",nan,", "row 1 f: nan"),
        (exports.rc_xmp, "images/x.xmp", "brown4t2", "division", "DistortionModel: division: .*Brown3"),
        (exports.rc_xmp, "images/x.xmp", 'Skew="0"', 'Skew="0.1"', "Skew: 0.1"),
        (exports.rc_xmp, "images/x.xmp", "<x:xmpmeta", "<!DOCTYPE a><x:xmpmeta", "XML: <!DOCTYPE"),
        (exports.metashape, "cameras.xml", "<b1>", "<p3>0.1</p3><b1>", "sensor 0 p3: 0.1"),
        (exports.metashape, "cameras.xml", 'calibration type="frame"', 'calibration type="spherical"', "spherical"),
        (exports.metashape, "cameras.xml", 'version="2.0.0"', 'version="0.9"', "document version: 0.9"),
        (exports.metashape, "cameras.xml", "0.3 -1.0 0.7", "4e6 1e6 4e6", "georeferenced: .*Local Coordinates"),
        (exports.meshroom, "cameras.sfm", '"radial3"', '"3deanamorphic4"', "type: 3deanamorphic4"),
        (exports.meshroom, "cameras.sfm", '"focalLength"', '"focal"', r"intrinsics\[0\].focalLength: missing"),
        (exports.nerfstudio, "transforms.json", '"OPENCV"', '"EQUIRECTANGULAR"', "camera_model: EQUIRECTANGULAR"),
        (exports.nerfstudio, "transforms.json", '"fl_x"', '"flx"', r"frames\[0\].fl_x: missing"),
        (exports.openmvg, "sfm_data.json", "pinhole_brown_t2", "spherical", "polymorphic_name: spherical"),
        (exports.openmvg, "sfm_data.json", '"extrinsics"', '"extrinsic"', "extrinsics: missing"),
    ],
)
def test_what_cannot_be_read_is_told(written, writer, file, old, new, told):
    folder, _ = written(writer)
    edited(folder / file, old, new)
    with pytest.raises(CaptureError, match=told) as error:
        open_capture(folder)
    assert "\n" not in str(error.value) and file.split("/")[-1] in str(error.value)


def test_a_scene_of_nerf_has_angles_and_names_without_ending(written):
    folder, _ = written(exports.nerfstudio)
    content = json.loads((folder / "transforms.json").read_text())
    frames = [
        {"file_path": f"./images/{name[:-4]}", "transform_matrix": frame["transform_matrix"]}
        for name, frame in zip(exports.NAMES, content["frames"], strict=True)
    ]
    (folder / "transforms.json").write_text(json.dumps({"camera_angle_x": 0.9, "frames": frames}))
    view = open_capture(folder).views[0]
    x = SCENE.in_camera(0)
    focal = 320 / np.tan(0.45)
    np.testing.assert_allclose(view.project(SCENE.points)[0], focal * x[:, :2] / x[:, 2:] + [320, 240], atol=1e-9)
