"""A walk round the object: rings of camera positions as a person takes them, none quite where it was meant."""

from __future__ import annotations

import numpy as np

from kerfwright.capture import Camera
from kerfwright.synthetic.options import DatasetOptions

__all__ = ["camera_path", "camera_rays", "intrinsics", "looking_at"]

# Share of the pictures, elevation in degrees and its spread: how the shared captures were walked.
RINGS = ((0.31, 10, 3), (0.34, 31, 3), (0.25, 52, 4), (0.10, 75, 2))


def intrinsics(options: DatasetOptions) -> Camera:
    """The camera that all pictures are taken with."""
    focal = options.width / 2 / np.tan(np.radians(options.field_of_view) / 2)
    cx, cy = options.width / 2, options.height / 2
    lens = (
        (focal, cx, cy)
        if options.camera_model.startswith("SIMPLE") or options.camera_model == "RADIAL"
        else (focal, focal, cx, cy)
    )
    return Camera(options.camera_model, options.width, options.height, (*map(float, lens), *options.distortion))


def camera_path(low: np.ndarray, high: np.ndarray, options: DatasetOptions, rng: np.random.Generator) -> np.ndarray:
    """(V, 4, 4) camera_from_model, mm, of pictures taken round the box from `low` to `high`."""
    centre, largest = (low + high) / 2, float((high - low).max())
    diagonal = float(np.linalg.norm(high - low))
    counts = np.diff(np.round(np.cumsum([0, *(share for share, _, _ in RINGS)]) * options.images)).astype(int)
    poses = []
    for count, (_, elevation, spread) in zip(counts, RINGS, strict=True):
        for k in range(count):
            around = 2 * np.pi * (k + rng.uniform(-0.2, 0.2)) / count + elevation
            up = np.radians(elevation + rng.normal(0, spread))
            reach = options.distance * diagonal * rng.uniform(0.9, 1.12)
            eye = centre + reach * np.array([np.cos(around) * np.cos(up), np.sin(around) * np.cos(up), np.sin(up)])
            eye[2] = max(eye[2], 0.1 * largest)
            poses.append(looking_at(eye, centre + rng.normal(0, 0.03 * largest, 3), np.radians(rng.normal(0, 1.5))))
    return np.array(poses)


def looking_at(eye: np.ndarray, target: np.ndarray, roll: float = 0.0) -> np.ndarray:
    """(4, 4) camera_from_model: x right, y down, z towards the target; rolled about z by radians."""
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, (0, 0, 1.0))
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    c, s = np.cos(roll), np.sin(roll)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ np.stack([x, y, z])
    pose[:3, 3] = -pose[:3, :3] @ eye
    return pose


def camera_rays(camera: Camera, samples: int = 1) -> np.ndarray:
    """(height * samples, width * samples, 3) directions in the camera, z = 1, through the middles of subpixels."""
    x = (np.arange(camera.width * samples) + 0.5) / samples
    y = (np.arange(camera.height * samples) + 0.5) / samples
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    flat = np.concatenate([camera.undistort(pixels), np.ones((len(pixels), 1))], axis=1)
    return flat.reshape(len(y), len(x), 3).astype(np.float32)
