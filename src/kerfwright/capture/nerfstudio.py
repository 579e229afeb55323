"""nerfstudio's and instant-ngp's `transforms.json` (docs.nerf.studio, Data conventions).

`transform_matrix` leads from the camera (x right, y up, looking along -z) to the world. Pixels are COLMAP's: the first
one's middle is at 0.5. k1 to k4 are the factors of r^2 to r^8.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from kerfwright.capture.camera import Camera
from kerfwright.capture.fields import Fields, read_json, rigid
from kerfwright.capture.images import Locate, image_size
from kerfwright.capture.parsing import capture_error
from kerfwright.capture.posed import PosedImage, checked_camera

__all__ = ["find_nerfstudio", "read_nerfstudio"]

CV_FROM_GL = np.diag([1.0, -1.0, -1.0])
PINHOLES = frozenset({"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE"})
LENS = ("k1", "k2", "k3", "k4", "p1", "p2")


def find_nerfstudio(folder: Path) -> list[Path]:
    """`transforms.json` of the capture's folder."""
    return [path for path in (folder / "transforms.json",) if path.is_file()]


def read_nerfstudio(path: Path, locate: Locate) -> list[PosedImage]:
    """Images in the order of the frames; what a frame says of its camera goes before what the file says of all.

    Raises
    ------
    CaptureError
        If the file is damaged, or a camera is none that kerfwright knows.
    """
    root = read_json(path)
    images = [_image(Fields(root.content | f.content, path, f.place), f, locate) for f in root.rows("frames")]
    return [image for image in images if image]


def _image(fields: Fields, frame: Fields, locate: Locate) -> PosedImage | None:
    name = frame.text("file_path")
    file = locate(name)
    if file is None:
        return None
    matrix = frame.numbers("transform_matrix", (-1, 4))
    if len(matrix) not in (3, 4):
        raise capture_error(frame.path, frame.at("transform_matrix"), len(matrix), "3 or 4 rows: export the file again")
    pose = rigid(CV_FROM_GL @ matrix[:3, :3].T, matrix[:3, 3], frame.path, frame.place)
    return PosedImage(name, _camera(fields, file), pose)


def _camera(fields: Fields, file: Path) -> Camera:
    model = fields.text("camera_model", "OPENCV").upper()
    width, height = (fields.size("w"), fields.size("h")) if "w" in fields and "h" in fields else image_size(file)
    fx = _focal(fields, "fl_x", "camera_angle_x", width)
    fy = _focal(fields, "fl_y", "camera_angle_y", height, fx)
    head = (fx, fy, fields.number("cx", width / 2), fields.number("cy", height / 2))
    lens = {name: fields.number(name, 0.0) for name in LENS}
    if model == "OPENCV_FISHEYE":
        params = (*head, *(lens[k] for k in LENS[:4]))
        return checked_camera("OPENCV_FISHEYE", width, height, params, fields.path, fields.place)
    if model not in PINHOLES:
        known = ", ".join(sorted(PINHOLES | {"OPENCV_FISHEYE"}))
        raise capture_error(fields.path, fields.at("camera_model"), model, f"known are {known}: undistort first")
    params = (*head, *(lens.values() if model == "OPENCV" else (0.0,) * 6), 0.0)
    return checked_camera("BROWN", width, height, params, fields.path, fields.place)


def _focal(fields: Fields, length: str, angle: str, side: int, default: float | None = None) -> float:
    """A focal length in pixels, told itself or by the field of view that it gives."""
    if length in fields:
        return fields.number(length)
    if angle in fields:
        half = fields.number(angle) / 2
        if not 0 < half < math.pi / 2:
            raise capture_error(fields.path, fields.at(angle), 2 * half, "radians below pi: export the file again")
        return side / 2 / math.tan(half)
    return fields.number(length) if default is None else default
