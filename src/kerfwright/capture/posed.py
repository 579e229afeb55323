"""What a reader of camera files hands over: an image's name, its camera and its pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from kerfwright.capture.camera import CAMERA_MODELS, Camera
from kerfwright.capture.parsing import capture_error

__all__ = ["LARGEST_NUMBER", "PosedImage", "checked_camera", "pose_matrix"]

LARGEST_NUMBER = 1e12  # of a pose or a place, any unit: squares of it are exact enough, and nothing real comes near
LARGEST_SIDE = 1_000_000  # pixels; far above any sensor or panorama, far below what a damaged file claims


@dataclass(frozen=True, eq=False)
class PosedImage:
    """x_in_camera = camera_from_capture @ x_in_capture (4x4, rigid); the name is as the file writes it."""

    name: str
    camera: Camera
    camera_from_capture: np.ndarray


def checked_camera(model: str, width: int, height: int, params: tuple[float, ...], path: Path, field: str) -> Camera:
    """A camera whose numbers make sense.

    Raises
    ------
    CaptureError
        If the model is unknown, or a size, focal length or parameter is impossible.
    """
    if model not in CAMERA_MODELS:
        known = ", ".join(sorted(CAMERA_MODELS))
        raise capture_error(
            path, f"{field} model", model, f"kerfwright knows {known}: undistort the images, then export again"
        )
    if len(params) != len(CAMERA_MODELS[model]):
        raise capture_error(
            path, f"{field} parameters", len(params), f"{model} has {len(CAMERA_MODELS[model])}: export the file again"
        )
    for name, size in (("width", width), ("height", height)):
        if not 0 < size <= LARGEST_SIDE:
            raise capture_error(
                path, f"{field} {name}", size, f"between 1 and {LARGEST_SIDE} pixels: export the file again"
            )
    for name, value in zip(CAMERA_MODELS[model], params, strict=True):
        if not math.isfinite(value) or (name in ("f", "fx", "fy") and value <= 0):
            raise capture_error(path, f"{field} {name}", value, "impossible for a camera: export the file again")
    return Camera(model, width, height, params)


def pose_matrix(quaternion: np.ndarray, translation: np.ndarray, path: Path, field: str) -> np.ndarray:
    """4x4 from a quaternion (w, x, y, z), normalised here, and a translation.

    Raises
    ------
    CaptureError
        If a number is NaN or absurdly large, or the quaternion is zero.
    """
    if not (np.abs([*quaternion, *translation]) < LARGEST_NUMBER).all():  # NaN is not either
        raise capture_error(
            path, field, [*quaternion, *translation], "not a pose: export the file again"
        )
    if np.linalg.norm(quaternion) < 1e-6:
        raise capture_error(path, f"{field} quaternion", quaternion, "its length must be 1: export the file again")
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()
    pose[:3, 3] = translation
    return pose
