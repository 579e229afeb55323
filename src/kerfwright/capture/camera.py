"""Camera models: from camera coordinates to pixels and back. COLMAP's by its names, and Brown's with more terms."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

__all__ = ["CAMERA_MODELS", "COLMAP_MODELS", "Camera"]

# Parameters of each model in COLMAP's order. RATIONAL has k4 to k6 below the fraction line, EQUIDISTANT polynomials are
# of the angle to the axis instead of its tangent.
COLMAP_MODELS = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "SIMPLE_RADIAL_FISHEYE": ("f", "cx", "cy", "k1"),
    "RADIAL_FISHEYE": ("f", "cx", "cy", "k1", "k2"),
}
# Not COLMAP's: Brown's model with k4 as the factor of r^8, and a shear, by which x on z = 1 grows with y.
CAMERA_MODELS = COLMAP_MODELS | {
    "BROWN": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2", "shear"),
    "FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "shear"),
}
RATIONAL = frozenset({"FULL_OPENCV"})
EQUIDISTANT = frozenset({"OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "FISHEYE"})
LENS_TERMS = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "shear")
WIDEST = 5.0  # tangent of the largest angle to the axis that is looked at for a fold: 79 degrees
SETTLED = 1e-11  # step, on the plane z = 1, at which the way back from pixels has arrived: far less than a pixel


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
        """3x3 calibration matrix, pixels; diagonal but for the principal point."""
        p = self._named()
        fx, fy = p.get("fx", p.get("f")), p.get("fy", p.get("f"))
        return np.array([[fx, 0, p["cx"]], [0, fy, p["cy"]], [0, 0, 1.0]])

    def scaled(self, factor: float) -> Camera:
        """The camera of the picture made larger by a factor; what is left over of a pixel at the rim is cut off."""
        values = tuple(v if name in LENS_TERMS else v * factor for name, v in self._named().items())
        width, height = (int(size * factor + 1e-6) for size in (self.width, self.height))
        return Camera(self.model, width, height, values)

    @property
    def distortion(self) -> np.ndarray:
        """What bends the picture: all zero if and only if `distort` changes nothing.

        In the order of LENS_TERMS, and 1 at the end for a fisheye, whose projection itself bends.
        """
        p = self._named()
        return np.array([*(p.get(k, 0.0) for k in LENS_TERMS), float(self.model in EQUIDISTANT)])

    @property
    def focal(self) -> float:
        """Mean focal length in pixels."""
        return float(np.mean(np.diag(self.matrix)[:2]))

    def distort(self, xy: np.ndarray) -> np.ndarray:
        """(N, 2) ideal to distorted coordinates on the plane z = 1."""
        terms = self.distortion
        if not terms.any():
            return xy
        p1, p2, shear = terms[6:9]
        x, y = xy[:, 0], xy[:, 1]
        r2 = x * x + y * y
        radial = self._radial(r2)
        u, v = x * radial, y * radial
        if p1 or p2:
            u, v = u + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), v + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return np.stack([u + shear * v if shear else u, v], axis=1)

    def _radial(self, r2: np.ndarray) -> np.ndarray:
        """The factor by which a point at the squared distance r2 from the axis, on z = 1, moves outwards."""
        k1, k2, k3, k4, k5, k6 = self.distortion[:6]
        if self.model in EQUIDISTANT:
            r = np.sqrt(r2)
            angle = np.arctan(r)
            a2 = angle * angle
            bent = np.where(r > 1e-9, angle / np.maximum(r, 1e-9), 1.0)
            return bent * (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))
        if self.model in RATIONAL:
            return (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        return 1 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)))

    @cached_property
    def fold(self) -> float:
        """Distance from the axis on z = 1 at which the lens terms stop moving points outwards; infinite if nowhere.

        They were fitted to what the picture shows. Farther out they would fold what lies beside the picture into it.
        """
        if not self.distortion[:6].any():
            return np.inf
        r = np.linspace(0, WIDEST, 5001)
        with np.errstate(all="ignore"):
            back = np.flatnonzero(~(np.diff(r * self._radial(r * r)) > 0))
        return float(r[back[0]]) if len(back) else np.inf

    @cached_property
    def lens(self) -> np.ndarray:
        """All that projects, as compiled code takes it; see `kerfwright.capture._lens`."""
        from kerfwright.capture._lens import EQUIDISTANT as ANGLES
        from kerfwright.capture._lens import PINHOLE, POLYNOMIAL
        from kerfwright.capture._lens import RATIONAL as FRACTION

        kind = POLYNOMIAL if self.distortion.any() else PINHOLE
        kind = ANGLES if self.model in EQUIDISTANT else FRACTION if self.model in RATIONAL else kind
        diagonal, middle = np.diag(self.matrix)[:2], self.matrix[:2, 2]
        return np.array([*diagonal, *middle, *self.distortion[:9], self.fold**2, kind])

    def project(self, x_in_camera: np.ndarray) -> np.ndarray:
        """(N, 3) camera to (N, 2) pixels; NaN where z <= 0, and beyond the fold."""
        from kerfwright.capture._lens import project_points

        return project_points(np.asarray(x_in_camera, float), np.eye(4), self.lens)[0]

    def undistort(self, pixels: np.ndarray, steps: int = 20) -> np.ndarray:
        """(N, 2) pixels to (N, 2) ideal coordinates on the plane z = 1.

        By fixed-point iteration, and by Newton's method where that has not settled, as for strong lenses.
        """
        target = (pixels - self.matrix[:2, 2]) / np.diag(self.matrix)[:2]
        xy = target.copy()
        if not self.distortion.any():
            return xy
        for _ in range(steps):
            step = target - self.distort(xy)
            xy += step
        far = np.flatnonzero(~(np.abs(step).max(axis=1) < SETTLED)) if len(xy) else []
        if len(far):
            xy[far] = self._newton(target[far], steps)
        return xy

    def _newton(self, target: np.ndarray, steps: int) -> np.ndarray:
        """Solve distort(xy) = target, (N, 2), with slopes from differences, from inside the fold."""
        if self.model in EQUIDISTANT:
            angle = np.linalg.norm(target, axis=1, keepdims=True)
            xy = target * (np.tan(np.minimum(angle, 1.4)) / np.maximum(angle, 1e-12))
        else:
            length = np.linalg.norm(target, axis=1, keepdims=True)
            xy = target * np.minimum(1, 0.7 * self.fold / np.maximum(length, 1e-12))
        width = 1e-6
        for _ in range(steps):
            here = self.distort(xy)
            along_x, along_y = ((self.distort(xy + width * e) - here) / width for e in np.eye(2))
            determinant = along_x[:, 0] * along_y[:, 1] - along_x[:, 1] * along_y[:, 0]
            miss = target - here
            across = miss[:, 0] * along_y[:, 1] - miss[:, 1] * along_y[:, 0]
            down = along_x[:, 0] * miss[:, 1] - along_x[:, 1] * miss[:, 0]
            sound = np.where(np.abs(determinant) > 1e-12, determinant, np.nan)[:, None]
            xy = xy + np.stack([across, down], axis=1) / sound
        return xy
