"""From a mask to the pieces of a board: specks go, holes stay."""

from __future__ import annotations

import numpy as np
from shapely.geometry import LinearRing, Polygon

from kerfwright.refine.segment.grid import Grid
from kerfwright.refine.segment.options import SegmentOptions

__all__ = ["clean", "pieces"]

SMOOTH = 0.8  # pixels; takes the stairs off a mask's boundary


def clean(mask: np.ndarray, pixel: float, options: SegmentOptions) -> list[np.ndarray]:
    """One mask a connected piece, largest first, small holes filled."""
    kept = ~_without_specks(~mask, options.min_hole / pixel**2)
    labels, areas = _labelled(kept)
    if len(areas) == 0:
        return []
    least = max(options.min_piece / pixel**2, options.min_piece_share * areas.max())
    order = sorted((k for k in range(len(areas)) if areas[k] >= least), key=lambda k: (-areas[k], k))
    return [labels == k + 1 for k in order]


def _labelled(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """4-connected components, labels from 1, and their areas in pixels."""
    import cv2

    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    return labels, stats[1:count, cv2.CC_STAT_AREA]


def _without_specks(mask: np.ndarray, least: float) -> np.ndarray:
    labels, areas = _labelled(mask)
    return np.concatenate([[False], areas >= least])[labels]


def pieces(mask: np.ndarray, grid: Grid) -> Polygon:
    """The polygon of one connected mask, board frame, holes included, stairs smoothed."""
    import cv2
    from skimage.measure import find_contours

    padded = np.pad(mask.astype(np.float32), 2)
    smooth = cv2.GaussianBlur(padded, (0, 0), SMOOTH)
    rings = [grid.to_xy(c[:-1, ::-1] - 2) for c in find_contours(smooth, 0.5) if len(c) > 8]
    polygons = sorted((Polygon(r) for r in rings), key=lambda p: -p.area)
    outer = polygons[0]
    holes = [LinearRing(p.exterior) for p in polygons[1:] if outer.contains(p.representative_point())]
    return Polygon(outer.exterior, holes).buffer(0)
