"""Outlines made to obey their constraint segments: run on to them where they stop short, cut off where they go beyond.

Boundaries near a contact are dark or hidden and traced badly; what is known there is the plane of the other board.
"""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.refine.types import BoundaryLoop, Outline

__all__ = ["constrained_region", "outline_region", "to_loops"]


SHALLOW = 0.12  # of the reach: how much deeper than usual a column may be and still be filled


def outline_region(outline: Outline) -> Polygon:
    """The polygon of an outline, its holes included."""
    loops = outline.loops
    return _largest(Polygon(loops[0].points, [loop.points for loop in loops[1:]]).buffer(0))


def constrained_region(
    region: Polygon, segments: tuple[ConstraintSegment, ...], reach: float, beyond: float
) -> Polygon:
    """The region run on to each segment over its length (by at most `reach`) and cut off behind it (as far as
    `beyond`).
    """
    for segment in segments:
        filled = shapely.union_all([region, *_filling(region, segment, reach)])
        region = _largest(filled.buffer(0.01).buffer(-0.01))
    for segment in segments:
        widen = 0.0 if segment.origin == "ground" else beyond / 4
        region = _largest(region.difference(_strip(segment, -beyond, 0.0, widen)))
    return region


def _axes(segment: ConstraintSegment) -> tuple[np.ndarray, np.ndarray, float]:
    """Unit direction, inward normal, length."""
    along = segment.end - segment.start
    length = float(np.linalg.norm(along))
    along = along / length
    return along, np.array([-along[1], along[0]]), length


def _strip(segment: ConstraintSegment, low: float, high: float, widen: float) -> Polygon:
    """Rectangle between two distances inside the segment."""
    along, inward, _ = _axes(segment)
    a, b = segment.start - widen * along, segment.end + widen * along
    return Polygon([a + low * inward, b + low * inward, b + high * inward, a + high * inward])


def _filling(region: Polygon, segment: ConstraintSegment, reach: float) -> list[Polygon]:
    """What lies between the segment and the region's nearest boundary, one polygon a run of columns.

    Columns that are far deeper than most are left alone: there the region ends beside the segment, not before it.
    """
    along, inward, length = _axes(segment)
    at = np.linspace(0, length, max(8, int(length / 2)))
    feet = segment.start + at[:, None] * along
    rays = shapely.linestrings(np.stack([feet - 0.5 * inward, feet + reach * inward], axis=1))
    depth = np.full(len(at), np.inf)
    for k, hit in enumerate(shapely.intersection(rays, region)):
        xy = shapely.get_coordinates(hit)
        if len(xy):
            depth[k] = max(float(((xy - feet[k]) @ inward).min()), 0.0)
    if not np.isfinite(depth).any():
        return []
    usual = float(np.median(depth[np.isfinite(depth)]))
    fillable = depth <= 2 * usual + SHALLOW * reach
    runs = np.split(np.arange(len(at)), np.flatnonzero(np.diff(fillable.astype(int))) + 1)
    return [_curtain(feet[run], depth[run] + 0.5, inward) for run in runs if fillable[run[0]] and len(run) > 2]


def _curtain(feet: np.ndarray, depth: np.ndarray, inward: np.ndarray) -> Polygon:
    return Polygon(np.concatenate([feet, (feet + depth[:, None] * inward)[::-1]])).buffer(0)


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
        along, inward, length = _axes(segment)
        x = points - segment.start
        on = (np.abs(x @ inward) < 0.05) & (x @ along > -1) & (x @ along < length + 1)
        error[on] = segment.standard_error
    return error


def _largest(shape) -> Polygon:
    pieces = [p for p in getattr(shape, "geoms", [shape]) if p.geom_type == "Polygon"]
    return max(pieces, key=lambda p: p.area) if pieces else Polygon()
