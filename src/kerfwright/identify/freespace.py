"""What the cameras saw through: places in front of a visible surface hold no wood.

A depth map a view is drawn from the cloud. A place is free in a view when every pixel about its projection shows a
surface clearly behind it. Nothing drawn means nothing known: the cloud has holes, and floors are cropped away.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from scipy.ndimage import minimum_filter

from kerfwright.capture.types import Capture, View

__all__ = ["FreeSpace", "see_through"]

# maps of captures in use, by the size of a pixel: every stage asks for the same
_DRAWN: WeakKeyDictionary[Capture, dict[float, tuple[np.ndarray, ...]]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Depth maps of all views: (V, H, W) float32 mm, -inf where nothing is known."""

    views: tuple[View, ...]
    maps: tuple[np.ndarray, ...]
    pixel: float  # photo pixels of one map pixel
    margin: float  # mm that a surface must lie behind a place

    def votes(self, x_in_world: np.ndarray) -> np.ndarray:
        """How many views saw through each of (N, 3) places, (N,) int."""
        total = np.zeros(len(x_in_world), int)
        for view, depth_map in zip(self.views, self.maps, strict=True):
            pixels, depth = view.project(x_in_world)
            row, column, inside = _cells(pixels, self.pixel, depth_map.shape)
            total[inside] += depth_map[row[inside], column[inside]] > depth[inside] + self.margin
        return total

    def hidden(self, k: int, x_in_world: np.ndarray) -> np.ndarray:
        """Whether view k shows a surface clearly in front of each of (N, 3) places, (N,) bool."""
        pixels, depth = self.views[k].project(x_in_world)
        row, column, inside = _cells(pixels, self.pixel, self.maps[k].shape)
        shown = np.full(len(depth), -np.inf)
        shown[inside] = self.maps[k][row[inside], column[inside]]
        return np.isfinite(shown) & (shown < depth - self.margin)


def _cells(pixels: np.ndarray, pixel: float, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    with np.errstate(invalid="ignore"):
        cell = np.floor(np.nan_to_num(pixels, nan=-1e9) / pixel).astype(np.int64)
    row, column = cell[:, 1], cell[:, 0]
    return row, column, (row >= 0) & (column >= 0) & (row < shape[0]) & (column < shape[1])


def see_through(capture: Capture, spacing: float, margin: float) -> FreeSpace:
    """Depth maps of the cloud in every view; spacing: mm between neighbouring points of the cloud."""
    pixel = _map_pixel(capture, spacing)
    drawn = _DRAWN.setdefault(capture, {})
    if pixel not in drawn:
        cloud = capture.cloud
        drawn[pixel] = tuple(_depth_map(view, cloud.points, cloud.normals, pixel) for view in capture.views)
    return FreeSpace(capture.views, drawn[pixel], pixel, margin)


def _map_pixel(capture: Capture, spacing: float) -> float:
    """Photo pixels that span about 1.5 point spacings at the object, so that a closed surface draws closed."""
    if not capture.views:
        return 1.0
    centre = np.median(capture.cloud.points, axis=0)
    per_mm = [v.camera.focal / np.linalg.norm(v.centre - centre) for v in capture.views]
    return max(1.5 * spacing * float(np.median(per_mm)), 1.0)


def _depth_map(view: View, points: np.ndarray, normals: np.ndarray, pixel: float) -> np.ndarray:
    """Nearest point a pixel, where it faces the camera; a pixel counts only when all its eight neighbours do.

    A nearest point that faces away means that the ray crossed a surface which stereo missed: nothing is known along it.
    """
    shape = (int(np.ceil(view.camera.height / pixel)), int(np.ceil(view.camera.width / pixel)))
    facing = np.einsum("ij,ij->i", view.centre - points, normals) > 0
    pixels, depth = view.project(points)
    row, column, inside = _cells(pixels, pixel, shape)
    flat = row[inside] * shape[1] + column[inside]
    nearest = _nearest(flat, depth[inside], shape[0] * shape[1])
    cell = flat[nearest]
    drawn = np.full(shape[0] * shape[1], -np.inf, np.float32)
    drawn[cell] = np.where(facing[inside][nearest], depth[inside][nearest], -np.inf)
    return minimum_filter(drawn.reshape(shape), size=3, mode="constant", cval=-np.inf)


def _nearest(cell: np.ndarray, depth: np.ndarray, cells: int) -> np.ndarray:
    """Index of the point of least depth, and of those the first, in every cell that has points."""
    least = np.full(cells, np.inf)
    np.minimum.at(least, cell, depth)
    first = np.full(cells, len(cell))
    front = np.flatnonzero(depth == least[cell])
    first[cell[front[::-1]]] = front[::-1]
    return first[first < len(cell)]
