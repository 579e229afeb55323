"""Boards laid on one another, sheet on sheet (paper, Connections, type 3): cleats, rails under a seat, doubled panels.

The faces that touch are hidden by each other, so that the thickness of one of the boards is mostly a guess: its hidden
face is put where the other board's is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from kerfwright.assemble.joints import face_plane
from kerfwright.assemble.options import AssembleOptions
from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.types import Sheet
from kerfwright.model import Contact, ContactEvidence, Origin

__all__ = ["laid_contacts", "laid_on"]

PARALLEL = 1 - 1e-9  # cosine: one class of the alignment
TOUCHING = 1e-6  # mm; faces that were put together
SEEN = 0.25  # share of the overlap that must show points of a face for it to count as seen
FREE = 0.2  # share of a gap that cameras saw through


@dataclass(frozen=True, eq=False)
class _Pair:
    """Face `face_a` of sheet a looks at `face_b` of sheet b across a gap, mm; overlap in a's board frame."""

    a: int
    b: int
    face_a: str
    face_b: str
    gap: float
    overlap: Polygon | MultiPolygon


def laid_on(
    sheets: tuple[Sheet, ...], cloud: Cloud, free: FreeSpace, options: AssembleOptions
) -> tuple[Sheet, ...]:
    """The sheets with hidden faces moved onto the faces that hide them, nearest pairs first."""
    moved = list(sheets)
    for pair in sorted(_pairs(sheets, options.min_contact * cloud.diameter), key=lambda p: abs(p.gap)):
        mover = _mover(pair, moved, cloud, options)
        if mover is None or _is_free(pair, moved, free):
            continue
        one, face, other, other_face = mover
        moved[one] = _reached(moved[one], face, *face_plane(moved[other], other_face))
    return tuple(moved)


def laid_contacts(sheets: tuple[Sheet, ...], shortest: float) -> list[Contact]:
    """A contact for every two boards that touch sheet on sheet, over at least `shortest` mm squared."""
    return [_contact(pair, sheets) for pair in _pairs(sheets, shortest) if abs(pair.gap) < TOUCHING]


def _pairs(sheets: tuple[Sheet, ...], shortest: float) -> list[_Pair]:
    found = []
    for a in range(len(sheets)):
        for b in range(len(sheets)):
            if a == b or abs(sheets[a].normal @ sheets[b].normal) < PARALLEL:
                continue
            face_b = "bottom" if sheets[a].normal @ sheets[b].normal > 0 else "top"
            pair = _pair(sheets, a, b, "top", face_b, shortest)
            if pair is not None and (face_b == "bottom" or a < b):
                found.append(pair)
            if face_b == "top" and a < b:
                pair = _pair(sheets, a, b, "bottom", "bottom", shortest)
                found += [pair] if pair is not None else []
    return found


def _pair(sheets: tuple[Sheet, ...], a: int, b: int, face_a: str, face_b: str, shortest: float) -> _Pair | None:
    """The two faces, if they look at each other closely and overlap."""
    one, other = sheets[a], sheets[b]
    offset = face_plane(one, face_a)[1]
    gap = float(-face_plane(other, face_b)[1]) - offset
    if abs(gap) > min(one.thickness.value, other.thickness.value):
        return None
    overlap = one.region.intersection(_moved_region(other, one))
    return _Pair(a, b, face_a, face_b, gap, overlap) if overlap.area > shortest**2 else None


def _moved_region(sheet: Sheet, to: Sheet) -> Polygon:
    def ring(coords) -> np.ndarray:
        xy = np.asarray(coords)[:, :2]
        return to.to_board(sheet.to_world(np.c_[xy, np.zeros(len(xy))]))[:, :2]

    return Polygon(ring(sheet.region.exterior.coords), [ring(r.coords) for r in sheet.region.interiors]).buffer(0)


def _mover(
    pair: _Pair, sheets: list[Sheet], cloud: Cloud, options: AssembleOptions
) -> tuple[int, str, int, str] | None:
    """Which board's face is moved onto which other's: the one nobody sees; None where both are seen apart."""
    ways = ((pair.a, pair.face_a, pair.b, pair.face_b), (pair.b, pair.face_b, pair.a, pair.face_a))
    seen = [_seen(sheets[one], face, pair, sheets[pair.a], cloud, options) for one, face, _, _ in ways]
    if min(seen) > SEEN:
        return None
    areas = [sheets[one].region.area for one, _, _, _ in ways]
    return ways[0 if (seen[0] > SEEN, areas[0]) < (seen[1] > SEEN, areas[1]) else 1]


def _seen(sheet: Sheet, face: str, pair: _Pair, frame: Sheet, cloud: Cloud, options: AssembleOptions) -> float:
    """Share of the overlap that shows points of the face."""
    idx = sheet.top_idx if face == "top" else sheet.bottom_idx
    xy = frame.to_board(cloud.points[idx])[:, :2]
    inner = pair.overlap.buffer(-options.outline_error * cloud.diameter)
    if inner.is_empty or not len(xy):
        return 0.0
    cell = options.outline_error * cloud.diameter
    own = xy[shapely.contains_xy(inner, xy[:, 0], xy[:, 1])]
    cells = len(np.unique(np.floor(own / cell).astype(np.int64), axis=0)) if len(own) else 0
    return float(min(cells * cell**2 / inner.area, 1.0))


def _is_free(pair: _Pair, sheets: list[Sheet], free: FreeSpace) -> bool:
    """Whether cameras saw through the gap between the faces."""
    frame = sheets[pair.a]
    level = frame.thickness.value + pair.gap / 2 if pair.face_a == "top" else -pair.gap / 2
    low_x, low_y, high_x, high_y = pair.overlap.bounds
    grid = np.meshgrid(np.linspace(low_x, high_x, 40), np.linspace(low_y, high_y, 40))
    x, y = (g.ravel() for g in grid)
    inside = shapely.contains_xy(pair.overlap, x, y)
    if pair.gap <= 0 or not inside.any():
        return False
    places = frame.to_world(np.c_[x[inside], y[inside], np.full(int(inside.sum()), level)])
    return float((free.votes(places) >= 2).mean()) > FREE


def _reached(sheet: Sheet, face: str, normal: np.ndarray, offset: float) -> Sheet:
    """The sheet as thick as it must be for a face of it to lie on a plane; its other face stays."""
    place = sheet.to_board((normal * offset)[None])[0, 2]
    thickness = place if face == "top" else sheet.thickness.value - place
    frame = sheet.world_from_board.copy()
    if face == "bottom":
        frame[:3, 3] += place * sheet.normal
    quantity = sheet.thickness.model_copy(update={"value": float(thickness), "origin": Origin.IMPLIED})
    return replace(sheet, world_from_board=frame, thickness=quantity)


def _contact(pair: _Pair, sheets: tuple[Sheet, ...]) -> Contact:
    a, b = sheets[pair.a], sheets[pair.b]
    normal, offset = face_plane(a, pair.face_a)
    level = a.thickness.value if pair.face_a == "top" else 0.0
    pieces = [p for p in getattr(pair.overlap, "geoms", [pair.overlap]) if p.geom_type == "Polygon"]
    return Contact(
        type=3, a=a.name, b=b.name, face_a=pair.face_a, face_b=pair.face_b, point=_point(normal * offset),
        normal=_point(normal), interface=tuple(_polygon(p, a, level, pair.face_a) for p in pieces),
        area=float(pair.overlap.area), angle=0.0, evidence=ContactEvidence(),
    )


def _polygon(piece: Polygon, sheet: Sheet, level: float, face: str) -> tuple[tuple[float, float, float], ...]:
    """World corners, counter-clockwise about the face's outward normal."""
    ring = shapely.geometry.polygon.orient(piece.simplify(0.05), 1.0 if face == "top" else -1.0).exterior
    xy = np.asarray(ring.coords)[:-1, :2]
    return tuple(_point(p) for p in sheet.to_world(np.c_[xy, np.full(len(xy), level)]))


def _point(v: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(c) for c in v)
