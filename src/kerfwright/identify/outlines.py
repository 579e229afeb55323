"""Regions made to obey their constraint segments: run on to them where they stop short, cut off where they go beyond.

Boundaries near a contact are dark or hidden and traced badly; what is known there is the plane of the other board.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import shapely
from shapely.geometry import Polygon

__all__ = ["Stretch", "constrained_region", "filled_region", "largest_piece", "on_segments", "segment_axes"]

CRACK = 0.01  # mm
ON_SEGMENT = 0.05  # mm; boundaries lie on their segments to rounding
SHALLOW = 0.12  # of the reach: how much deeper than usual a column may be and still be filled
TRACED_SHALLOW = 0.03  # ... of a traced outline above the floor: an arch begins there, which photographs show


class Stretch(Protocol):
    """A straight stretch that an outline must follow, board frame mm; the wood lies on the left of start -> end."""

    @property
    def start(self) -> np.ndarray: ...
    @property
    def end(self) -> np.ndarray: ...
    @property
    def origin(self) -> str: ...


def constrained_region(region: Polygon, segments: Sequence[Stretch], reach: float, beyond: float) -> Polygon:
    """The traced region run on to each segment over its length (by at most `reach`) and cut off behind it (as far as
    `beyond`).
    """
    region = filled_region(region, segments, reach, TRACED_SHALLOW)
    for segment in segments:
        widen = 0.0 if segment.origin == "ground" else beyond / 4
        region = largest_piece(region.difference(_strip(segment, -beyond, 0.0, widen)))
    return region


def filled_region(
    region: Polygon, segments: Sequence[Stretch], reach: float, on_floor: float = SHALLOW
) -> Polygon:
    """The region run on to each segment over its length, by at most `reach` mm; on the floor where it is no deeper than
    usual by more than the share `on_floor` of that.
    """
    for segment in segments:
        shallow = reach * (on_floor if segment.origin == "ground" else SHALLOW)
        filled = shapely.union_all([region, *_filling(region, segment, reach, shallow)])
        region = largest_piece(_closed(filled))
    return region


def _closed(shape) -> Polygon:
    """The shape without cracks thinner than twice `CRACK`, and without vertices that say nothing."""
    return shape.buffer(CRACK, join_style="mitre").buffer(-CRACK, join_style="mitre").simplify(CRACK / 2)


def segment_axes(segment: Stretch) -> tuple[np.ndarray, np.ndarray, float]:
    """Unit direction, inward normal, length."""
    along = segment.end - segment.start
    length = float(np.linalg.norm(along))
    along = along / length
    return along, np.array([-along[1], along[0]]), length


def on_segments(points: np.ndarray, segments: Sequence[Stretch]) -> np.ndarray:
    """(N,) whether points lie on a segment."""
    on = np.zeros(len(points), bool)
    for segment in segments:
        along, inward, length = segment_axes(segment)
        x = points - segment.start
        on |= (np.abs(x @ inward) < ON_SEGMENT) & (x @ along > -ON_SEGMENT) & (x @ along < length + ON_SEGMENT)
    return on


def _strip(segment: Stretch, low: float, high: float, widen: float) -> Polygon:
    """Rectangle between two distances inside the segment."""
    along, inward, _ = segment_axes(segment)
    a, b = segment.start - widen * along, segment.end + widen * along
    return Polygon([a + low * inward, b + low * inward, b + high * inward, a + high * inward])


def _filling(region: Polygon, segment: Stretch, reach: float, shallow: float) -> list[Polygon]:
    """What lies between the segment and the region's nearest boundary, one polygon a run of columns.

    Columns that are deeper than most by over `shallow` are left alone: there the region ends beside the segment, not
    before it.
    """
    along, inward, length = segment_axes(segment)
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
    fillable = depth <= 2 * usual + shallow
    runs = np.split(np.arange(len(at)), np.flatnonzero(np.diff(fillable.astype(int))) + 1)
    return [_curtain(feet[run], depth[run] + 0.5, inward) for run in runs if fillable[run[0]] and len(run) > 2]


def _curtain(feet: np.ndarray, depth: np.ndarray, inward: np.ndarray) -> Polygon:
    return Polygon(np.concatenate([feet, (feet + depth[:, None] * inward)[::-1]])).buffer(0)


def largest_piece(shape) -> Polygon:
    """The largest polygon of a shape, empty when there is none.

    Where edges lie within 1e-7 mm of each other, GEOS has left a strip that was cut off as a hole outside the shell.
    """
    pieces = [p for p in getattr(shape, "geoms", [shape]) if p.geom_type == "Polygon"]
    largest = max(pieces, key=lambda p: p.area) if pieces else Polygon()
    return largest if largest.is_valid else largest_piece(largest.buffer(0))
