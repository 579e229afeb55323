"""The raster of a board's plane: pixel (row, col) lies at origin + (col + 1/2, row + 1/2) * pixel; rows grow with y."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

__all__ = ["Grid", "grid_over"]


@dataclass(frozen=True, eq=False)
class Grid:
    """A raster in the board frame, millimetres."""

    origin: np.ndarray  # (2,) outer corner of pixel (0, 0)
    pixel: float
    shape: tuple[int, int]  # rows, columns

    def centres(self) -> np.ndarray:
        """(rows, columns, 2) pixel centres, mm."""
        rows, columns = self.shape
        x = self.origin[0] + (np.arange(columns) + 0.5) * self.pixel
        y = self.origin[1] + (np.arange(rows) + 0.5) * self.pixel
        return np.stack(np.meshgrid(x, y), axis=-1)

    def affine(self, rows: np.ndarray) -> np.ndarray:
        """(k, rows, columns) float32 values of k affine functions a x + b y + c, given as (k, 3)."""
        height, width = self.shape
        x = self.origin[0] + (np.arange(width) + 0.5) * self.pixel
        y = self.origin[1] + (np.arange(height) + 0.5) * self.pixel
        a, b, c = (column[:, None, None] for column in rows.T)
        return ((b * y[:, None] + c).astype(np.float32) + (a * x).astype(np.float32)).astype(np.float32)

    def to_index(self, xy: np.ndarray) -> np.ndarray:
        """(..., 2) mm to (column, row), whole numbers at pixel centres."""
        return (xy - self.origin) / self.pixel - 0.5

    def to_xy(self, column_row: np.ndarray) -> np.ndarray:
        """(..., 2) column and row to mm."""
        return self.origin + (column_row + 0.5) * self.pixel

    def mask(self, region: Polygon | MultiPolygon) -> np.ndarray:
        """True where the pixel centre is inside the region."""
        shapely.prepare(region)
        return shapely.contains_xy(region, *np.moveaxis(self.centres(), 2, 0))

    def lookup(self, values: np.ndarray, xy: np.ndarray, outside) -> np.ndarray:
        """The raster's value at (N, 2) points, by nearest pixel; `outside` beyond its edge."""
        index = np.floor((xy - self.origin) / self.pixel).astype(int)
        ok = (index >= 0).all(1) & (index[:, 0] < self.shape[1]) & (index[:, 1] < self.shape[0])
        found = np.full(len(xy), outside, dtype=values.dtype)
        found[ok] = values[index[ok, 1], index[ok, 0]]
        return found


def grid_over(region: Polygon, margin: float, pixel: float, max_pixels: int) -> Grid:
    """A raster over the region's bounding box and a margin, of at most `max_pixels` pixels."""
    low, high = np.array(region.bounds).reshape(2, 2) + np.array([[-margin], [margin]])
    pixel = max(pixel, float(np.sqrt(np.prod(high - low) / max_pixels)))
    columns, rows = np.ceil((high - low) / pixel).astype(int)
    return Grid(low, pixel, (int(rows), int(columns)))
