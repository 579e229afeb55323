"""Veils taken off: where stereo ran a board on over a dark opening beside it, the photographs show the board's edge.

A veil is thinner than the wood beside it, no cut face ends it, and a straight edge that most photographs agree on lies
inside the outline. All three are asked for: a shadow or a seam in good wood must not cut a board.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

from kerfwright.assemble.options import AssembleOptions
from kerfwright.assemble.types import ConstraintSegment
from kerfwright.capture.types import Cloud
from kerfwright.identify.joints import Joint, Trace, columns, face_plane, trace_of
from kerfwright.identify.outlines import largest_piece, segment_axes
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.seams import sweep_line
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles
from kerfwright.parallel import each

__all__ = ["still_open", "unveiled"]

LEAST_VIEWS = 3
EDGE_ERROR = 0.3  # mm; standard error of an edge so found, of a board seen from half a metre
THIN = 0.75  # density of a veil at most, of the wood's beside it
SAME_DIRECTION = 0.99  # cosine; ragged outlines turn their rectangles by some degrees
CLEAR = 0.4  # share of stretches and views that show the edge, beyond the usual


@dataclass(frozen=True, eq=False)
class _Scene:
    cloud: Cloud
    photos: Photos
    obstacles: Obstacles
    options: AssembleOptions

    def mm(self, share: float) -> float:
        return share * self.cloud.diameter


def unveiled(
    sheets: tuple[Sheet, ...], cloud: Cloud, photos: Photos, options: AssembleOptions
) -> tuple[tuple[Sheet, ...], tuple[tuple[ConstraintSegment, ...], ...]]:
    """The sheets, their regions cut back to the edges that the photographs show where a veil goes beyond them, and
    these edges.
    """
    obstacles = Obstacles(sheets, options.outline_error * cloud.diameter)
    scene = _Scene(cloud, photos, obstacles, options)
    found = each(lambda sheet: _without_veils(sheet, [s for s in sheets if s is not sheet], scene), sheets)
    return tuple(sheet for sheet, _ in found), tuple(edges for _, edges in found)


def _without_veils(sheet: Sheet, others: list[Sheet], scene: _Scene) -> tuple[Sheet, tuple[ConstraintSegment, ...]]:
    edges = []
    for m in _directions(sheet, np.array([s.normal for s in others]).reshape(-1, 3)):
        edge = _veil(sheet, m, scene)
        if edge is not None and not _explained(sheet, edge, others, scene.mm(scene.options.outline_error)):
            region = largest_piece(sheet.region.difference(_outside(edge, scene.mm(1.0))))
            if region.area > 0.5 * sheet.region.area:
                sheet = replace(sheet, region=region)
                edges.append(edge)
    return sheet, tuple(edges)


def still_open(
    edges: tuple[tuple[ConstraintSegment, ...], ...], segments: tuple[tuple[ConstraintSegment, ...], ...]
) -> tuple[tuple[ConstraintSegment, ...], ...]:
    """The edges of sides on which no contact was found: what a board ends on says more than a line near it."""
    return tuple(
        tuple(edge for edge in own if not any(_same_side(edge, s) for s in found))
        for own, found in zip(edges, segments, strict=True)
    )


def _same_side(a: ConstraintSegment, b: ConstraintSegment) -> bool:
    return bool(segment_axes(a)[1] @ segment_axes(b)[1] > SAME_DIRECTION)


def _explained(sheet: Sheet, edge: ConstraintSegment, others: list[Sheet], near: float) -> bool:
    """Whether another board meets the sheet along that edge: its corner hides what lies beyond."""
    _, inward, _ = segment_axes(edge)
    for other in others:
        for normal, offset in (face_plane(other, face) for face in ("top", "bottom")):
            trace = trace_of(sheet, normal, offset)
            if trace is None or abs(trace.m @ inward) < SAME_DIRECTION:
                continue
            away, _ = trace.coordinates(np.stack([edge.start, edge.end]))
            if np.abs(away).max() < near:
                return True
    return False


def _outside(edge: ConstraintSegment, far: float) -> Polygon:
    """All that lies beyond an edge, over its length."""
    _, inward, _ = segment_axes(edge)
    return Polygon([edge.start, edge.end, edge.end - far * inward, edge.start - far * inward])


def _directions(sheet: Sheet, normals: np.ndarray) -> list[np.ndarray]:
    """Inward normals of the smallest rectangle about the region, turned to the other boards where these are near."""
    ring = np.asarray(sheet.region.minimum_rotated_rectangle.exterior.coords)
    side = (ring[1] - ring[0]) / np.linalg.norm(ring[1] - ring[0])
    across = np.array([-side[1], side[0]])
    flat = normals @ sheet.world_from_board[:3, :2]
    length = np.linalg.norm(flat, axis=1)
    flat = flat[length > 0.2] / length[length > 0.2, None]
    return [_nearest(m, np.concatenate([flat, -flat])) for m in (side, -side, across, -across)]


def _nearest(m: np.ndarray, others: np.ndarray) -> np.ndarray:
    if not len(others):
        return m
    best = others[int(np.argmax(others @ m))]
    return best if best @ m > SAME_DIRECTION else m


def _veil(sheet: Sheet, m: np.ndarray, scene: _Scene) -> ConstraintSegment | None:
    """The edge to cut the region back to on the side that looks along -m."""
    trace = Trace(m, np.array([-m[1], m[0]]), 0.0, 0.0, 0.0, np.array([*-m, 0.0]), 1.0)
    along, first, last = columns(sheet.region, trace, scene.mm(1 / 200))
    open_ = _unbacked(sheet, trace, along, first, scene) & (last - first > scene.mm(scene.options.reach))
    if open_.sum() < 0.5 * len(along):
        return None
    start = float(np.quantile(first[open_], 0.1))
    depth = float(np.median(first[open_])) - start + scene.mm(scene.options.veil)
    edge = _edge(sheet, replace(trace, offset=start), (float(along.min()), float(along.max())), depth, scene)
    if edge is None or not _is_thin(sheet, trace, start, start + edge, scene):
        return None
    high, low = trace.place(np.full(2, start + edge), np.array([along.max() + 1, along.min() - 1]))
    return ConstraintSegment(high, low, "photo", EDGE_ERROR)


def _unbacked(sheet: Sheet, trace: Trace, along: np.ndarray, first: np.ndarray, scene: _Scene) -> np.ndarray:
    """Which columns start without a cut face near."""
    if not len(sheet.cut_idx):
        return np.ones(len(along), bool)
    cut = sheet.to_board(scene.cloud.points[sheet.cut_idx])[:, :2]
    distance, _ = cKDTree(cut).query(trace.place(first, along))
    return distance > scene.mm(scene.options.outline_error)


def _edge(
    sheet: Sheet, trace: Trace, interval: tuple[float, float], depth: float, scene: _Scene
) -> float | None:
    """Distance inside the trace of the strongest edge, if it is a clear one."""
    joint = Joint(-1, -1, "top", trace, (interval,), 0.0, np.zeros((0, 2)))
    best: tuple[float, float] | None = None
    for face, seen in (("top", sheet.top_idx), ("bottom", sheet.bottom_idx)):
        margin = scene.mm(scene.options.outline_error)
        sweep = sweep_line(sheet, joint, face, scene.photos, scene.obstacles, -margin, depth, scene.mm(1 / 500))
        if sweep is None or sweep.views < LEAST_VIEWS or not len(seen):
            continue
        strength = sweep.strength / np.median(sweep.strength)
        k = int(np.argmax(strength))
        clear = sweep.persistence[k] - np.median(sweep.persistence) > CLEAR
        if clear and strength[k] > scene.options.end_score and (best is None or strength[k] > best[0]):
            best = (float(strength[k]), float(sweep.offsets[k]))
    return best[1] if best and best[1] > scene.mm(scene.options.end_offset) else None


def _is_thin(sheet: Sheet, trace: Trace, low: float, high: float, scene: _Scene) -> bool:
    """Whether the region holds far fewer points between two distances along the trace's normal than just behind."""
    idx = np.concatenate([sheet.top_idx, sheet.bottom_idx])
    xy = sheet.to_board(scene.cloud.points[idx])[:, :2]
    density = []
    for a, b in ((low, high), (high, 2 * high - low)):
        band = _band(sheet.region, trace, a, b)
        inside = shapely.contains_xy(band, xy[:, 0], xy[:, 1]) if band.area else np.zeros(0, bool)
        density.append(inside.sum() / max(band.area, 1e-6))
    return bool(density[0] < THIN * density[1])


def _band(region: Polygon, trace: Trace, low: float, high: float) -> Polygon:
    span = np.array([-1.0, 1.0]) * 4 * np.hypot(*np.ptp(np.array(region.bounds).reshape(2, 2), axis=0))
    middle = trace.coordinates(np.array([[region.centroid.x, region.centroid.y]]))[1][0]
    corners = [*trace.place(np.full(2, low), middle + span), *trace.place(np.full(2, high), middle + span[::-1])]
    return region.intersection(Polygon(corners))
