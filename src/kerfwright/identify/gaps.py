"""Gaps of the cloud filled: holes and bays of a rough region that nobody saw through and no cut face lines.

Stereo thins out in dark corners and leaves regions in rags. Real holes and notches lie in wood that was seen well, or
show what lies behind them, or their own cut faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import LineString, Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.outlines import largest_piece
from kerfwright.identify.types import Sheet

__all__ = ["filled_out", "is_seen", "is_thin", "mended", "places_in", "usual_density"]

LINED = 0.15  # of a gap's outline; beyond, cut faces show that it is real
SEEN = 0.3  # of a gap's area; beyond, it was seen through
USUAL = 0.75  # quantile of the boards' densities that counts as seen well
DENSE = 0.6  # of that density: a gap in such wood is real
SAMPLES = 60
RAGS = 0.35  # of the points of faces seen well, at most, that a board has which is seen in rags,
HULL = 0.85  # and of its convex hull's area; what fills more of it has an outline worth keeping


def mended(sheets: tuple[Sheet, ...], cloud: Cloud, free: FreeSpace, options: WholeOptions) -> tuple[Sheet, ...]:
    """The sheets with the gaps in their regions filled that are only gaps of the cloud."""
    reach, near = options.veil * cloud.diameter, options.end_offset * 2 * cloud.diameter
    dense = usual_density(sheets, cloud)
    return tuple(_mended(sheet, cloud, free, reach, near, dense) for sheet in sheets)


def filled_out(sheets: tuple[Sheet, ...], cloud: Cloud, free: FreeSpace, options: WholeOptions) -> tuple[Sheet, ...]:
    """The sheets, those that are seen in rags with every bay of their outline filled that is only a gap of the cloud.

    What stereo shows of a board in the dark says that there is wood, and nothing of where it ends.
    """
    near, dense = options.end_offset * 2 * cloud.diameter, usual_density(sheets, cloud)
    return tuple(
        _filled(sheet, sheet.region.convex_hull, cloud, free, near, dense) if _in_rags(sheet, cloud, dense) else sheet
        for sheet in sheets
    )


def _in_rags(sheet: Sheet, cloud: Cloud, dense: float) -> bool:
    """Whether a board shows few points, and those in pieces."""
    area, hull = sheet.region.area, sheet.region.convex_hull.area
    return len(_face(sheet, cloud)) < RAGS / DENSE * dense * area and area < HULL * hull


def usual_density(sheets: Sequence[Sheet], cloud: Cloud) -> float:
    """Points a mm2 that a sheet face has at least where it was seen well."""
    return DENSE * float(np.quantile([_face(s, cloud).shape[0] / s.region.area for s in sheets], USUAL))


def _face(sheet: Sheet, cloud: Cloud) -> np.ndarray:
    """Points of the sheet face that was seen better, board frame, (N, 2)."""
    return sheet.to_board(cloud.points[max(sheet.top_idx, sheet.bottom_idx, key=len)])[:, :2]


def _mended(sheet: Sheet, cloud: Cloud, free: FreeSpace, reach: float, near: float, dense: float) -> Sheet:
    """reach: mm, half the width of a gap that is looked at."""
    closed = sheet.region.buffer(reach, join_style="mitre").buffer(-reach, join_style="mitre").union(sheet.region)
    whole = shapely.union_all([closed, *(Polygon(ring) for ring in sheet.region.interiors)])
    return _filled(sheet, whole, cloud, free, near, dense)


def _filled(sheet: Sheet, whole: Polygon, cloud: Cloud, free: FreeSpace, near: float, dense: float) -> Sheet:
    """The sheet with what it lacks of a whole region, where that is only a gap of the cloud.

    near: mm about an outline where cut faces line it; dense: points a mm2 of a face seen well.
    """
    outline, gaps = whole.boundary, whole.difference(sheet.region)
    cut = sheet.to_board(cloud.points[sheet.cut_idx])[:, :2]
    tree = cKDTree(cut) if len(cut) else None
    face = _face(sheet, cloud)
    fill = [
        gap for gap in getattr(gaps, "geoms", [gaps])
        if gap.area > 1.0 and not _is_lined(gap, sheet.region, outline, tree, near)
        and not is_seen(gap, sheet, free) and is_thin(gap, sheet.region, face, near, dense)
    ]
    if not fill:
        return sheet
    filled = shapely.union_all([sheet.region, *(gap.buffer(0.05) for gap in fill)])
    return replace(sheet, region=largest_piece(filled))


def _is_lined(
    gap: Polygon, region: Polygon, outline: LineString, tree: cKDTree | None, near: float
) -> bool:
    """Whether cut-face points lie along the part of the region's outline that the gap shares; those at the mouth of a
    bay belong to the outline of the board.
    """
    shared = region.boundary.intersection(gap.buffer(0.05))
    if tree is None or shared.length == 0:
        return False
    along = [shared.interpolate(s) for s in np.arange(0, shared.length, near / 2)]
    places = shapely.points(shapely.get_coordinates(along))
    inner = places[shapely.distance(places, outline) > near]
    if not len(inner):
        return False
    distance, _ = tree.query(shapely.get_coordinates(inner))
    return float((distance < near).mean()) > LINED


def is_thin(gap: Polygon, region: Polygon, face: np.ndarray, near: float, dense: float) -> bool:
    """Whether the wood round the gap was seen badly."""
    ring = gap.buffer(2 * near).intersection(region)
    return bool(shapely.contains_xy(ring, face[:, 0], face[:, 1]).sum() < dense * ring.area)


def is_seen(gap: Polygon, sheet: Sheet, free: FreeSpace) -> bool:
    """Whether cameras saw through the gap."""
    xy = places_in(gap)
    if not len(xy):
        return False
    places = sheet.to_world(np.c_[xy, np.full(len(xy), sheet.thickness.value / 2)])
    return float((free.votes(places) >= 2).mean()) > SEEN


def places_in(gap: Polygon) -> np.ndarray:
    """(N, 2) some places spread over a gap."""
    low_x, low_y, high_x, high_y = gap.bounds
    step = max(np.sqrt(gap.area / SAMPLES), 0.5)
    x, y = np.meshgrid(np.arange(low_x + step / 2, high_x, step), np.arange(low_y + step / 2, high_y, step))
    inside = shapely.contains_xy(gap, x.ravel(), y.ravel())
    return np.stack([x.ravel(), y.ravel()], axis=1)[inside]
