"""Which of two boards that cross runs through, by their ends.

Where two boards cross, one runs through and the other is two. The cloud does not tell which: of either a narrow strip
is hidden, and chance decides which of them comes out whole. On the end faces of both, where they are flush, the
photographs show the joints: two short lines along the faces of the board that runs through.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.coplanar import in_one_plane, moved_region, with_own_points
from kerfwright.identify.outlines import largest_piece
from kerfwright.identify.photo_edges import Photos, SweepResult, sweep_edge
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles

__all__ = ["crossings_settled"]

CROSSING = 0.8  # cosine between the normals of boards that cross, at most
FLUSH = 1 / 60  # of D, between the ends of both boards
REACH = 0.35  # of a thickness, that a joint is swept to either side
NEAR = 1 / 400  # of D, that a joint may be off
PLACES = 30  # along a joint
INNER = 0.1  # of a joint's length left out at either end, where the eased edges of the other board begin
CLEARER = 1.05  # times as clear as the joints of the board that the cloud has whole: of six made crossings those that
# it has wrong had 1.07 and 1.70, the others .66 to 1.03
LEAST_VIEWS = 3
FACING = 0.4  # cosine between an end face's normal and the line of sight
FAR = 1e5  # mm; longer than any board


@dataclass(frozen=True, eq=False)
class _Crossing:
    """Board `through` between two pieces of another one."""

    through: Sheet
    before: Sheet
    after: Sheet

    @property
    def names(self) -> frozenset[str]:
        return frozenset((self.through.name, self.before.name, self.after.name))


def crossings_settled(sheets: Sequence[Sheet], cloud: Cloud, photos: Photos, obstacles: Obstacles) -> tuple[Sheet, ...]:
    """The sheets, the whole board of a crossing and the two pieces exchanged where the photographs show it.

    An exchange gives names to other boards: crossings are looked for again after it, and no three names asked twice.
    """
    out, asked = list(sheets), set()
    while crossing := next((c for c in _crossings(out, cloud.diameter) if c.names not in asked), None):
        asked.add(crossing.names)
        if _other_runs_through(crossing, photos, obstacles, cloud.diameter):
            new = {s.name: s for s in _exchanged(crossing, cloud)}
            out = [new.get(s.name, s) for s in out]
    return tuple(out)


def _crossings(sheets: Sequence[Sheet], size: float) -> list[_Crossing]:
    found = []
    for one, other in combinations(sheets, 2):
        if not in_one_plane(one, other, FLUSH / 4 * size):
            continue
        for through in sheets:
            if through in (one, other) or abs(through.normal @ one.normal) > CROSSING:
                continue
            near, far = (_heights(through, s) for s in (one, other))
            slack = FLUSH * size
            for low, high in permutations((near, far)):
                if low.max() < slack and high.min() > through.thickness.value - slack and _goes_through(through, one):
                    found.append(_Crossing(through, one, other))
    return found


def _heights(through: Sheet, piece: Sheet) -> np.ndarray:
    """Of a piece's corners over a board's bottom plane."""
    ring = np.asarray(piece.region.exterior.coords)[:, :2]
    return through.to_board(piece.to_world(np.c_[ring, np.full(len(ring), piece.thickness.value / 2)]))[:, 2]


def _goes_through(through: Sheet, piece: Sheet) -> bool:
    """Whether a board has wood on both sides of a piece's plane."""
    height = _over(through, piece)
    ring = np.asarray(through.region.exterior.coords)[:, :2]
    levels = ring @ height[:2] + height[2]
    return bool(levels.min() < -piece.thickness.value and levels.max() > 2 * piece.thickness.value)


def _over(sheet: Sheet, other: Sheet) -> np.ndarray:
    """(3,) height over the other board's bottom plane of places (x, y, 1) half way through a sheet."""
    normal = other.normal @ sheet.world_from_board[:3, :3]
    start = other.normal @ (sheet.world_from_board[:3, 3] - other.world_from_board[:3, 3])
    return np.array([normal[0], normal[1], start + normal[2] * sheet.thickness.value / 2])


def _other_runs_through(crossing: _Crossing, photos: Photos, obstacles: Obstacles, size: float) -> bool:
    """Whether the joints lie along the faces of the board in two pieces, clearly."""
    whole, views = _clearness(crossing.through, crossing.before, crossing, photos, obstacles, size)
    parted, others = _clearness(crossing.before, crossing.through, crossing, photos, obstacles, size)
    return min(views, others) >= LEAST_VIEWS and parted > CLEARER * whole


def _clearness(
    through: Sheet, ending: Sheet, crossing: _Crossing, photos: Photos, obstacles: Obstacles, size: float
) -> tuple[float, int]:
    """How clearly the end faces show joints along the faces of `through`, where `ending` meets it, in how many views.
    """
    axis = np.cross(through.normal, ending.normal)
    axis /= np.linalg.norm(axis)
    strengths, views = [], []
    for outward in (axis, -axis):
        level = [float((_corners(s) @ outward).max()) for s in (crossing.through, crossing.before, crossing.after)]
        if np.ptp(level) > FLUSH * size:
            continue
        for height in (0.0, through.thickness.value):
            sweep = _swept(through, ending, height, float(np.median(level)) * outward, outward, photos, obstacles)
            if sweep is not None:
                near = np.abs(sweep.offsets) < max(NEAR * size, sweep.offsets[1] - sweep.offsets[0])
                strengths.append(float(sweep.strength[near].max() / np.median(sweep.strength)))
                views.append(sweep.views)
    return (float(np.mean(strengths)), max(views)) if strengths else (0.0, 0)


def _corners(sheet: Sheet) -> np.ndarray:
    ring = np.asarray(sheet.region.exterior.coords)[:, :2]
    return sheet.to_world(np.c_[ring, np.full(len(ring), sheet.thickness.value / 2)])


def _swept(
    through: Sheet, ending: Sheet, height: float, level: np.ndarray, outward: np.ndarray, photos: Photos,
    obstacles: Obstacles,
) -> SweepResult | None:
    """The line on an end face at some height in `through`, from one face of `ending` to the other, swept across."""
    share = np.linspace(INNER, 1 - INNER, PLACES) * ending.thickness.value
    planes = np.array([through.normal, ending.normal, outward])
    start = [s.normal @ s.world_from_board[:3, 3] for s in (through, ending)]
    right = np.stack([np.full(PLACES, start[0] + height), start[1] + share, np.full(PLACES, outward @ level)])
    places = np.linalg.solve(planes, right).T
    reach = REACH * through.thickness.value
    offsets = np.linspace(-reach, reach, 41)
    visible = obstacles.visible(photos.views, places + 0.5 * outward, outward, FACING)
    return sweep_edge(photos, places, through.normal, offsets, visible, smoothing=reach / 8)


def _exchanged(crossing: _Crossing, cloud: Cloud) -> list[Sheet]:
    """The two pieces as one board, and the whole board as two, under the same three names."""
    whole, pieces = crossing.through, (crossing.before, crossing.after)
    regions = [pieces[0].region, moved_region(pieces[1], pieces[0])]
    apart = regions[0].distance(regions[1]) + FLUSH * cloud.diameter
    near = [a.intersection(b.buffer(apart)) for a, b in (regions, regions[::-1])]
    region = largest_piece(shapely.union_all([*regions, shapely.union_all(near).convex_hull]))
    flipped = pieces[0].normal @ pieces[1].normal < 0
    top, bottom = (pieces[1].bottom_idx, pieces[1].top_idx) if flipped else (pieces[1].top_idx, pieces[1].bottom_idx)
    joined = replace(
        pieces[0], region=region, top_idx=np.union1d(pieces[0].top_idx, top),
        bottom_idx=np.union1d(pieces[0].bottom_idx, bottom),
        cut_idx=np.union1d(pieces[0].cut_idx, pieces[1].cut_idx),
    )
    height = _over(whole, joined)
    sides = [_side(height, -1.0, 0.0), _side(height, 1.0, joined.thickness.value)]
    parts = [largest_piece(whole.region.intersection(side)) for side in sides]
    names = (whole.name, pieces[1].name)
    split = [replace(whole, name=name, region=part) for part, name in zip(parts, names, strict=True)]
    return [joined, *(with_own_points(piece, cloud.points, cloud.diameter / 200) for piece in split)]


def _side(height: np.ndarray, sign: float, level: float) -> Polygon:
    """The half plane in which sign * (height - level) > 0, as far as boards go."""
    flat = np.linalg.norm(height[:2])
    normal = sign * height[:2] / flat
    start = (level - height[2]) / flat * sign * normal
    along = np.array([-normal[1], normal[0]])
    corners = ((-1, 0), (1, 0), (1, 1), (-1, 1))
    return Polygon([start + FAR * (a * along + n * normal) for a, n in corners])
