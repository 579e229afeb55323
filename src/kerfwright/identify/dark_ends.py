"""Boards in the dark run on to ends that the cloud shows: a divider's front and back edge stand in the light, and say
how far it goes, where stereo has lost most of its faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.primitives import Neighbourhood
from kerfwright.identify.slabs import Slab, free_share
from kerfwright.identify.types import Primitive

__all__ = ["run_to_ends"]

INNER = 0.1  # of the thickness at both faces, where cut faces are not told from sheet planes
FACING = 0.9  # cosine between the normals of an end and the way that it faces
FEWEST = 40  # points of an end
AS_WIDE = 0.5  # of the board, that an end is at least
FAR = 1 / 2  # of D, beyond what was seen
APART = 1 / 12  # of D, between neighbours on one end
DEEP, WANDER = 4.0, 1 / 500  # times the cloud's noise, and of D, to both sides of an end
STRETCH = 200  # places along an end
REACHED = 0.4  # of an end at most that the board comes near already: the bays of such a one are left to assembly
OTHERS = 0.04  # of what is added at most that lies in other boards
SEEN = 0.25  # ... and that was seen through


def run_to_ends(
    boards: Sequence[Slab], planes: Sequence[Primitive], cloud: Cloud, around: Neighbourhood, free: FreeSpace,
    options: IdentifyOptions,
) -> list[Slab]:
    """The boards, those seen in rags with what lies between them and their own ends."""
    out = list(boards)
    for k, slab in enumerate(out):
        if _is_ragged(slab, planes, cloud, around, options):
            rest = [other for other in out if other is not slab]
            out[k] = _run_on(slab, rest, cloud, around, free, options)
    return out


def _is_ragged(
    slab: Slab, planes: Sequence[Primitive], cloud: Cloud, around: Neighbourhood, options: IdentifyOptions
) -> bool:
    """Whether the face seen better has few points."""
    counts = []
    for side in (slab.top, slab.bottom):
        idx = np.concatenate([planes[k].point_idx for k in side]) if side else np.zeros(0, int)
        xy = slab.to_board(cloud.points[idx])[:, :2]
        counts.append(shapely.contains_xy(slab.region, xy[:, 0], xy[:, 1]).sum())
    return bool(0 < max(counts) < options.dark_density / around.spacing**2 * slab.region.area)


def _run_on(
    slab: Slab, rest: Sequence[Slab], cloud: Cloud, around: Neighbourhood, free: FreeSpace, options: IdentifyOptions
) -> Slab:
    """One board, run on to each of its ends in turn."""
    xy, normals = _cut_points(slab, rest, cloud, around)
    for u in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        end = _end(slab.region, np.array(u), xy, normals, cloud, around)
        end = None if end is None else _between_others(end, slab, rest, cloud.diameter / 60)
        if end is None or _reached(slab.region, end, cloud.diameter / 60) > REACHED:
            continue
        band = end.buffer(2 * cloud.diameter, cap_style="flat")  # what lies opposite the end
        whole = shapely.union_all([slab.region, shapely.union_all([slab.region.intersection(band), end]).convex_hull])
        added = whole.difference(slab.region)
        if added.area > 1.0 and _is_hidden_wood(added, slab, rest, around, free, options):
            slab = replace(slab, region=whole)
    return slab


def _cut_points(
    slab: Slab, rest: Sequence[Slab], cloud: Cloud, around: Neighbourhood
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) places and normals, board frame, of points between the planes of a board that face along it; those of
    other boards are left out.
    """
    thickness, margin = slab.thickness.value, DEEP * around.noise
    z = (cloud.points - slab.world_from_board[:3, 3]) @ slab.world_from_board[:3, 2]
    idx = np.flatnonzero((z > INNER * thickness) & (z < (1 - INNER) * thickness))
    normals = around.normals[idx] @ slab.world_from_board[:3, :3]
    idx, normals = idx[np.abs(normals[:, 2]) < 0.5], normals[np.abs(normals[:, 2]) < 0.5]
    places, own = cloud.points[idx], np.ones(len(idx), bool)
    for other in rest:
        x = other.to_board(places)
        level = (x[:, 2] > -margin) & (x[:, 2] < other.thickness.value + margin)
        own &= ~(level & shapely.contains_xy(other.region.buffer(margin), x[:, 0], x[:, 1]))
    return slab.to_board(places[own])[:, :2], normals[own, :2]


def _end(
    region: Polygon, u: np.ndarray, xy: np.ndarray, normals: np.ndarray, cloud: Cloud, around: Neighbourhood
) -> LineString | None:
    """The end of a board that faces along u: a line across it, no less far than its region goes."""
    v, fringe = np.array([-u[1], u[0]]), cloud.diameter / 60
    ring = np.asarray(region.exterior.coords)[:, :2]
    far, low, high = (ring @ u).max(), (ring @ v).min(), (ring @ v).max()
    offset, along = xy @ u, xy @ v
    near = (normals @ u > FACING) & (offset > far - fringe) & (offset < far + FAR * cloud.diameter)
    beside = near & (along > low) & (along < high)
    if beside.sum() < FEWEST:
        return None
    deep = max(DEEP * around.noise, WANDER * cloud.diameter)
    counts = np.bincount(np.floor((offset[beside] - far + fringe) / deep).astype(int))
    at = far - fringe + (int(np.argmax(counts)) + 0.5) * deep
    place = float(np.median(offset[beside & (np.abs(offset - at) < deep)]))
    own = np.sort(along[near & (np.abs(offset - place) < deep)])
    runs = np.split(own, np.flatnonzero(np.diff(own) > APART * cloud.diameter) + 1)
    run = max(runs, key=lambda r: min(r[-1], high) - max(r[0], low))
    if len(run) < FEWEST or min(run[-1], high) - max(run[0], low) < AS_WIDE * (high - low):
        return None
    return LineString([place * u + run[0] * v, place * u + run[-1] * v])


def _reached(region: Polygon, end: LineString, fringe: float) -> float:
    """Share of an end that the region comes near, mm."""
    return float(end.intersection(region.buffer(fringe)).length / end.length)


def _between_others(end: LineString, slab: Slab, rest: Sequence[Slab], fringe: float) -> LineString | None:
    """The stretch of an end that lies beside the board, cut off where other boards stand in its line.

    fringe: mm, by which outlines of others may be short.
    """
    (start, stop), region = np.asarray(end.coords), slab.region
    share = np.linspace(0.0, 1.0, STRETCH)
    xy = start + share[:, None] * (stop - start)
    held = _held(slab, xy, rest, fringe)
    stretches = np.split(np.arange(STRETCH), np.flatnonzero(np.diff(held)) + 1)
    across = (stop - start) / np.linalg.norm(stop - start)
    ring = np.asarray(region.exterior.coords)[:, :2] @ across
    low, high = ring.min(), ring.max()
    free = [s for s in stretches if not held[s[0]] and len(s) > 1]
    beside = {k: min(xy[s[-1]] @ across, high) - max(xy[s[0]] @ across, low) for k, s in enumerate(free)}
    if not beside or max(beside.values()) < AS_WIDE * (high - low):
        return None
    own = free[max(beside, key=lambda k: beside[k])]
    return LineString([xy[own[0]], xy[own[-1]]])


def _held(slab: Slab, xy: np.ndarray, rest: Sequence[Slab], margin: float) -> np.ndarray:
    """Which (N, 2) places half way through a board lie in others, or beside their outlines by `margin` mm."""
    places = slab.to_world(np.c_[xy, np.full(len(xy), slab.thickness.value / 2)])
    held = np.zeros(len(places), bool)
    for other in rest:
        x = other.to_board(places)
        level = (x[:, 2] > 0) & (x[:, 2] < other.thickness.value)
        held |= level & shapely.contains_xy(other.region.convex_hull.buffer(margin), x[:, 0], x[:, 1])
    return held


def _is_hidden_wood(
    added: Polygon, slab: Slab, rest: Sequence[Slab], around: Neighbourhood, free: FreeSpace, options: IdentifyOptions
) -> bool:
    """Whether nobody saw through what is added, and no other board lies in it."""
    if free_share(slab.world_from_board, slab.thickness.value, added, free, around.spacing, options.free_sites) > SEEN:
        return False
    xy = _spread(added, options.free_sites // 4)
    return bool(len(xy)) and float(_held(slab, xy, rest, 0.0).mean()) < OTHERS


def _spread(region: Polygon, count: int) -> np.ndarray:
    """(N, 2) about `count` places on a grid in a region."""
    low_x, low_y, high_x, high_y = region.bounds
    step = float(np.sqrt(region.area / count))
    x, y = np.meshgrid(np.arange(low_x + step / 2, high_x, step), np.arange(low_y + step / 2, high_y, step))
    inside = shapely.contains_xy(region, x.ravel(), y.ravel())
    return np.stack([x.ravel(), y.ravel()], axis=1)[inside]
