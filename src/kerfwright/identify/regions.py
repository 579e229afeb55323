"""Cut regions: from points on a plane to polygons with holes (paper, Cut Region Approximation).

The paper thresholds a sum of Gaussians at a fixed value, which depends on how densely the stereo program sampled the
face. Here the density is compared with the density round about, so that a face seen well on one side and badly on the
other keeps both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.ndimage import binary_closing, binary_opening, gaussian_filter
from shapely.geometry import Polygon
from skimage.measure import find_contours, label
from skimage.morphology import disk

__all__ = ["Raster", "occupancy", "polygons"]

NEAR_SHARE = 0.35  # a cell is wood when its density is at least this share of the density round about
VEIL_SHARE = 0.12  # ... and this share of the density of a face seen well


@dataclass(frozen=True)
class Raster:
    """A grid in a plane: cell (row, column) covers low + cell * (column, row) .. + cell."""

    low: tuple[float, float]
    cell: float
    shape: tuple[int, int]

    @classmethod
    def around(cls, xy: np.ndarray, cell: float, margin: int = 4) -> Raster:
        """Grid that holds (N, 2) points with a margin of cells; the outermost lie within cells, not on their edges."""
        low = xy.min(axis=0) - (margin - 0.5) * cell
        columns, rows = np.ceil((xy.max(axis=0) - low) / cell).astype(int) + margin
        return cls((float(low[0]), float(low[1])), cell, (int(rows), int(columns)))

    def counts(self, xy: np.ndarray) -> np.ndarray:
        """Points a cell, (rows, columns) float."""
        column, row = np.floor((xy - self.low) / self.cell).astype(int).T
        rows, columns = self.shape
        return np.bincount(row * columns + column, minlength=rows * columns).reshape(self.shape).astype(float)

    def to_plane(self, row_column: np.ndarray) -> np.ndarray:
        """(N, 2) positions in cells (row, column; centres at whole numbers) to plane coordinates."""
        return np.asarray(self.low) + (row_column[:, ::-1] + 0.5) * self.cell


def occupancy(raster: Raster, xy: np.ndarray, spacing: float) -> np.ndarray:
    """Where (N, 2) points lie densely, (rows, columns) bool.

    spacing: mm between points of a face seen well. Stereo spans dark openings with a thin veil of points: that is not
    wood.
    """
    density = gaussian_filter(raster.counts(xy), 1.0)
    some = (density > 1e-3).astype(float)
    around = gaussian_filter(density, 6.0) / np.maximum(gaussian_filter(some, 6.0), 1e-6)
    return density > np.maximum(NEAR_SHARE * around, VEIL_SHARE * (raster.cell / spacing) ** 2)


def polygons(raster: Raster, wood: np.ndarray, min_area: float, min_hole: float) -> list[Polygon]:
    """Connected pieces of a mask as polygons with holes, largest first; areas in mm2."""
    wood = binary_opening(binary_closing(wood, iterations=1), structure=disk(1))
    pieces = []
    numbered = label(wood, connectivity=1)
    for number in range(1, numbered.max() + 1):
        piece = _polygon(raster, numbered == number, min_hole)
        if piece is not None and piece.area >= min_area:
            pieces.append(piece)
    return sorted(pieces, key=lambda p: -p.area)


def _polygon(raster: Raster, mask: np.ndarray, min_hole: float) -> Polygon | None:
    smooth = gaussian_filter(np.pad(mask, 2).astype(float), 0.7)
    rings = [raster.to_plane(ring - 2) for ring in find_contours(smooth, 0.5) if len(ring) > 3]
    if not rings:
        return None
    shapes = [Polygon(ring) for ring in rings]
    outer = max(shapes, key=lambda p: p.area)
    holes = [p.exterior for p in shapes if p is not outer and p.area >= min_hole]
    piece = shapely.make_valid(Polygon(outer.exterior, holes)).simplify(raster.cell / 4)
    return max(piece.geoms, key=lambda p: p.area) if piece.geom_type != "Polygon" else piece
