"""Frames: turning, moving and scaling a capture as a whole."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.errors import OptionError

__all__ = ["moved", "rotation_between", "similarity", "up_rotation"]

AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def similarity(scale: float, turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """4x4: x -> scale * turn @ x + shift."""
    out = np.eye(4)
    out[:3, :3] = scale * turn
    out[:3, 3] = shift
    return out


def moved(capture: Capture, new_from_world: np.ndarray) -> Capture:
    """The capture with another world: x_in_new = new_from_world @ x_in_world (4x4 similarity, without mirroring).

    Poses stay rigid: camera coordinates take the new unit.
    """
    scale = float(np.cbrt(np.linalg.det(new_from_world[:3, :3])))
    turn, shift = new_from_world[:3, :3] / scale, new_from_world[:3, 3]
    cloud = capture.cloud
    return replace(
        capture,
        views=tuple(_moved_view(view, scale, turn, shift) for view in capture.views),
        cloud=Cloud(cloud.points @ (scale * turn).T + shift, cloud.normals @ turn.T, cloud.colours),
        capture_from_world=capture.capture_from_world @ np.linalg.inv(new_from_world),
    )


def _moved_view(view: View, scale: float, turn: np.ndarray, shift: np.ndarray) -> View:
    """x_in_camera' = scale * x_in_camera, and x_in_world = turn.T @ (x_in_new - shift) / scale."""
    pose = np.eye(4)
    pose[:3, :3] = view.camera_from_world[:3, :3] @ turn.T
    pose[:3, 3] = scale * view.camera_from_world[:3, 3] - pose[:3, :3] @ shift
    return replace(view, camera_from_world=pose)


def rotation_between(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """The smallest turn, 3x3, that takes the direction `source` (unit, (3,)) to `target`."""
    axis, cosine = np.cross(source, target), float(source @ target)
    if cosine < 0:  # half a turn about the same axis first: what is left is well conditioned
        if np.linalg.norm(axis) < 1e-6:
            axis = np.cross(source, np.eye(3)[np.abs(source).argmin()])
        axis -= (axis @ source) * source
        axis /= np.linalg.norm(axis)
        return rotation_between(-source, target) @ (2 * np.outer(axis, axis) - np.eye(3))
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1 + cosine)


def up_rotation(up: str) -> np.ndarray:
    """4x4 turn that takes the axis `up` to +z.

    Raises
    ------
    OptionError
        If `up` is neither an axis nor three numbers.
    """
    name = up.strip().lower()
    if name.lstrip("+-") in AXES and len(name) <= 2:
        direction = np.array(AXES[name[-1]], float) * (-1 if name[0] == "-" else 1)
    else:
        direction = np.array(_three_numbers(up))
    return similarity(1.0, rotation_between(direction, np.array(AXES["z"], float)), np.zeros(3))


def _three_numbers(up: str) -> np.ndarray:
    try:
        x, y, z = map(float, up.split(","))
    except ValueError:
        x = y = z = math.nan
    length = math.hypot(x, y, z)
    if not (math.isfinite(length) and length > 0):
        raise OptionError(f"--up: {up!r}: give x, -x, y, -y, z, -z or three numbers such as 0,0.1,1")
    return np.array([x, y, z]) / length
