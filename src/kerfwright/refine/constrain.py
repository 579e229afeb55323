"""Traced outlines to regions and back, with what is known on constraint segments."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.outlines import largest_piece, segment_axes
from kerfwright.refine.types import BoundaryLoop, Outline

__all__ = ["outline_region", "to_loops"]


def outline_region(outline: Outline) -> Polygon:
    """The polygon of an outline, its holes included."""
    loops = outline.loops
    return largest_piece(Polygon(loops[0].points, [loop.points for loop in loops[1:]]).buffer(0))


def to_loops(
    region: Polygon, outline: Outline, segments: tuple[ConstraintSegment, ...], step: float
) -> tuple[BoundaryLoop, ...]:
    """Boundary loops of a region at even spacing; errors from the outline it came from, small on constraint segments.
    """
    known = np.concatenate([loop.points for loop in outline.loops])
    error = np.concatenate([loop.standard_error for loop in outline.loops])
    tree, usual = cKDTree(known), float(np.median(error))
    loops = []
    for number, ring in enumerate([region.exterior, *region.interiors]):
        if number and Polygon(ring).area < 25 * step**2:
            continue
        count = max(12, round(ring.length / step))
        points = shapely.get_coordinates(shapely.line_interpolate_point(ring, np.arange(count) * ring.length / count))
        if ring.is_ccw != (number == 0):
            points = points[::-1]
        distance, nearest = tree.query(points)
        own = np.where(distance < 2 * step, error[nearest], 3 * usual + 0.2 * distance)
        loops.append(BoundaryLoop(points, _with_segments(points, own, segments), number > 0))
    return tuple(loops)


def _with_segments(points: np.ndarray, error: np.ndarray, segments: tuple[ConstraintSegment, ...]) -> np.ndarray:
    error = error.copy()
    for segment in segments:
        along, inward, length = segment_axes(segment)
        x = points - segment.start
        on = (np.abs(x @ inward) < 0.05) & (x @ along > -1) & (x @ along < length + 1)
        error[on] = segment.standard_error
    return error
