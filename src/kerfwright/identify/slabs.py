"""Candidate boards: every plane that could be a sheet plane, with every thickness that the cloud supports.

Paper, Cut Region Approximation and Initial Sheet Thickness Estimation. A candidate is the slab below a plane, inside
the region that points on its two sheet planes cover.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely
from shapely.geometry import MultiPoint, Polygon

from kerfwright.capture.types import Capture
from kerfwright.identify.bars import Bar, find_bars
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.regions import Raster, occupancy, polygons
from kerfwright.identify.rims import trace_rim
from kerfwright.identify.thickness import (
    ThicknessHypothesis,
    from_cut_faces,
    from_opposite,
    from_photos,
    reaches_ground,
    sharpened,
)
from kerfwright.identify.told import Known, told_by_others
from kerfwright.identify.types import Neighbourhood, Primitive
from kerfwright.parallel import each

__all__ = ["Slab", "candidate_slabs", "footprint", "free_share", "plane_frame"]


CUT_FACE = 0.3  # cosine between a board's normal and that of its cut faces, at most
ALONG_AXIS = 0.9  # cosine between a bar and the normal of a board across it, at least
MOST_BESIDE = 0.6  # of a bar's section put beside it, that a board which parts it fills
LEVEL = 0.999  # cosine between a level board's normal and the vertical
CLEAR = 3.3  # strength of an edge that tells a thickness by itself
CLEARER = 1.5  # times another edge's
UNSEEN = ("cut", "twin", "inferred")  # evidence that no photograph and no opposite plane gave

_Seed = tuple[tuple[int, ...], np.ndarray, Polygon]  # coplanar patches, world_from_top frame, region


@dataclass(frozen=True, eq=False)
class Slab:
    """A candidate board; x_in_world = world_from_board @ x_in_board, sheet planes z = 0 and z = thickness."""

    world_from_board: np.ndarray
    thickness: ThicknessHypothesis
    region: Polygon
    top: tuple[int, ...]  # primitives on z = thickness
    bottom: tuple[int, ...]
    free_share: float  # share of the interior that cameras saw through

    @property
    def normal(self) -> np.ndarray:
        """Unit normal of the top sheet plane, world."""
        return self.world_from_board[:3, 2]

    @property
    def volume(self) -> float:
        """mm3."""
        return self.region.area * self.thickness.value

    @property
    def cut_ratio(self) -> float:
        """Cut surface over cut region area; the perimeters of holes count."""
        return self.region.length * self.thickness.value / self.region.area

    def to_board(self, x: np.ndarray) -> np.ndarray:
        """(N, 3) world to board frame."""
        return (x - self.world_from_board[:3, 3]) @ self.world_from_board[:3, :3]

    def to_world(self, x: np.ndarray) -> np.ndarray:
        """(N, 3) board frame to world."""
        return x @ self.world_from_board[:3, :3].T + self.world_from_board[:3, 3]


def plane_frame(normal: np.ndarray, point: np.ndarray) -> np.ndarray:
    """4x4 frame with +z along the normal, +y as near to world up as it can be (world +y for level planes)."""
    up = np.array([0.0, 0, 1]) if abs(normal[2]) < 0.9 else np.array([0.0, 1, 0])
    x = np.cross(up, normal)
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([x, np.cross(normal, x), normal], axis=1)
    frame[:3, 3] = point
    return frame


def candidate_slabs(
    capture: Capture, around: Neighbourhood, planes: list[Primitive], free: FreeSpace, photos: Photos,
    options: IdentifyOptions,
) -> list[Slab]:
    """All candidates that are neither too thick for their region nor seen through, in the order of their planes."""
    scene = _Scene(capture, around, planes, free, options, photos)
    seeds = [seed for number in range(len(planes)) for seed in _seeds(scene, number)]
    known = told_by_others(each(partial(_looked_at, scene), seeds), scene)
    stock = _common(known)
    own = [k for k in known if k.hypotheses and not k.told]
    found = [slab for k in own for h in k.hypotheses for slab in _slabs(scene, k.top, k.frame, k.piece, h)]
    found = [slab for slab in found if slab.thickness.evidence not in UNSEEN or scene.is_broad(slab.region)]
    for k in known:
        if (k.told or not k.hypotheses) and scene.is_broad(k.piece):
            guesses = k.hypotheses or [_above_floor(h, k.frame, scene) for h in stock]
            rough = [slab for h in guesses for slab in _slabs(scene, k.top, k.frame, k.piece, h)]
            found.extend(piece for slab in rough for piece in _without_others(scene, slab, found))
    return _distinct([*found, *_bars(scene, found)])


def _bars(scene: _Scene, known: list[Slab]) -> list[Slab]:
    """Bars that no candidate with evidence of its own holds already, and that nobody saw through."""
    known = [slab for slab in known if slab.thickness.evidence != "inferred"]
    found: list[Slab] = []
    if not known:  # a bar is a hidden part of something: opposite patches of a ball are none
        return found
    for bar in find_bars(scene.capture, scene.planes, scene.photos, scene.fringe, scene.options):
        ends = [scene.capture.cloud.points[scene.planes[k].point_idx] for k in bar.ends]
        if any(all(_holds(scene, slab, end) for end in ends) for slab in known) or _is_parted(scene, bar, ends, known):
            continue
        free = _free_share(scene, bar.world_from_board, bar.thickness.value, bar.region)
        if free <= scene.most_free(bar.thickness.value):
            found.append(Slab(bar.world_from_board, bar.thickness, bar.region, (), (), free))
    return found


def _is_parted(scene: _Scene, bar: Bar, ends: Sequence[np.ndarray], known: list[Slab]) -> bool:
    """Whether the ends belong to two boards that were seen from both sides, and a third one between them goes on beyond
    the bar on both sides: they end on it.
    """
    axis = bar.world_from_board[:3, 1]
    seen = [slab for slab in known if slab.thickness.evidence == "opposite"]
    stubs = [slab for slab in seen if abs(slab.normal @ axis) < CUT_FACE]
    if not all(any(_holds(scene, slab, end) for slab in stubs) for end in ends):
        return False
    return any(_goes_on_beside(slab, bar) for slab in seen if abs(slab.normal @ axis) > ALONG_AXIS)


def _goes_on_beside(slab: Slab, bar: Bar) -> bool:
    """Whether a slab across a bar lies between its ends, and has wood on both sides of its sheet planes; the bar's own
    section is hidden.
    """
    thickness, (low_x, low_y, high_x, high_y) = bar.thickness.value, bar.region.bounds
    for z in ((-thickness, 0.0), (thickness, 2 * thickness)):
        corners = np.array([[x, y, height] for x in (low_x, high_x) for y in (low_y, high_y) for height in z])
        x = slab.to_board(corners @ bar.world_from_board[:3, :3].T + bar.world_from_board[:3, 3])
        beside = MultiPoint(x[:, :2]).convex_hull
        if not x[:, 2].min() < 0 < slab.thickness.value < x[:, 2].max():
            return False
        if beside.intersection(slab.region).area < MOST_BESIDE * beside.area:
            return False
    return True


def _holds(scene: _Scene, slab: Slab, points: np.ndarray) -> bool:
    """Whether most of the points lie on the slab, or in it."""
    x = slab.to_board(points)
    reach = scene.fringe / 2
    inside = (x[:, 2] > -reach) & (x[:, 2] < slab.thickness.value + reach)
    near = shapely.distance(slab.region, shapely.points(x[:, :2])) < reach
    return bool((inside & near).mean() > 0.5)


def _without_others(scene: _Scene, slab: Slab, others: list[Slab]) -> list[Slab]:
    """What is left of a slab of unseen thickness once boards with evidence of their own are taken out of it.

    The front edges of a bookcase lie in one plane with a rail between its sides; only the rail is a board there.
    """
    left = slab.region
    for other in others:
        if other.thickness.evidence in ("opposite", "photos") and abs(other.normal @ slab.normal) < 0.9:
            left = left.difference(footprint(other, slab).buffer(scene.fringe, join_style="mitre"))
    pieces = [p for p in getattr(left, "geoms", [left]) if p.area > scene.min_area]
    return [replace(slab, region=Polygon(p.exterior, p.interiors)) for p in pieces if scene.is_broad(p)]


def footprint(other: Slab, slab: Slab) -> Polygon:
    """Convex outline of the other board's section through the middle of a slab, in the slab's frame."""
    rings = np.asarray(other.region.exterior.coords)
    ends = [slab.to_board(other.to_world(np.c_[rings, np.full(len(rings), z)])) for z in (0.0, other.thickness.value)]
    low, high = 0.0, slab.thickness.value
    points = []
    for corners in ends:
        ahead = np.roll(corners, -1, axis=0)
        for level in (low + 0.25 * (high - low), high - 0.25 * (high - low)):
            rise = ahead[:, 2] - corners[:, 2]
            share = (level - corners[:, 2]) / np.where(np.abs(rise) < 1e-9, np.nan, rise)
            cross = (share >= 0) & (share <= 1)
            points.append((corners + share[:, None] * (ahead - corners))[cross, :2])
    crossing = np.concatenate(points)
    return shapely.MultiPoint(crossing).convex_hull if len(crossing) > 2 else Polygon()


def _common(known: list[Known], most: int = 2) -> list[ThicknessHypothesis]:
    """The thicknesses that most of the object's sheet area has, for boards that show neither their back nor a cut face.
    """
    pairs = [(k.best.value, k.piece.area) for k in known if k.best and k.best.evidence in ("opposite", "photos")]
    values, area = np.array(pairs).reshape(-1, 2).T
    found: list[ThicknessHypothesis] = []
    while len(values) and len(found) < most:
        near = np.abs(values[:, None] - values[None]) < 0.08 * values[:, None]
        best = near[int(np.argmax(near @ area))]
        if found and area[best].sum() < 0.3 * found[0].support:
            break
        value = float(np.median(values[best]))
        found.append(ThicknessHypothesis(value, 0.4 * value, "inferred", float(area[best].sum())))
        values, area = values[~best], area[~best]
    return found


@dataclass(frozen=True, eq=False)
class _Scene:
    capture: Capture
    around: Neighbourhood
    planes: list[Primitive]
    free: FreeSpace
    options: IdentifyOptions
    photos: Photos

    @property
    def diameter(self) -> float:
        return self.capture.cloud.diameter

    @property
    def min_area(self) -> float:
        return (self.options.min_sheet_side * self.diameter) ** 2

    def is_broad(self, piece: Polygon) -> bool:
        """Whether most of a region is as wide as a board of unseen thickness must be: a frame of front edges is not."""
        reach = self.options.min_unseen_side * self.diameter / 2
        return piece.buffer(-reach).buffer(reach).area > 0.5 * piece.area

    @property
    def thickness_limits(self) -> tuple[float, float]:
        return self.options.min_thickness * self.diameter, self.options.max_thickness * self.diameter

    def most_free(self, thickness: float) -> float:
        """Largest share of a slab's interior that may have been seen through."""
        deep = thickness > self.options.thick * self.diameter
        return self.options.max_free_thick if deep else self.options.max_free

    @property
    def fringe(self) -> float:
        """How far stereo may widen a silhouette, mm."""
        return max(4 * self.around.spacing, self.diameter / 60)

    @property
    def rim_spacing(self) -> float:
        return self.diameter / 400

    @property
    def min_hole(self) -> float:
        """Smaller gaps in a region are gaps in the cloud; whether a larger one is a hole in the wood the photographs
        tell.
        """
        return (self.options.min_hole_side * self.diameter) ** 2

    @property
    def cell(self) -> float:
        return max(1.5 * self.around.spacing, self.diameter / 400)

    def coplanar(self, normal: np.ndarray, point: np.ndarray) -> tuple[int, ...]:
        """Primitives on the plane through `point` that face along `normal`."""
        inlier = max(self.options.inlier_sigmas * self.around.noise, self.options.inlier_floor * self.diameter)
        tolerance = 1.5 * inlier
        cos = np.cos(np.radians(self.options.opposite_degrees))
        return tuple(
            k for k, p in enumerate(self.planes)
            if p.normal @ normal > cos and abs((p.centroid - point) @ normal) < tolerance
        )

    def level_with_largest(self, numbers: tuple[int, ...]) -> tuple[int, ...]:
        """Those of the primitives that lie on the plane of the largest: a rail set back from its legs is no part of
        them, though a plane between the two is near both.
        """
        if not numbers:
            return ()
        largest = self.planes[max(numbers, key=lambda k: len(self.planes[k].point_idx))]
        return tuple(k for k in self.coplanar(largest.normal, largest.centroid) if k in numbers)

    def points(self, numbers: tuple[int, ...]) -> np.ndarray:
        idx = np.concatenate([self.planes[k].point_idx for k in numbers]) if numbers else np.zeros(0, int)
        return self.capture.cloud.points[idx]


def _seeds(scene: _Scene, number: int) -> list[_Seed]:
    """Connected regions of one plane patch that are large enough to be a board's."""
    plane = scene.planes[number]
    if len(plane.point_idx) * scene.around.spacing**2 < 0.25 * scene.min_area:
        return []
    frame = plane_frame(plane.normal, plane.centroid)
    top = scene.coplanar(plane.normal, plane.centroid)
    own = (scene.capture.cloud.points[plane.point_idx] - plane.centroid) @ frame[:3, :3]
    raster = Raster.around(own[:, :2], scene.cell)
    pieces = polygons(raster, occupancy(raster, own[:, :2], scene.around.spacing), scene.min_area, scene.min_hole)
    return [(top, frame, piece) for piece in pieces]


def _looked_at(scene: _Scene, seed: _Seed) -> Known:
    """A seed with the thicknesses that opposite planes, photographs, the ground or cut faces support, best first."""
    top, frame, piece = seed
    low, high = scene.thickness_limits
    cloud, around = scene.capture.cloud, scene.around
    opposite = from_opposite(frame, piece, scene.planes, cloud.points, (low, high), scene.options.opposite_degrees)
    rim = trace_rim(frame, piece, cloud, around, scene.diameter / 40, spacing=scene.rim_spacing, width=scene.fringe)
    photos = from_photos(frame, rim, scene.photos, (low, high), step=scene.diameter * scene.options.sweep_step)
    opposite, photos = ([h for h in side if not _is_air(scene, frame, piece, h)] for side in (opposite, photos))
    found = [sharpened(h, photos) for h in opposite] or [
        p for p in photos[:2] if p.support > max(CLEAR, 0.7 * photos[0].support)
    ]
    if not found and not scene.photos.views:
        found = from_cut_faces(frame, piece, cloud, around, (low, high))
    height = frame[2, 3]
    level = frame[2, 2] > LEVEL and low < height < high and not any(h.near(height) for h in found)
    if level and not _ends_above(photos, height) and reaches_ground(frame, piece, cloud, around, height):
        found.append(ThicknessHypothesis(float(height), 2 * around.noise, "ground", piece.area))
    return Known(top, frame, piece, rim, tuple(found), shown=tuple(photos))


def _is_air(scene: _Scene, frame: np.ndarray, piece: Polygon, thickness: ThicknessHypothesis) -> bool:
    """Whether a thickness reaches through compartments to the next board: cameras saw into what would be wood."""
    if thickness.value <= scene.options.thick * scene.diameter:
        return False
    board = frame.copy()
    board[:3, 3] -= thickness.value * frame[:3, 2]
    return _free_share(scene, board, thickness.value, piece) > scene.options.max_free_thick


def _above_floor(guess: ThicknessHypothesis, frame: np.ndarray, scene: _Scene) -> ThicknessHypothesis:
    """A guessed thickness, or the height above the floor of a level board that would go through it."""
    height = float(frame[2, 3])
    if frame[2, 2] < LEVEL or not scene.thickness_limits[0] < height < guess.value:
        return guess
    return ThicknessHypothesis(height, 2 * scene.around.noise, "ground", guess.support)


def _ends_above(photos: list[ThicknessHypothesis], height: float) -> bool:
    """Whether the photographs show a level board's end above the floor, clearly, and clearer than what they show there.
    """
    floor = max((h.support for h in photos if abs(h.value - height) < 0.1 * height), default=0.0)
    return any(h.support > CLEAR and h.support > CLEARER * floor for h in photos if h.value < 0.6 * height)


def _slabs(
    scene: _Scene, top: tuple[int, ...], frame: np.ndarray, seed: Polygon, thickness: ThicknessHypothesis
) -> list[Slab]:
    """The slab's pieces that touch the seed region: points of both sheet planes, see-through places taken out."""
    bottom_point = frame[:3, 3] - thickness.value * frame[:3, 2]
    bottom = scene.level_with_largest(scene.coplanar(-frame[:3, 2], bottom_point))
    sides = [(scene.points(side) - frame[:3, 3]) @ frame[:3, :3] for side in (top, bottom)]
    raster = Raster.around(np.concatenate(sides)[:, :2], scene.cell)
    wood = np.zeros(raster.shape, bool)
    for side in sides:
        if len(side):
            wood |= occupancy(raster, side[:, :2], scene.around.spacing)
    board = frame.copy()
    board[:3, 3] = bottom_point
    slabs = []
    for piece in polygons(raster, wood, scene.min_area, scene.min_hole):
        if piece.intersection(seed).area < 0.5 * seed.area:
            continue
        slab = Slab(board, thickness, piece, top, bottom, _free_share(scene, board, thickness.value, piece))
        if slab.cut_ratio <= scene.options.cut_area_ratio and slab.free_share <= scene.most_free(thickness.value):
            slabs.append(slab)
    return slabs


def _sites(region: Polygon, board: np.ndarray, heights: np.ndarray, count: int) -> np.ndarray:
    """About `count` places on a grid inside the region, at each height, in world."""
    step = np.sqrt(region.area * len(heights) / count)
    low_x, low_y, high_x, high_y = region.bounds
    x, y = np.meshgrid(np.arange(low_x + step / 2, high_x, step), np.arange(low_y + step / 2, high_y, step))
    inside = shapely.contains_xy(region, x.ravel(), y.ravel())
    xy = np.stack([x.ravel(), y.ravel()], axis=1)[inside]
    places = np.concatenate([np.c_[xy, np.full(len(xy), z)] for z in heights]) if len(xy) else np.zeros((0, 3))
    return places @ board[:3, :3].T + board[:3, 3]


def _free_share(scene: _Scene, board: np.ndarray, thickness: float, piece: Polygon) -> float:
    return free_share(board, thickness, piece, scene.free, 2 * scene.cell, scene.options.free_sites)


def free_share(
    board: np.ndarray, thickness: float, piece: Polygon, free: FreeSpace, margin: float, count: int
) -> float:
    """Share of a slab's interior, at least `margin` mm inside its region or a third of its thickness, that cameras saw
    through, by `count` places.
    """
    inner = piece.buffer(-min(margin, thickness / 3))
    if inner.is_empty:
        return 0.0
    heights = thickness * np.linspace(0.15, 0.85, 5)
    sites = _sites(inner, board, heights, count)
    return float((free.votes(sites) >= 2).mean()) if len(sites) else 0.0


def _distinct(slabs: list[Slab]) -> list[Slab]:
    """Drop a slab that says the same as an earlier one: the other side's view of the same board."""
    kept: list[Slab] = []
    for slab in slabs:
        if not any(_same(slab, other) for other in kept):
            kept.append(slab)
    return kept


def _same(a: Slab, b: Slab) -> bool:
    """Whether two slabs share their sheet planes and nearly all of their region."""
    if abs(a.world_from_board[:3, 2] @ b.world_from_board[:3, 2]) < 0.998:
        return False
    if abs(a.thickness.value - b.thickness.value) > 0.15 * b.thickness.value:
        return False
    rings = np.asarray(a.region.exterior.coords)
    moved = b.to_board(a.to_world(np.c_[rings, np.full(len(rings), a.thickness.value / 2)]))
    if abs(np.median(moved[:, 2]) - b.thickness.value / 2) > 0.25 * b.thickness.value:
        return False
    outline = Polygon(moved[:, :2]).buffer(0)
    other = Polygon(b.region.exterior).buffer(0)
    return outline.intersection(other).area > 0.85 * outline.union(other).area
