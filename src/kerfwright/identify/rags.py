"""Boards that the cloud shows in several pieces, put together again.

Stereo sees a dark board in rags, and none of it where others stand on it. Two pieces in one plane are one board when
nothing but a gap of the cloud lies between them: nobody saw through it, no cut face lines it, and no other board runs
through it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.coplanar import in_one_plane, moved_region, united
from kerfwright.identify.covered import end_sections
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.gaps import is_seen, is_thin, places_in, usual_density
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.outlines import largest_piece
from kerfwright.identify.types import Sheet

__all__ = ["pieced_together"]

LEVEL = 1 / 250  # of D, between their faces
WIDEST = 1 / 6  # of D, between pieces
RAGGED = 1 / 25  # of D, by which facing outlines may wander
BESIDE = 0.4  # of the smaller piece's width that must look at the other one
LINED = 0.15  # of the outlines on both sides of a gap; beyond, cut faces show that it is real
STANDING = 0.5  # cosine between the normals of a board and of one that stands on it, at most
WIDER = 1.5  # times a board's thickness, that a gap under it may be wide
STOOD_ON = 0.25  # share of a gap under the ends of boards, as far as they were seen
WAY = 400  # places between the middles of two pieces
THROUGH = 0.25  # of a gap, that lies in another board


@dataclass(frozen=True)
class _Scene:
    cloud: Cloud
    free: FreeSpace
    near: float  # mm about an outline where cut faces line it
    dense: float  # points a mm2 of a face seen well
    short: float  # mm that the end of a board may be short of what it stands on


def pieced_together(
    sheets: Sequence[Sheet], cloud: Cloud, free: FreeSpace, options: WholeOptions
) -> tuple[Sheet, ...]:
    """The sheets with pieces of one board joined; the larger one keeps its name and place."""
    near, short = 2 * options.end_offset * cloud.diameter, options.ground_reach * cloud.diameter
    scene = _Scene(cloud, free, near, usual_density(sheets, cloud), short)
    found = list(sheets)
    while True:
        tried = ((a, b, _joined(a, b, found, scene)) for a, b in combinations(found, 2))
        hit = next((entry for entry in tried if entry[2] is not None), None)
        if hit is None:
            return tuple(found)
        a, b, whole = hit
        found = [whole if s is a else s for s in found if s is not b]


def _joined(a: Sheet, b: Sheet, sheets: Sequence[Sheet], scene: _Scene) -> Sheet | None:
    """The two as one board, if they are one."""
    if not in_one_plane(a, b, LEVEL * scene.cloud.diameter):
        return None
    other = moved_region(b, a)
    gap = _between(a.region, other, WIDEST * scene.cloud.diameter, RAGGED * scene.cloud.diameter)
    if gap is None:
        return None
    rest = [s for s in sheets if s is not a and s is not b]
    if any(_parts(s, a, other) for s in rest):
        return None
    if not gap.is_empty and not _is_rag(a, b, other, gap, rest, scene):
        return None
    region = largest_piece(shapely.union_all([a.region, other, gap]).buffer(0.05))
    better = min((a, b), key=lambda s: s.thickness.standard_error or np.inf)
    return replace(
        united(a, b, region), thickness=better.thickness, thickness_seen=a.thickness_seen or b.thickness_seen
    )


def _between(a: Polygon, b: Polygon, widest: float, ragged: float) -> Polygon | None:
    """The gap between facing sides of two regions, empty where they overlap; None when they do not face each other."""
    apart = a.distance(b)
    if apart > widest:
        return None
    near_a, near_b = a.intersection(b.buffer(apart + ragged)), b.intersection(a.buffer(apart + ragged))
    bridge = shapely.union_all([near_a, near_b]).convex_hull
    narrower = min(_width(a), _width(b))
    if a.intersection(b).area < 1.0 and min(near_a.length, near_b.length) / 2 < BESIDE * narrower:
        return None
    return bridge.difference(shapely.union_all([a, b]))


def _width(region: Polygon) -> float:
    """The smaller side of the smallest rectangle about a region."""
    ring = np.asarray(region.minimum_rotated_rectangle.exterior.coords)
    return float(np.linalg.norm(np.diff(ring[:3], axis=0), axis=1).min())


def _is_rag(
    a: Sheet, b: Sheet, other: Polygon, gap: Polygon, rest: Sequence[Sheet], scene: _Scene
) -> bool:
    """Whether a gap is one of the cloud, and not one between two boards; `other` is b's region in a's plane."""
    points = scene.cloud.points
    cut = a.to_board(points[np.concatenate([a.cut_idx, b.cut_idx])])[:, :2]
    if _is_lined(gap, shapely.union_all([a.region, other]), cut, scene.near):
        return False
    faces = [a.to_board(points[max(s.top_idx, s.bottom_idx, key=len)])[:, :2] for s in (a, b)]  # `dense` is one face's
    thin = all(is_thin(gap, r, f, scene.near, scene.dense) for r, f in zip((a.region, other), faces, strict=True))
    if not thin and not _is_stood_on(gap, a, rest, scene):
        return False
    return not is_seen(gap, a, scene.free) and not any(_runs_through(s, a, gap) for s in rest)


def _is_stood_on(gap: Polygon, piece: Sheet, rest: Sequence[Sheet], scene: _Scene) -> bool:
    """Whether boards stand in a gap that is hardly wider than they are thick: their ends hide the wood under them."""
    standing = [s for s in rest if abs(s.normal @ piece.normal) < STANDING]
    width = 2 * gap.area / max(gap.length, 1e-9)
    standing = [s for s in standing if width < WIDER * s.thickness.value + scene.near]
    ends = [e.buffer(scene.near) for s in standing for e in end_sections(piece, s, scene.short)]
    return shapely.union_all(ends).intersection(gap).area > STOOD_ON * gap.area if ends else False


def _is_lined(gap: Polygon, both: Polygon, cut: np.ndarray, near: float) -> bool:
    """Whether cut-face points, (N, 2), lie along the outlines on both sides of a gap; those at its mouths belong to the
    outline of the whole.
    """
    shared = both.boundary.intersection(gap.buffer(0.05))
    places = shapely.get_coordinates(shared.segmentize(near / 2)) if shared.length else np.zeros((0, 2))
    whole = shapely.union_all([both, gap]).buffer(0.05).boundary
    places = places[shapely.distance(whole, shapely.points(places)) > near]
    if not len(places) or not len(cut):
        return False
    distance, _ = cKDTree(cut).query(places)
    return float((distance < near).mean()) > LINED


def _parts(sheet: Sheet, piece: Sheet, other: Polygon) -> bool:
    """Whether another board lies across the way from one piece's middle to that of the other, `other` in its plane."""
    ends = np.array([region.centroid.coords[0] for region in (piece.region, other)])
    way = ends[0] + np.linspace(0, 1, WAY)[:, None] * (ends[1] - ends[0])
    inside = _in_board(sheet, piece, way)
    return bool(inside.any() and not inside[0] and not inside[-1])


def _in_board(sheet: Sheet, piece: Sheet, xy: np.ndarray) -> np.ndarray:
    """Which (N, 2) places half way through the piece lie in another board, what its cloud lacks counted as wood."""
    x = sheet.to_board(piece.to_world(np.c_[xy, np.full(len(xy), piece.thickness.value / 2)]))
    level = (x[:, 2] > 0) & (x[:, 2] < sheet.thickness.value)
    return level & shapely.contains_xy(sheet.region.convex_hull, x[:, 0], x[:, 1])


def _runs_through(sheet: Sheet, piece: Sheet, gap: Polygon) -> bool:
    """Whether another board fills part of a gap, half way through the piece."""
    inner = places_in(gap)
    if not len(inner):
        return False
    return float(_in_board(sheet, piece, inner).mean()) > THROUGH
