"""Write what `open_capture` reads: a COLMAP text model and a binary PLY cloud."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import Cloud, View

__all__ = ["write_colmap_text", "write_ply"]


def write_colmap_text(folder: Path, views: Sequence[View]) -> None:
    """Write cameras.txt, images.txt and an empty points3D.txt; equal cameras are written once.

    Parameters
    ----------
    folder : where the model goes, such as CAPTURE/sparse/0; made if it is not there
    views : names, cameras and poses; the poses are written as they are, camera_from_world
    """
    folder.mkdir(parents=True, exist_ok=True)
    camera_ids = {camera: i for i, camera in enumerate(dict.fromkeys(view.camera for view in views), 1)}
    cameras = [_camera_line(i, camera) for camera, i in camera_ids.items()]
    images = [f"{_image_line(i, view, camera_ids[view.camera])}\n" for i, view in enumerate(views, 1)]
    _write(folder / "cameras.txt", ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]", *cameras])
    _write(
        folder / "images.txt",
        ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "# POINTS2D[] as (X, Y, POINT3D_ID)", *images],
    )
    _write(folder / "points3D.txt", ["# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)"])


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _camera_line(camera_id: int, camera: Camera) -> str:
    return " ".join(map(str, (camera_id, camera.model, camera.width, camera.height, *map(float, camera.params))))


def _image_line(image_id: int, view: View, camera_id: int) -> str:
    quaternion = np.roll(Rotation.from_matrix(view.camera_from_world[:3, :3]).as_quat(canonical=True), 1)
    numbers = map(float, (*quaternion, *view.camera_from_world[:3, 3]))
    return " ".join(map(str, (image_id, *numbers, camera_id, view.name)))


def write_ply(path: Path, cloud: Cloud, *, double: bool = False) -> None:
    """Write points, normals and, where there are any, colours as a binary little-endian PLY.

    Parameters
    ----------
    double : coordinates as double instead of float, for points far from the origin
    """
    real, name = ("<f8", "double") if double else ("<f4", "float")
    fields = [(f, real, name) for f in ("x", "y", "z", "nx", "ny", "nz")]
    values = [*cloud.points.T, *cloud.normals.T]
    if cloud.colours is not None:
        fields += [(f, "u1", "uchar") for f in ("red", "green", "blue")]
        values += [*cloud.colours.T]
    rows = np.empty(len(cloud), [(f, kind) for f, kind, _ in fields])
    for (field, _, _), column in zip(fields, values, strict=True):
        rows[field] = column
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(cloud)}"]
    header += [f"property {kind} {field}" for field, _, kind in fields]
    path.write_bytes(("\n".join([*header, "end_header"]) + "\n").encode("ascii") + rows.tobytes())
