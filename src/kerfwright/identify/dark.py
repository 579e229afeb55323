"""Boards that the cloud shows in rags: a stretcher in the shadow of a seat, a divider deep in a cabinet.

Their faces have a hundredth of the points of others, too few for a region or to be worth a board's cost. But two small
plane patches that face away from each other, one over the other, at a board's thickness, which no other board explains,
are the two faces of one; so is a broad patch over a few points that face the other way, all at one depth. How far it
goes, its own ends tell (`dark_ends.py`), and assembly finds in the photographs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import shapely

from kerfwright.capture.types import Capture, Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.slabs import Slab, free_share, plane_frame
from kerfwright.identify.thickness import ThicknessHypothesis
from kerfwright.identify.types import Neighbourhood, Primitive

__all__ = ["dark_slabs", "with_dark_boards"]

SAME = 0.3  # of the smaller face's hull, that the larger one's must cover
ELSEWHERE = 0.25  # of the faces' points at most that lie on boards already found
CLEAR = 0.25  # of the interior at most that lies in them
PARALLEL = np.cos(np.radians(4.0))  # between rags of one board
THICK = 1 / 20  # of D; what lies deeper below a single patch is another board's
LEVEL = 1 / 250  # of D, between their middles, and between their thicknesses
NEAR = 1 / 6  # of D, between their outlines
SITES = 400  # of the interior
STRAYS, STRAY_SPREAD = 20, 4.0  # points of a far face at least, and their quartiles' distance in the cloud's noise
HULL = 500  # points of a patch, every n-th, that tell where it lies


def dark_slabs(
    capture: Capture, around: Neighbourhood, planes: Sequence[Primitive], free: FreeSpace, options: IdentifyOptions
) -> list[Slab]:
    """Slabs between two small patches that face away from each other, those with most points first; then those below
    single patches.
    """
    cloud, size = capture.cloud, capture.cloud.diameter
    limits = options.min_thickness * size, options.max_thickness * size
    enough = options.dark_density / around.spacing**2
    opposite, found = -np.cos(np.radians(options.opposite_degrees)), []
    for one, other in combinations(range(len(planes)), 2):
        if planes[one].normal @ planes[other].normal > opposite:
            continue
        slab = _slab(planes, one, other, cloud, limits)
        if slab is None or slab.region.area < (options.min_sheet_side * size) ** 2:
            continue
        points = sum(len(planes[k].point_idx) for k in (one, other))
        if points < enough * 2 * slab.region.area and slab.cut_ratio < options.cut_area_ratio:
            share = free_share(slab.world_from_board, slab.thickness.value, slab.region, free, 2 * around.spacing,
                               options.free_sites)
            if share <= options.max_free:
                found.append((points, slab))
    single = _single_faces(capture.cloud, around, planes, free, options)
    return [slab for _, slab in (*sorted(found, key=lambda e: -e[0]), *sorted(single, key=lambda e: -e[0]))]


def _single_faces(
    cloud: Cloud, around: Neighbourhood, planes: Sequence[Primitive], free: FreeSpace, options: IdentifyOptions
) -> list[tuple[int, Slab]]:
    """Slabs below broad patches with few points, and how many these are."""
    found, side = [], options.min_unseen_side * cloud.diameter
    enough = options.dark_density / around.spacing**2
    for k, plane in enumerate(planes):
        frame = plane_frame(plane.normal, plane.centroid)
        xy = ((cloud.points[plane.point_idx[:: max(1, len(plane.point_idx) // HULL)]] - frame[:3, 3]) @ frame[:3, :3])
        hull = shapely.MultiPoint(xy[:, :2]).convex_hull
        if hull.buffer(-side / 2).is_empty or len(plane.point_idx) > enough * hull.area:
            continue
        thickness = _depth_below(frame, hull, cloud, around, options)
        if thickness is None:
            continue
        board = frame.copy()
        board[:3, 3] -= thickness.value * frame[:3, 2]
        share = free_share(board, thickness.value, hull, free, 2 * around.spacing, options.free_sites)
        slab = Slab(board, thickness, hull, (k,), (), share)
        if share <= options.max_free and slab.cut_ratio < options.cut_area_ratio:
            found.append((len(plane.point_idx), slab))
    return found


def _depth_below(
    frame: np.ndarray, hull: shapely.Polygon, cloud: Cloud, around: Neighbourhood, options: IdentifyOptions
) -> ThicknessHypothesis | None:
    """Where points below a patch face away from it, all at one depth."""
    low, high = options.min_thickness * cloud.diameter, THICK * cloud.diameter
    height = cloud.points @ frame[:3, 2] - frame[:3, 3] @ frame[:3, 2]
    below = np.flatnonzero((height < -low) & (height > -high) & (around.normals @ frame[:3, 2] < -PARALLEL))
    xy = (cloud.points[below] - frame[:3, 3]) @ frame[:3, :2]
    depth = -height[below[shapely.contains_xy(hull, xy[:, 0], xy[:, 1])]]
    if len(depth) < STRAYS or np.subtract(*np.percentile(depth, [75, 25])) > STRAY_SPREAD * around.noise:
        return None
    error = float(np.std(depth) / np.sqrt(len(depth)) + around.noise)
    return ThicknessHypothesis(float(np.median(depth)), error, "opposite", float(len(depth)))


def _slab(
    planes: Sequence[Primitive], one: int, other: int, cloud: Cloud, limits: tuple[float, float]
) -> Slab | None:
    """The slab between two patches, if one lies over the other at a board's thickness."""
    normal = planes[one].normal - planes[other].normal
    frame = plane_frame(normal / np.linalg.norm(normal), planes[one].centroid)
    picked = [planes[k].point_idx[:: max(1, len(planes[k].point_idx) // HULL)] for k in (one, other)]
    x, y = ((cloud.points[idx] - frame[:3, 3]) @ frame[:3, :3] for idx in picked)
    value = float(np.median(x[:, 2]) - np.median(y[:, 2]))
    if not limits[0] < value < limits[1]:
        return None
    hulls = [shapely.MultiPoint(xy[:, :2]).convex_hull for xy in (x, y)]
    both = hulls[0].intersection(hulls[1]).area
    if both < SAME * min(hulls[0].area, hulls[1].area):
        return None
    frame[:3, 3] += np.median(y[:, 2]) * frame[:3, 2]
    error = float(np.hypot(planes[one].sigma, planes[other].sigma))
    thickness = ThicknessHypothesis(value, error, "opposite", float(both))
    return Slab(frame, thickness, shapely.union_all(hulls).convex_hull, (one,), (other,), 0.0)


def with_dark_boards(
    chosen: Sequence[Slab], dark: Sequence[Slab], planes: Sequence[Primitive], cloud: Cloud, reach: float
) -> list[Slab]:
    """The chosen boards and those of the dark ones of which they explain nothing; reach: mm about a board that its own
    points may lie.
    """
    boards = list(chosen)
    for slab in dark:
        points = cloud.points[np.concatenate([planes[k].point_idx for k in (*slab.top, *slab.bottom)])]
        sites = slab.to_world(np.c_[_spread(slab, SITES), np.full(SITES, slab.thickness.value / 2)])
        if _held(points, boards, reach) < ELSEWHERE and _held(sites, boards, 0.0) < CLEAR:
            boards.append(slab)
    found = boards[len(chosen):]
    return [*chosen, *_merged(found, cloud.diameter)]


def _merged(found: list[Slab], size: float) -> list[Slab]:
    """Rags of one board as one: those near each other between the same planes."""
    for one, other in combinations(found, 2):
        if _is_same_board(one, other, size):
            region = shapely.union_all([one.region, _moved(other, one)]).convex_hull
            whole = replace(one, region=region, top=one.top + other.top, bottom=one.bottom + other.bottom)
            return _merged([whole if slab is one else slab for slab in found if slab is not other], size)
    return found


def _is_same_board(one: Slab, other: Slab, size: float) -> bool:
    if abs(one.normal @ other.normal) < PARALLEL or one.region.distance(_moved(other, one)) > NEAR * size:
        return False
    middle = other.to_world(np.array([[*other.region.centroid.coords[0], other.thickness.value / 2]]))
    off = abs(one.to_board(middle)[0, 2] - one.thickness.value / 2)
    return max(off, abs(one.thickness.value - other.thickness.value)) < LEVEL * size


def _moved(slab: Slab, to: Slab) -> shapely.Polygon:
    """A slab's outline in another one's plane."""
    xy = np.asarray(slab.region.exterior.coords)
    return shapely.Polygon(to.to_board(slab.to_world(np.c_[xy, np.full(len(xy), slab.thickness.value / 2)]))[:, :2])


def _spread(slab: Slab, count: int) -> np.ndarray:
    """(count, 2) places all over the region, always the same."""
    low_x, low_y, high_x, high_y = slab.region.bounds
    rng, found = np.random.default_rng(0), np.zeros((0, 2))
    while len(found) < count:
        xy = rng.uniform([low_x, low_y], [high_x, high_y], (4 * count, 2))
        found = np.concatenate([found, xy[shapely.contains_xy(slab.region, xy[:, 0], xy[:, 1])]])
    return found[:count]


def _held(places: np.ndarray, boards: Sequence[Slab], reach: float) -> float:
    """Share of (N, 3) places that lie in boards, or within `reach` mm of them."""
    held = np.zeros(len(places), bool)
    for board in boards:
        x = board.to_board(places)
        level = (x[:, 2] > -reach) & (x[:, 2] < board.thickness.value + reach)
        held |= level & shapely.contains_xy(board.region.buffer(reach), x[:, 0], x[:, 1])
    return float(held.mean())
