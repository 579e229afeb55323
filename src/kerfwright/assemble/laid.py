"""Contacts of boards laid on one another, sheet on sheet (paper, Connections, type 3)."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from kerfwright.identify.joints import face_plane
from kerfwright.identify.laid import Pair, facing_pairs
from kerfwright.identify.types import INFERRED_FACES, Sheet
from kerfwright.model import Contact, ContactEvidence, Origin

__all__ = ["laid_contacts"]

TOUCHING = 1e-6  # mm; faces that were put together


def laid_contacts(sheets: tuple[Sheet, ...], shortest: float) -> list[Contact]:
    """A contact for every two boards that touch sheet on sheet, over at least `shortest` mm squared."""
    return [_contact(pair, sheets) for pair in facing_pairs(sheets, shortest) if abs(pair.gap) < TOUCHING]


def _contact(pair: Pair, sheets: tuple[Sheet, ...]) -> Contact:
    a, b = sheets[pair.a], sheets[pair.b]
    normal, offset = face_plane(a, pair.face_a)
    level = a.thickness.value if pair.face_a == "top" else 0.0
    pieces = [p for p in getattr(pair.overlap, "geoms", [pair.overlap]) if p.geom_type == "Polygon"]
    inferred = INFERRED_FACES[pair.face_a] in a.inferred or INFERRED_FACES[pair.face_b] in b.inferred
    return Contact(
        type=3, a=a.name, b=b.name, face_a=pair.face_a, face_b=pair.face_b, point=_point(normal * offset),
        normal=_point(normal), interface=tuple(_polygon(p, a, level, pair.face_a) for p in pieces),
        area=float(pair.overlap.area), angle=0.0,
        evidence=ContactEvidence(decided_by="inferred" if inferred else "geometry"),
        origin=Origin.INFERRED if inferred else Origin.MEASURED,
    )


def _polygon(piece: Polygon, sheet: Sheet, level: float, face: str) -> tuple[tuple[float, float, float], ...]:
    """World corners, counter-clockwise about the face's outward normal."""
    ring = orient(piece.simplify(0.05), 1.0 if face == "top" else -1.0).exterior
    xy = np.asarray(ring.coords)[:-1, :2]
    return tuple(_point(p) for p in sheet.to_world(np.c_[xy, np.full(len(xy), level)]))


def _point(v: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(c) for c in v)
