"""Meshroom and AliceVision: `.sfm`, JSON of views, intrinsics and poses (sfmDataIO/jsonIO.cpp tells versions apart).

x_in_camera = R (x - centre), x right, y down, z forward; R is written column by column. AliceVision counts pixels from
the middle of the first one (its UndistortImage samples at whole numbers), so half a pixel is added.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kerfwright.capture.camera import Camera
from kerfwright.capture.fields import Fields, read_json, rigid
from kerfwright.capture.images import Locate
from kerfwright.capture.parsing import capture_error
from kerfwright.capture.posed import PosedImage, checked_camera

__all__ = ["find_alicevision", "read_alicevision"]

PIXEL = 0.5  # from the middle of the first pixel to its corner
# Format versions that changed how lengths are told.
FROM_MIDDLE, PAIRS, MILLIMETRES, RATIO = (1, 2, 1), (1, 2, 0), (1, 2, 2), (1, 2, 5)
# By the name of the distortion, or before version 1.2.4 or so of the camera: which parameters follow each other.
LENSES = {
    "none": (),
    "pinhole": (),
    "radialk1": ("k1",),
    "radial1": ("k1",),
    "radialk3": ("k1", "k2", "k3"),
    "radial3": ("k1", "k2", "k3"),
    "brown": ("k1", "k2", "k3", "p1", "p2"),
    "fisheye4": ("k1", "k2", "k3", "k4"),
    "fisheye": ("k1", "k2", "k3", "k4"),
}


def find_alicevision(folder: Path) -> list[Path]:
    """`.sfm` files of the capture's folder."""
    return sorted(path for path in folder.glob("*.sfm") if path.is_file())


def read_alicevision(path: Path, locate: Locate) -> list[PosedImage]:
    """Images with a pose and an intrinsic, in the order of the views.

    Raises
    ------
    CaptureError
        If the file is damaged, or a camera is none that kerfwright knows.
    """
    root = read_json(path)
    version = tuple(int(v) for v in root.numbers("version", (3,)))
    cameras = {c.key("intrinsicId"): _camera(c, version) for c in root.rows("intrinsics")}
    poses = {p.key("poseId"): _pose(p) for p in root.rows("poses")}
    views = [v for v in root.rows("views") if "poseId" in v and v.key("poseId") in poses]
    return [PosedImage(v.text("path"), _of(cameras, v), poses[v.key("poseId")]) for v in views]


def _of(cameras: dict[str, Camera], view: Fields) -> Camera:
    key = view.key("intrinsicId")
    if key not in cameras:
        raise capture_error(view.path, view.at("intrinsicId"), key, "no such intrinsic: export the file again")
    return cameras[key]


def _camera(fields: Fields, version: tuple[int, ...]) -> Camera:
    width, height = fields.size("width"), fields.size("height")
    kind = fields.text("distortionType", fields.text("type", "pinhole"))
    body = fields.text("type", "pinhole")
    lens = kind if kind in LENSES and body not in ("equidistant",) else None
    if lens is None or (body not in LENSES):
        raise capture_error(
            fields.path,
            fields.at("type"),
            f"{body} {kind}",
            f"known are {', '.join(LENSES)}: undistort, then export again",
        )
    fx, fy = _focal(fields, width, version)
    cx, cy = fields.numbers("principalPoint", (2,)) + PIXEL
    if version >= FROM_MIDDLE:
        cx, cy = cx + width / 2, cy + height / 2
    k = _lens(fields, LENSES[lens])
    head = (fx, fy, float(cx), float(cy))
    if lens.startswith("fisheye"):
        params = (*head, k["k1"], k["k2"], k["k3"], k["k4"])
        return checked_camera("OPENCV_FISHEYE", width, height, params, fields.path, fields.place)
    params = (*head, k["k1"], k["k2"], k["k3"], 0.0, k["p1"], k["p2"], 0.0)
    return checked_camera("BROWN", width, height, params, fields.path, fields.place)


def _lens(fields: Fields, names: tuple[str, ...]) -> dict[str, float]:
    out = dict.fromkeys(("k1", "k2", "k3", "k4", "p1", "p2"), 0.0)
    if names and "distortionParams" in fields and fields.content["distortionParams"] != "":
        values = fields.numbers("distortionParams", (-1,))
        if len(values) not in (0, len(names)):
            raise capture_error(
                fields.path,
                fields.at("distortionParams"),
                len(values),
                f"{len(names)} belong here: export the file again",
            )
        out.update(zip(names, map(float, values), strict=False))
    return out


def _focal(fields: Fields, width: int, version: tuple[int, ...]) -> tuple[float, float]:
    """Focal lengths in pixels, whichever way the version tells them."""
    if version < PAIRS:
        f = fields.number("pxFocalLength")
        return f, f
    if version < MILLIMETRES:
        fx, fy = fields.numbers("pxFocalLength", (2,))
        return float(fx), float(fy)
    sensor = fields.number("sensorWidth", 36.0)
    if sensor <= 0:
        raise capture_error(fields.path, fields.at("sensorWidth"), sensor, "more than 0: export the file again")
    fx = fields.number("focalLength") / sensor * width
    ratio = fields.number("pixelRatio", 1.0)
    if ratio <= 0:
        raise capture_error(fields.path, fields.at("pixelRatio"), ratio, "more than 0: export the file again")
    return fx, fx * ratio if version >= RATIO else fx / ratio


def _pose(fields: Fields) -> np.ndarray:
    transform = fields.inner("pose").inner("transform")
    turn = transform.numbers("rotation", (9,)).reshape(3, 3).T
    return rigid(turn, transform.numbers("center", (3,)), fields.path, fields.place)
