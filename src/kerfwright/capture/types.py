"""What a capture holds: cameras, views, an oriented cloud, and where the world lies in the capture's own frame.

Frames: *capture* is the frame and unit of the files. *world* is what every later stage works in and becomes the *model*
frame: right-handed, millimetres, +z up, floor at z = 0, the object about the origin. A capture as read has world =
capture, turned so that +z is up; `kerfwright.capture.prepare` moves it. *camera* is x right, y down, z forward.
Pixels: the centre of the top left pixel is (0.5, 0.5), as in COLMAP.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from kerfwright.capture.camera import Camera
from kerfwright.errors import CaptureError
from kerfwright.model import Scale

__all__ = ["Capture", "Cloud", "View"]


@dataclass(frozen=True, eq=False)
class View:
    """A photograph with its camera and pose: x_in_camera = camera_from_world @ x_in_world (4x4, rigid).

    One pixel of `camera` and `image` is the mean of `shrink` x `shrink` pixels of the file.
    """

    name: str
    path: Path
    camera: Camera
    camera_from_world: np.ndarray
    shrink: int = 1

    @property
    def centre(self) -> np.ndarray:
        """Centre of projection in world, (3,)."""
        return -self.camera_from_world[:3, :3].T @ self.camera_from_world[:3, 3]

    def to_camera(self, x_in_world: np.ndarray) -> np.ndarray:
        """(N, 3) world to (N, 3) camera."""
        return x_in_world @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3]

    def project(self, x_in_world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) world to (N, 2) pixels, distortion included, and (N,) depth; pixels are NaN where depth <= 0."""
        from kerfwright.capture._lens import project_points

        return project_points(np.asarray(x_in_world, float), self.camera_from_world, self.camera.lens)

    def image(self) -> np.ndarray:
        """The photograph, (height, width, 3) uint8 RGB, shrunk, but distorted as on disk. Read anew at each call.

        Raises CaptureError when the file is missing, unreadable, or of another size than its camera.
        """
        import cv2

        pixels = self._as_on_disk()
        width, height = self.camera.width, self.camera.height
        if (pixels.shape[1] // self.shrink, pixels.shape[0] // self.shrink) != (width, height):
            raise CaptureError(
                f"{self.path}: image size: {pixels.shape[1]}x{pixels.shape[0]}, but its camera says "
                f"{width * self.shrink}x{height * self.shrink}: use the images the cameras were computed for"
            )
        if self.shrink > 1:
            whole = pixels[: height * self.shrink, : width * self.shrink]
            pixels = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
        return pixels

    def _as_on_disk(self) -> np.ndarray:
        import cv2

        try:
            pixels = cv2.imread(str(self.path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
        except cv2.error:  # more pixels than OpenCV takes
            pixels = None
        if pixels is None:
            raise CaptureError(f"{self.path}: image: cannot be read: check that the file is a whole JPEG, PNG or TIFF")
        return cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB)


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points with outward unit normals, world frame: (N, 3) float64 each; colours (N, 3) uint8 or None."""

    points: np.ndarray
    normals: np.ndarray
    colours: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def diameter(self) -> float:
        """Largest side of the bounding box (the paper's D)."""
        return float(np.ptp(self.points, axis=0).max())

    def select(self, keep: np.ndarray) -> Cloud:
        """The points that a mask or an index array picks."""
        return Cloud(self.points[keep], self.normals[keep], None if self.colours is None else self.colours[keep])


@dataclass(frozen=True, eq=False)
class Capture:
    """Views and cloud of one object. x_in_capture = capture_from_world @ x_in_world (4x4 similarity)."""

    name: str
    views: tuple[View, ...]
    cloud: Cloud
    scale: Scale
    capture_from_world: np.ndarray = field(default_factory=lambda: np.eye(4))
    notes: tuple[str, ...] = ()  # what a person should know of how it was read
