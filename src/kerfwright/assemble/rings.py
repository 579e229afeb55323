"""Frames of boards in one plane: a ring found as one region is cut at the seams of its corners.

At every corner of the opening three straight lines may be the seam: the mitre, from the inner corner to the outer one,
and the two that run one edge of the opening on. They are swept in the photographs like any seam. A ring stays whole
unless its corners show seams together: a frame sawn out of one panel has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon

from kerfwright.assemble.corner_grain import grain_kind
from kerfwright.assemble.splits import SeamLine
from kerfwright.identify.coplanar import with_own_points
from kerfwright.identify.photo_edges import Photos, sweep_edge
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles

__all__ = ["RingCorner", "chosen_seams", "find_ring_seams", "ring_corners", "split_ring"]

NARROWEST = 1 / 10  # of D; a ring's opening is at least this wide
TOLERANCE = 1 / 100  # of D; how far the opening's outline may be from its straight sides
MOST_CORNERS = 8  # of an opening that boards are put round
LEAST_TURN = 0.35  # radians between two sides of an opening
SHORTEST = 3.0  # tolerances; a shorter side of the opening is a rounded corner
MIDDLE = 0.8  # of a side that its line is fitted to: corners are rounded
FAR = 1e5  # mm; longer than any board
INSET = 0.5  # mm past the opening's corner, where a ray is in the wood
SWEPT = (0.1, 0.7)  # shares of a line's length between which it is swept: at its outer end there is no wood beside it
REACH = 0.25  # of its length that a line is swept to either side
LEAST_STRENGTH = 2.5  # of a seam, in units of what is found beside it
MARGIN = 1.5  # times the strength of the next best line of the same corner
LEAST_VIEWS = 4
LEAST_CLEAR = 0.5  # share of the corners that must show their seams
BUTTS = ("before", "after")


@dataclass(frozen=True, eq=False)
class RingCorner:
    """A corner of the opening and where three lines from it leave the wood, board frame mm.

    ends: "mitre" halves the corner; "before" and "after" run the opening's edge before or after the corner on.
    """

    inner: np.ndarray  # (2,)
    ends: dict[str, np.ndarray]


def ring_corners(region: Polygon, narrowest: float, tolerance: float) -> list[RingCorner]:
    """Corners of a region's one large opening, counter-clockwise; none where it is no polygon of few corners.

    narrowest: width of the smallest opening that makes a ring, mm; tolerance: of the outline, mm.
    """
    holes = [Polygon(r) for r in region.interiors]
    holes = [h for h in holes if not h.buffer(-narrowest / 2).is_empty]
    if len(holes) != 1:
        return []
    edges = _edges(holes[0], tolerance)
    outer = [_outer_edge(edge, region, tolerance) for edge in edges]
    if not 3 <= len(edges) <= MOST_CORNERS or any(edge is None for edge in outer):
        return []
    return [_corner(edges[k - 1], edges[k], outer[k - 1], outer[k], region) for k in range(len(edges))]


_Edge = tuple[np.ndarray, np.ndarray]  # start and end (2,)


def _edges(hole: Polygon, tolerance: float) -> list[_Edge]:
    """The sides of a polygon, counter-clockwise, each a line fitted to the middle of its side."""
    ring = shapely.orient_polygons(hole).exterior
    rough = _without_straight(np.asarray(ring.simplify(tolerance).coords)[:-1])
    points = shapely.get_coordinates(shapely.line_interpolate_point(ring, np.arange(0, ring.length, tolerance / 4)))
    sides = [(a, b) for a, b in zip(rough, np.roll(rough, -1, axis=0), strict=True)
             if np.linalg.norm(b - a) > SHORTEST * tolerance]  # fmt: skip
    lines = [_fitted(_beside(points, a, b, tolerance), b - a) or (a, b) for a, b in sides]
    corners = [_crossing(lines[k - 1], lines[k]) for k in range(len(lines))]
    if len(lines) < 3 or any(c is None or ring.distance(Point(c)) > 2 * tolerance for c in corners):
        return []
    return list(zip(corners, corners[1:] + corners[:1], strict=True))


def _without_straight(corners: np.ndarray) -> np.ndarray:
    """Corners (N, 2) at which a ring turns; its first point need not be one."""
    ahead, behind = np.roll(corners, -1, axis=0) - corners, corners - np.roll(corners, 1, axis=0)
    turn = np.arctan2(behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0], (behind * ahead).sum(axis=1))
    return corners[np.abs(turn) > LEAST_TURN]


def _beside(points: np.ndarray, a: np.ndarray, b: np.ndarray, tolerance: float) -> np.ndarray:
    """Points near the middle of the side from a to b."""
    length = np.linalg.norm(b - a)
    along = (b - a) / length
    share = (points - a) @ along / length
    across = np.abs((points - a) @ [-along[1], along[0]])
    return points[(across < 2 * tolerance) & (np.abs(share - 0.5) < MIDDLE / 2)]


def _fitted(points: np.ndarray, along: np.ndarray) -> _Edge | None:
    """Two points of the line through most of the points, in the sense of `along`."""
    for _ in range(3):
        if len(points) < 5:
            return None
        middle = points.mean(axis=0)
        axis = np.linalg.svd(points - middle)[2][0]
        away = np.abs((points - middle) @ [-axis[1], axis[0]])
        points = points[away <= max(2.5 * float(np.median(away)), 1e-6)]
    return middle, middle + (axis if axis @ along > 0 else -axis)


def _crossing(one: _Edge, other: _Edge) -> np.ndarray | None:
    """Where two lines cross; None where they are all but parallel."""
    along, across = one[1] - one[0], other[1] - other[0]
    both = np.stack([along, -across], axis=1)
    if abs(np.linalg.det(both)) < LEAST_TURN * np.linalg.norm(along) * np.linalg.norm(across):
        return None
    return one[0] + np.linalg.solve(both, other[0] - one[0])[0] * along


def _outer_edge(edge: _Edge, region: Polygon, tolerance: float) -> _Edge | None:
    """The line of the outer edge in front of a side of the opening; None where there is no straight one."""
    a, b = edge
    along = (b - a) / np.linalg.norm(b - a)
    outward = np.array([along[1], -along[0]])  # the opening lies on the left of its own sides
    feet = a + np.linspace(0.5 - MIDDLE / 2, 0.5 + MIDDLE / 2, 40)[:, None] * (b - a) + tolerance * outward
    hits = [_exit(foot, outward, region) for foot in feet]
    hits = np.array([h for h in hits if h is not None])
    if len(hits) < 20:
        return None
    line = _fitted(hits, along)
    if line is None:
        return None
    across = line[1] - line[0]
    away = np.abs((hits - line[0]) @ [-across[1], across[0]])
    return line if np.mean(away < tolerance) > 0.5 else None


def _exit(start: np.ndarray, direction: np.ndarray, region: Polygon) -> np.ndarray | None:
    """Where a ray from a place in the wood leaves it."""
    wood = region.intersection(LineString([start, start + FAR * direction]))
    pieces = [p for p in getattr(wood, "geoms", [wood]) if p.geom_type == "LineString" and not p.is_empty]
    first = min(pieces, key=lambda p: shapely.distance(p, shapely.Point(start)), default=None)
    return None if first is None else np.asarray(first.coords)[-1]


def _corner(before: _Edge, after: _Edge, outer_before: _Edge, outer_after: _Edge, region: Polygon) -> RingCorner:
    inner, outer = after[0], _crossing(outer_before, outer_after)
    ways = {"before": before[1] - before[0], "after": after[0] - after[1]}
    if outer is not None:
        ways["mitre"] = outer - inner
    ends = {}
    for kind, way in ways.items():
        way = way / np.linalg.norm(way)
        end = _exit(inner + INSET * way, way, region)
        if end is not None:
            ends[kind] = end
    return RingCorner(inner, ends)


def find_ring_seams(sheet: Sheet, photos: Photos, obstacles: Obstacles, diameter: float) -> list[SeamLine]:
    """The seams of a ring, one a corner of its opening, counter-clockwise; none for a board that is no ring of boards.

    Frames are made one way: mitred at every corner, or butted at every one. The others follow the clear corners.
    """
    corners = ring_corners(sheet.region, NARROWEST * diameter, TOLERANCE * diameter)
    shown = [_shown(sheet, corner, photos, obstacles, diameter) for corner in corners]
    grain = [grain_kind(sheet, c.inner, c.ends, photos, obstacles, diameter) for c in corners]
    return chosen_seams(shown, grain)


def chosen_seams(shown: list[dict[str, SeamLine]], grain: Sequence[str | None]) -> list[SeamLine]:
    """One line a corner out of those that were looked for there, by kind; none where too few corners show one.

    grain: the kind that each corner's grain tells; it counts where no line is clear.
    """
    clear = [_clear_kind(lines) or told for lines, told in zip(shown, grain, strict=True)]
    mitres, butts = (sum(kind in kinds for kind in clear) for kinds in (("mitre",), BUTTS))
    if not shown or min(mitres, butts) or mitres + butts < LEAST_CLEAR * len(shown):
        return []
    kinds = ("mitre",) if mitres else BUTTS
    if any(not set(kinds) & set(lines) for lines in shown):
        return []
    return [
        lines[told] if told in lines else max((lines[k] for k in kinds if k in lines), key=lambda s: s.strength)
        for lines, told in zip(shown, clear, strict=True)
    ]


def _clear_kind(lines: dict[str, SeamLine]) -> str | None:
    """The kind of a corner's seam where the photographs show one, and only one."""
    if not lines:
        return None
    best = max(lines, key=lambda kind: lines[kind].strength)
    others = [seam.strength for kind, seam in lines.items() if kind != best]
    seam = lines[best]
    clear = seam.strength > LEAST_STRENGTH and seam.strength > MARGIN * max(others, default=0.0)
    return best if clear and seam.views >= LEAST_VIEWS else None


def _shown(
    sheet: Sheet, corner: RingCorner, photos: Photos, obstacles: Obstacles, diameter: float
) -> dict[str, SeamLine]:
    """A corner's lines with how clearly the photographs show them; of the two faces the better one."""
    found = {}
    for kind, end in corner.ends.items():
        seams = [_swept(sheet, corner.inner, end, face, photos, obstacles, diameter) for face in ("top", "bottom")]
        found[kind] = max(seams, key=lambda s: (min(s.views, LEAST_VIEWS), s.strength))
    return found


def _swept(
    sheet: Sheet, start: np.ndarray, end: np.ndarray, face: str, photos: Photos, obstacles: Obstacles, diameter: float
) -> SeamLine:
    """The line swept across itself, as far as there is wood on both sides of it; strength 0 where nothing shows it."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    m = np.array([-along[1], along[0]])  # counter-clockwise round the opening, when start is at the opening
    share = np.linspace(*SWEPT, max(20, int(length * (SWEPT[1] - SWEPT[0]) / (diameter / 250))))
    height = sheet.thickness.value if face == "top" else 0.0
    places = sheet.to_world(np.c_[start + share[:, None] * (end - start), np.full(len(share), height)])
    visible = obstacles.visible(photos.views, places, sheet.normal if face == "top" else -sheet.normal, 0.3)
    reach = min(REACH * length, diameter / 25)
    offsets = np.arange(-reach, reach, diameter / 1000)
    direction = sheet.world_from_board[:3, :2] @ m
    sweep = sweep_edge(photos, places, direction, offsets, visible, smoothing=diameter / 600)
    if sweep is None:
        return SeamLine(m, float(start @ m), start, end, 0.0, 0)
    near = np.abs(offsets) <= diameter / 300
    strength = float(sweep.strength[near].max() / np.median(sweep.strength[~near]))
    return SeamLine(m, float(start @ m), start, end, strength, sweep.views)


def split_ring(sheet: Sheet, seams: list[SeamLine], points: np.ndarray, diameter: float) -> list[Sheet]:
    """The boards of a ring, the first one after the first seam; none where the seams do not part it into as many.

    points: (N, 3) world, of the whole cloud; each board keeps its own.
    """
    over = TOLERANCE * diameter
    ways = [(s.end - s.start) / np.linalg.norm(s.end - s.start) for s in seams]
    cuts = [LineString([s.start - over * way, s.end + over * way]) for s, way in zip(seams, ways, strict=True)]
    parts = shapely.polygonize([shapely.node(shapely.union_all([sheet.region.boundary, *cuts]))]).geoms
    pieces = []
    for one, other in zip(seams, seams[1:] + seams[:1], strict=True):
        side = other.start - one.start
        outward = np.array([side[1], -side[0]]) / np.linalg.norm(side)
        width = min(np.linalg.norm(s.end - s.start) for s in (one, other))
        middle = Point((one.start + other.start) / 2 + width / 4 * outward)
        pieces += [part for part in parts if part.contains(middle) and sheet.region.contains(middle)]
    if len(pieces) != len(seams):
        return []
    return [with_own_points(replace(sheet, region=piece), points, diameter / 500) for piece in pieces]
