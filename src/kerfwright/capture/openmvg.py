"""OpenMVG: `sfm_data.json`, written by cereal.

x_in_camera = R (x - centre), x right, y down, z forward; rotation matrices row by row. OpenMVG counts pixels from the
middle of the first one (its image undistortion samples at whole numbers), so half a pixel is added.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kerfwright.capture.camera import Camera
from kerfwright.capture.fields import Fields, read_json, rigid
from kerfwright.capture.images import Locate
from kerfwright.capture.parsing import capture_error
from kerfwright.capture.posed import PosedImage, checked_camera

__all__ = ["find_openmvg", "read_openmvg"]

PIXEL = 0.5  # from the middle of the first pixel to its corner
FIRST_OF_TYPE = 0x80000000  # cereal marks the first object of a type so, and names the type only there
# By the name of the camera: the field that holds the lens terms, and what they are.
LENSES = {
    "pinhole": ("", ()),
    "pinhole_radial_k1": ("disto_k1", ("k1",)),
    "pinhole_radial_k3": ("disto_k3", ("k1", "k2", "k3")),
    "pinhole_brown_t2": ("disto_t2", ("k1", "k2", "k3", "p1", "p2")),
    "fisheye": ("fisheye", ("k1", "k2", "k3", "k4")),
}


def find_openmvg(folder: Path) -> list[Path]:
    """`sfm_data.json`, or another `sfm_data*.json`, of the capture's folder."""
    return [folder / "sfm_data.json"] if (folder / "sfm_data.json").is_file() else sorted(folder.glob("sfm_data*.json"))


def read_openmvg(path: Path, locate: Locate) -> list[PosedImage]:
    """Images with a pose and an intrinsic, in the order of the views.

    Raises
    ------
    CaptureError
        If the file is damaged, or a camera is none that kerfwright knows.
    """
    root = read_json(path)
    cameras = _cameras(root)
    poses = {p.key("key"): _pose(p.inner("value")) for p in root.rows("extrinsics")}
    views = [v.inner("value").inner("ptr_wrapper").inner("data") for v in root.rows("views")]
    posed = [v for v in views if v.key("id_pose") in poses]
    return [PosedImage(_name(v), _of(cameras, v), poses[v.key("id_pose")]) for v in posed]


def _name(view: Fields) -> str:
    local = view.text("local_path", "").replace("\\", "/").strip("/")
    return f"{local}/{view.text('filename')}" if local else view.text("filename")


def _of(cameras: dict[str, Camera], view: Fields) -> Camera:
    key = view.key("id_intrinsic")
    if key not in cameras:
        raise capture_error(view.path, view.at("id_intrinsic"), key, "no such intrinsic: export the file again")
    return cameras[key]


def _cameras(root: Fields) -> dict[str, Camera]:
    names: dict[int, str] = {}
    cameras = {}
    for row in root.rows("intrinsics"):
        value = row.inner("value")
        number = value.size("polymorphic_id") & ~FIRST_OF_TYPE
        names.setdefault(number, value.text("polymorphic_name", ""))
        cameras[row.key("key")] = _camera(value.inner("ptr_wrapper").inner("data"), names[number])
    return cameras


def _camera(fields: Fields, kind: str) -> Camera:
    if kind not in LENSES:
        raise capture_error(
            fields.path,
            f"{fields.place} polymorphic_name",
            kind,
            f"known are {', '.join(LENSES)}: undistort, then export",
        )
    width, height, f = fields.size("width"), fields.size("height"), fields.number("focal_length")
    cx, cy = fields.numbers("principal_point", (2,)) + PIXEL
    name, terms = LENSES[kind]
    k = dict.fromkeys(("k1", "k2", "k3", "k4", "p1", "p2"), 0.0)
    if terms:
        k.update(zip(terms, map(float, fields.numbers(name, (len(terms),))), strict=True))
    head = (f, f, float(cx), float(cy))
    if kind == "fisheye":
        params = (*head, k["k1"], k["k2"], k["k3"], k["k4"])
        return checked_camera("OPENCV_FISHEYE", width, height, params, fields.path, fields.place)
    params = (*head, k["k1"], k["k2"], k["k3"], 0.0, k["p1"], k["p2"], 0.0)
    return checked_camera("BROWN", width, height, params, fields.path, fields.place)


def _pose(fields: Fields) -> np.ndarray:
    return rigid(fields.numbers("rotation", (3, 3)), fields.numbers("center", (3,)), fields.path, fields.place)
