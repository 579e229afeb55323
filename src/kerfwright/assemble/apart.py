"""Boards kept apart: a corner traced in the dark must not run into a board that the sheet does not meet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.assemble.types import Assembly
from kerfwright.identify.coplanar import PARALLEL, moved_region
from kerfwright.identify.joints import face_plane, trace_of
from kerfwright.identify.outlines import largest_piece
from kerfwright.identify.types import Sheet

__all__ = ["kept_apart"]

MOST = 0.05  # of a region that is cut off; more is no slip of an outline, and is left for the checker to report
LEVEL = 0.1  # of the thinner of two parallel boards' thickness, by which they lie side by side and not on one another
CLEARANCE = 1 / 2000  # of D, between a board and what it was cut off from


def kept_apart(assembly: Assembly, diameter: float) -> Assembly:
    """The assembly, regions cut back where they run a little into boards without a contact; smaller boards yield."""
    meeting = {frozenset((c.a, c.b)) for c in assembly.contacts}
    sheets = list(assembly.sheets)
    for k in np.argsort([s.region.area for s in sheets], kind="stable"):
        for other in assembly.sheets:
            if other.name == sheets[k].name or frozenset((other.name, sheets[k].name)) in meeting:
                continue
            if other.region.area >= sheets[k].region.area:
                sheets[k] = _cut_back(sheets[k], other, CLEARANCE * diameter)
    return replace(assembly, sheets=tuple(sheets))


def _cut_back(sheet: Sheet, other: Sheet, clearance: float) -> Sheet:
    """The sheet without what lies inside the other board at any height."""
    inside = _shadow(sheet, other, clearance)
    overlap = sheet.region.intersection(inside).area
    if not 0 < overlap < MOST * sheet.region.area:
        return sheet
    return replace(sheet, region=largest_piece(sheet.region.difference(inside)))


def _shadow(sheet: Sheet, other: Sheet, clearance: float) -> Polygon:
    """Where the other board lies in the sheet: between its planes, at any height, and within its outline."""
    if abs(sheet.normal @ other.normal) > PARALLEL:
        return _beside(sheet, other, clearance)
    span = 4 * (sheet.region.length + other.region.length)
    strip = None
    for face in ("top", "bottom"):
        normal, offset = face_plane(other, face)
        trace = trace_of(sheet, -normal, -offset - clearance)
        if trace is None:
            return Polygon()
        low = min(trace.slope * (z - trace.depth) for z in (0.0, sheet.thickness.value))
        ends = np.array([-span, span])
        half = Polygon([
            *trace.place(np.full(2, low), ends), *trace.place(np.full(2, span), ends[::-1]),
        ])
        strip = half if strip is None else strip.intersection(half)
    return strip.intersection(_outline_in(sheet, other, clearance))


def _beside(sheet: Sheet, other: Sheet, clearance: float) -> Polygon:
    """The outline of a parallel board at the same height as the sheet; of one laid on it nothing."""
    place = other.region.representative_point().coords[0]
    faces = other.to_world(np.array([[*place, z] for z in (0.0, other.thickness.value)]))
    low, high = np.sort(sheet.to_board(faces)[:, 2])
    thinner = min(sheet.thickness.value, other.thickness.value)
    level = min(high, sheet.thickness.value) - max(low, 0.0) > LEVEL * thinner
    return moved_region(other, sheet).buffer(clearance) if level else Polygon()


def _outline_in(sheet: Sheet, other: Sheet, clearance: float) -> Polygon:
    """The other board's corners seen along the sheet's normal, as a convex outline."""
    ring = np.asarray(other.region.exterior.coords)
    corners = np.concatenate([np.c_[ring, np.full(len(ring), z)] for z in (0.0, other.thickness.value)])
    local = sheet.to_board(other.to_world(corners))
    if local[:, 2].max() < 0 or local[:, 2].min() > sheet.thickness.value:
        return Polygon()
    return shapely.MultiPoint(local[:, :2]).convex_hull.buffer(clearance)
