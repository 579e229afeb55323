"""Camera models of COLMAP: from camera coordinates to pixels and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["CAMERA_MODELS", "Camera"]

# Parameters of each model in COLMAP's order.
CAMERA_MODELS = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
}


@dataclass(frozen=True)
class Camera:
    """Intrinsics. The centre of the top left pixel is (0.5, 0.5); params in the order of CAMERA_MODELS[model]."""

    model: str
    width: int
    height: int
    params: tuple[float, ...]

    def _named(self) -> dict[str, float]:
        return dict(zip(CAMERA_MODELS[self.model], self.params, strict=True))

    @property
    def matrix(self) -> np.ndarray:
        """3x3 calibration matrix, pixels."""
        p = self._named()
        fx, fy = p.get("fx", p.get("f")), p.get("fy", p.get("f"))
        return np.array([[fx, 0, p["cx"]], [0, fy, p["cy"]], [0, 0, 1.0]])

    @property
    def distortion(self) -> np.ndarray:
        """(k1, k2, p1, p2) of the OpenCV model; zeros where the model has none."""
        p = self._named()
        return np.array([p.get(k, 0.0) for k in ("k1", "k2", "p1", "p2")])

    @property
    def focal(self) -> float:
        """Mean focal length in pixels."""
        return float(np.mean(np.diag(self.matrix)[:2]))

    def distort(self, xy: np.ndarray) -> np.ndarray:
        """(N, 2) ideal to distorted coordinates on the plane z = 1."""
        k1, k2, p1, p2 = self.distortion
        if not self.distortion.any():
            return xy
        x, y = xy[:, 0], xy[:, 1]
        r2 = x * x + y * y
        radial = 1 + k1 * r2 + k2 * r2 * r2
        return np.stack([
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ], axis=1)

    def project(self, x_in_camera: np.ndarray) -> np.ndarray:
        """(N, 3) camera to (N, 2) pixels; NaN where z <= 0."""
        z = np.where(x_in_camera[:, 2] > 0, x_in_camera[:, 2], np.nan)
        xy = self.distort(x_in_camera[:, :2] / z[:, None])
        return xy @ self.matrix[:2, :2].T + self.matrix[:2, 2]

    def undistort(self, pixels: np.ndarray, steps: int = 20) -> np.ndarray:
        """(N, 2) pixels to (N, 2) ideal coordinates on the plane z = 1, by fixed-point iteration."""
        target = (pixels - self.matrix[:2, 2]) / np.diag(self.matrix)[:2]
        xy = target.copy()
        if self.distortion.any():
            for _ in range(steps):
                xy += target - self.distort(xy)
        return xy
