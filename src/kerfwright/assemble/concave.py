"""Boards flush in one plane that were found as one: seams that begin at the inner corners of its outline.

A rail between two legs, level with them, makes a region like a U. No seam runs right across it; each runs on from an
inner corner to the far side of the wood. There the geometry expects one, and a fainter change than usual is enough.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from shapely.geometry import LinearRing, LineString, Point, Polygon

from kerfwright.assemble.splits import SeamLine, SeamSearch
from kerfwright.identify.outlines import largest_piece

__all__ = ["find_inner_seams", "inner_corners"]

COARSE = 1 / 60  # of D, to which outlines are simplified: what is left of them has corners
LEAST_EDGE = 1 / 20  # of D, on both sides of a corner
LEAST_TURN = 0.5  # sine; grows with the turn up to square corners, and inner corners are that or nearly
MIDDLE, PLACES = 0.6, 40  # share of an edge that tells its line, and places on it: its ends are the corners' raggedness
NEAR = 1 / 70  # of D, between an inner corner and its seam
BESIDE = 1 / 100  # of D, to either side of a seam: there its two ends are looked for
NARROWEST = 1 / 16  # of D, of the wood along a seam
SAMPLE = 1 / 5  # of that, between places on the free edge that a seam prolongs
FEWEST = 20  # of them
LEAST_STRENGTH = 3.0  # of a board's best seam, against the usual change across lines of the face
LENT_STRENGTH = 1.7  # of further ones, in the ratio of `splits.py`: a rail that one leg ends, the other ends, too
STRAY = 0.1  # of a strip between seams that may lie in further pieces


def find_inner_seams(search: SeamSearch) -> list[SeamLine]:
    """Seams from inner corners of a board's outline, all in the direction that shows the strongest, in order along it.
    """
    sheet = search.sheet
    ring = np.asarray(sheet.region.minimum_rotated_rectangle.exterior.coords)
    first = (ring[1] - ring[0]) / np.linalg.norm(ring[1] - ring[0])
    corners = inner_corners(sheet.region, search.diameter)
    found = [_seams(search, m, corners) for m in (first, np.array([-first[1], first[0]]))]
    best = max(found, key=lambda seams: max((s.strength for s in seams), default=0.0))
    best = sorted(best, key=lambda s: s.offset)
    clear = any(s.strength > LEAST_STRENGTH for s in best)
    return best if clear and _parts_whole(sheet.region, best) else []


def inner_corners(region: Polygon, diameter: float) -> np.ndarray:
    """(N, 2) corners of the coarse outline at which the wood fills more than half a turn, each where the two edges of
    the outline itself meet: a coarse corner lies up to its tolerance away, further than a seam may.
    """
    ring = np.asarray(region.simplify(COARSE * diameter).exterior.coords)[:-1, :2]
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    lengths = np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1)
    sine = (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) / lengths[0] / lengths[1]
    sine = sine if region.exterior.is_ccw else -sine
    found = np.flatnonzero((sine < -LEAST_TURN) & (np.minimum(*lengths) > LEAST_EDGE * diameter))
    count = len(ring)
    return np.array([
        _met(region.exterior, ring[k - 1], ring[k], ring[(k + 1) % count], diameter) for k in found
    ]).reshape(-1, 2)  # fmt: skip


def _met(outline: LinearRing, before: np.ndarray, corner: np.ndarray, after: np.ndarray, diameter: float) -> np.ndarray:
    """(2,) where the outline's edges on both sides of a coarse corner meet; that corner if this is nowhere near."""
    lines = [_edge_line(outline, *ends) for ends in ((before, corner), (corner, after))]
    normals, offsets = np.array([n for n, _ in lines]), np.array([d for _, d in lines])
    if abs(np.linalg.det(normals)) < LEAST_TURN:
        return corner
    met = np.linalg.solve(normals, offsets)
    return met if np.linalg.norm(met - corner) < 2 * COARSE * diameter else corner


def _edge_line(outline: LinearRing, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, float]:
    """Normal (2,) and offset of the line through the middle of the outline from one coarse corner to the next."""
    along = np.sort([outline.project(Point(start)), outline.project(Point(end))])
    if along[1] - along[0] > outline.length / 2:  # by way of the ring's first point
        along = np.array([along[1], along[0] + outline.length])
    places = np.linspace(*(along[0] + np.ptp(along) * np.array([1 - MIDDLE, 1 + MIDDLE]) / 2), PLACES) % outline.length
    xy = np.array([outline.interpolate(s).coords[0][:2] for s in places])
    direction = (end - start) / np.linalg.norm(end - start)
    normal = np.array([-direction[1], direction[0]])
    u, v = xy @ direction, xy @ normal
    one, two = np.triu_indices(PLACES, 1)
    slope = float(np.median((v[two] - v[one]) / (u[two] - u[one] + 1e-9)))  # Theil and Sen's
    normal = (normal - slope * direction) / np.hypot(1, slope)
    return normal, float(np.median(xy @ normal))


def _seams(search: SeamSearch, m: np.ndarray, corners: np.ndarray) -> list[SeamLine]:
    """At most one seam a corner along the tangent of m; corners on one line share theirs."""
    found: list[SeamLine] = []
    near = NEAR * search.diameter
    for corner in corners:
        if any(abs(s.offset - corner @ m) < near for s in found):
            continue
        band = _band(search.sheet.region, m, corner, search.diameter)
        if band is not None:
            own = replace(search, sheet=replace(search.sheet, region=band))
            seams = [s for s in own.across(m, LENT_STRENGTH) if abs(s.offset - corner @ m) < near]
            seams = sorted(seams, key=lambda s: -s.strength)[:1]
            found += [_in_line(s, search.sheet.region, band, corner, near) for s in seams]
    return found


def _in_line(seam: SeamLine, region: Polygon, band: Polygon, corner: np.ndarray, near: float) -> SeamLine:
    """The seam moved into the line of the free edge that it prolongs, which is known better: both are the leg's."""
    ring = region.exterior
    points = np.array([ring.interpolate(s).coords[0] for s in np.arange(0, ring.length, SAMPLE * near)])
    tangent = np.array([-seam.m[1], seam.m[0]])
    along, wood = points @ tangent, np.asarray(band.exterior.coords) @ tangent
    outside = (along < wood.min() - near / 2) | (along > wood.max() + near / 2)
    edge = points[outside & (np.abs(points @ seam.m - corner @ seam.m) < near)] @ seam.m
    if len(edge) < FEWEST:
        return seam
    shift = float(np.median(edge)) - seam.offset
    return replace(seam, offset=seam.offset + shift, start=seam.start + shift * seam.m, end=seam.end + shift * seam.m)


def _band(region: Polygon, m: np.ndarray, corner: np.ndarray, diameter: float) -> Polygon | None:
    """The part of a region that lies, along the tangent, where the wood beside the corner does: the shorter of the two
    stretches of wood to its sides. None where that is too short for a seam.
    """
    tangent = np.array([-m[1], m[0]])
    sides = [_stretch(region, m, corner, shift * BESIDE * diameter) for shift in (-1, 1)]
    if None in sides:
        return None
    low, high = min(sides, key=lambda s: s[1] - s[0])
    if high - low < NARROWEST * diameter:
        return None
    far = 4 * region.length
    frame = [(-far, low), (far, low), (far, high), (-far, high)]
    return largest_piece(region.intersection(Polygon([u * m + v * tangent for u, v in frame])))


def _stretch(region: Polygon, m: np.ndarray, corner: np.ndarray, shift: float) -> tuple[float, float] | None:
    """Where, along the tangent, the wood nearest to the corner lies on a line beside it."""
    tangent = np.array([-m[1], m[0]])
    middle, far = (corner @ m + shift) * m, 4 * region.length
    cut = region.intersection(LineString([middle - far * tangent, middle + far * tangent]))
    lines = [g for g in getattr(cut, "geoms", [cut]) if g.geom_type == "LineString" and not g.is_empty]
    runs = [tuple(sorted(np.asarray(g.coords)[[0, -1]] @ tangent)) for g in lines]
    place = corner @ tangent
    return min(runs, key=lambda run: max(run[0] - place, place - run[1], 0.0), default=None)


def _parts_whole(region: Polygon, seams: list[SeamLine]) -> bool:
    """Whether each strip between the seams holds one piece of wood: a ladder's rungs would be lost."""
    if not seams:
        return True
    m, far = seams[0].m, 4 * region.length
    tangent = np.array([-m[1], m[0]])
    bounds = [-far, *(s.offset for s in seams), far]
    for low, high in pairwise(bounds):
        frame = [(low, -far), (high, -far), (high, far), (low, far)]
        strip = region.intersection(Polygon([u * m + v * tangent for u, v in frame]))
        if strip.area - largest_piece(strip).area > STRAY * strip.area:
            return False
    return True
