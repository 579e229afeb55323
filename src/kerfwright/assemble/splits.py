"""Boards glued edge to edge: seams that run right across a region seen as one board (method.md; a limit the paper
names).

A seam is a straight line across the whole board at which the wood changes (`discontinuity.py`), in every stretch of it
and in the views. Grain wanders, knots and shadows are short, and an edge where another board stands on this one is
already known. Precision before recall.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from shapely.geometry import LineString, Polygon

from kerfwright.assemble.discontinuity import Discontinuity, discontinuity
from kerfwright.assemble.texture import FaceStrips, face_strips
from kerfwright.assemble.tone import ToneSteps, runs_along_grain, tone_steps
from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles
from kerfwright.model import Contact, ContactEvidence

__all__ = ["SeamLine", "SeamSearch", "find_seam_lines", "seam_contact", "seam_segments", "split_sheet"]

LEAST_STRENGTH = 7.0  # of a board's best seam, against the usual change across lines of its face
LENT_STRENGTH = 4.0  # of further ones: where two boards were glued, more may have been
LENT_TONE = 1.9  # ... told by tone: steps within made single boards (seeds from 1000) had 1.7 at most
LEAST_ALONG = 0.5  # share of the change that every third of the line must show
LINE_ALONG = 0.6  # ... where no geometry expects a line: a year ring all along a made single board had .55
LEAST_VIEWS = 4
CERTAIN = 2.0  # times LEAST_STRENGTH; steep grain that passed for a seam in four views had up to 1.13
THROUGH = 1 / 150  # of D, between a seam's places on both faces
LEAST_AGREEMENT = 0.75  # mean share of the change that a single view shows
EASED = 1 / 40  # of D; eased edges of two boards lie no further apart
GAP_SHARE = 0.5  # of the way between two such lines: the rest is rounding; it cannot be told apart from above
PARTNER = 0.7  # strength of the weaker line of the two
NARROWEST = 1 / 16  # of D; narrower strips are shadows and edges more often than boards
SEPARATE = 2 / 3  # of it, within which one joint is looked for
TOGETHER = 1 / 100  # of D, within which a line and a step of tone are the same joint's
KNOWN = 1 / 40  # of D, round lines in which other boards meet this one

Change = Discontinuity | ToneSteps


@dataclass(frozen=True, eq=False)
class SeamLine:
    """The line m.xy = offset across a board, board frame mm, from start to end."""

    m: np.ndarray
    offset: float
    start: np.ndarray
    end: np.ndarray
    strength: float
    views: int
    gap: float = 0.0  # mm between the two boards, where their eased edges show as two lines
    along: float = 1.0  # least share of the change that a third of the line shows


@dataclass(frozen=True, eq=False)
class SeamSearch:
    """A board, the boards that touch it, and the photographs in which seams across it are looked for."""

    sheet: Sheet
    touching: list[Sheet]
    photos: Photos
    obstacles: Obstacles
    diameter: float

    def across(self, m: np.ndarray, least: float = 0.0) -> list[SeamLine]:
        """Seams square to m on the face that shows the strongest one, all that the other face does not deny.

        least : strength of a seam where one is expected; 0 asks for one that is clear by itself.
        """
        strips = [_strips(self, m, face) for face in ("top", "bottom")]
        lines = _on_either_face(self, m, [s and discontinuity(s) for s in strips], least or LENT_STRENGTH)
        if least:
            return lines
        steps = [s and tone_steps(s) for s in strips]
        along = [s is not None and runs_along_grain(s) for s in strips]
        tones = _on_either_face(self, m, [t if a else None for t, a in zip(steps, along, strict=True)], LENT_TONE)
        shaded = [t for t, a in zip(steps, along, strict=True) if t is not None and not a]
        lines = [s for s in lines if s.along > LINE_ALONG and not any(t.slopes(s.offset) for t in shaded)]
        seams = _merged(lines, tones, self.diameter)
        return seams if any(_is_clear(s) for s in seams) else []


def _strongest(seams: list[SeamLine]) -> float:
    return max((s.strength for s in seams), default=0.0)


def find_seam_lines(search: SeamSearch) -> list[SeamLine]:
    """Seams across a board in the direction that shows the strongest one, in order along it."""
    ring = np.asarray(search.sheet.region.minimum_rotated_rectangle.exterior.coords)
    first = (ring[1] - ring[0]) / np.linalg.norm(ring[1] - ring[0])
    found = [search.across(m) for m in (first, np.array([-first[1], first[0]]))]
    return sorted(max(found, key=_strongest), key=lambda s: s.offset)


def _strips(search: SeamSearch, m: np.ndarray, face: str) -> FaceStrips | None:
    """What the photographs show of a face across m; None where too little of it is seen."""
    ring = np.asarray(search.sheet.region.exterior.coords)[:, :2]
    margin = NARROWEST * search.diameter
    if np.ptp(ring @ m) < 2.5 * margin or np.ptp(ring @ [-m[1], m[0]]) < margin:
        return None
    strips = face_strips(search.sheet, m, face, search.photos, search.obstacles, search.diameter)
    return strips if strips is not None and len(strips.colours) >= LEAST_VIEWS else None


def _on_either_face(
    search: SeamSearch, m: np.ndarray, faces: list[Change | None], least: float
) -> list[SeamLine]:
    """Seams of the face that shows the strongest one, all that the other face does not deny."""
    found = []
    for own, other in (faces, faces[::-1]):
        seams = [] if own is None else _seams_across(search.sheet, m, own, search.touching, search.diameter, least)
        found.append([s for s in seams if not _is_denied(s, own, other, search.diameter)])
    return max(found, key=_strongest)


def _merged(lines: list[SeamLine], tones: list[SeamLine], diameter: float) -> list[SeamLine]:
    """One seam a joint. A joint that shows as a line is known best by it, and is as clear as its tone makes it."""
    out, tones = [], list(tones)
    for seam in sorted(lines, key=lambda s: -s.strength):
        same = [t for t in tones if abs(t.offset - seam.offset) < TOGETHER * diameter]
        rivals = [t for t in tones if abs(t.offset - seam.offset) < SEPARATE * NARROWEST * diameter and t not in same]
        if any(t.strength > seam.strength for t in rivals):
            continue
        best = max([seam, *same], key=lambda s: s.strength)
        out.append(replace(seam, strength=best.strength, views=best.views))
        tones = [t for t in tones if t not in same and t not in rivals]
    return out + tones


def _is_denied(seam: SeamLine, own: Change, other: Change | None, diameter: float) -> bool:
    """Whether the other face, shown by as many views, changes no more than usual there: a seam goes right through."""
    if other is None or other.shown < own.shown:
        return False
    near = np.abs(other.offsets - seam.offset) < THROUGH * diameter
    told = other.strength[near & np.isfinite(other.strength)]
    return bool(len(told) and told.max() < other.denied)


def _seams_across(
    sheet: Sheet, m: np.ndarray, change: Change, touching: list[Sheet], diameter: float, least: float
) -> list[SeamLine]:
    """Seams of one face that are stronger than `least`."""
    ring = np.asarray(sheet.region.exterior.coords)[:, :2]
    margin = NARROWEST * diameter
    known = _known_lines(sheet, m, touching)
    places = _seam_places(change, ring @ m, margin, least)
    seams = [_seam(change, k, m, ring, diameter) for k in places]
    return [
        s for s in seams
        if all(abs(s.offset - other) > KNOWN * diameter for other in known)
        and _crosses_all(sheet.region, m, s.offset, margin / 4)
    ]


def _is_clear(seam: SeamLine) -> bool:
    """Whether a seam counts by itself: one that just passes must show in more than the least views."""
    return seam.strength > LEAST_STRENGTH and (seam.views > LEAST_VIEWS or seam.strength > CERTAIN * LEAST_STRENGTH)


def _seam_places(change: Change, across: np.ndarray, margin: float, least: float) -> list[int]:
    """Offsets whose change is strong, runs along the whole line, shows in the views, and is the strongest near by."""
    strength = np.nan_to_num(change.strength)
    inner = (change.offsets > across.min() + margin) & (change.offsets < across.max() - margin)
    reach = round(margin / (change.offsets[1] - change.offsets[0]) * SEPARATE)
    peaks = [
        int(k) for k in np.flatnonzero(inner & (strength > least))
        if strength[k] == strength[max(0, k - reach) : k + reach + 1].max()
    ]
    return [k for k in peaks if change.along(k) >= LEAST_ALONG and change.unbroken(k) and _agreed(change.views(k))]


def _agreed(shares: list[float]) -> bool:
    """Whether the views show the change: several each for itself, and all on the mean. A glint shows in one."""
    return _showing(shares) >= LEAST_VIEWS and float(np.mean(shares)) >= LEAST_AGREEMENT


def _showing(shares: list[float]) -> int:
    return sum(share > LEAST_ALONG for share in shares)


def _seam(change: Change, k: int, m: np.ndarray, ring: np.ndarray, diameter: float) -> SeamLine:
    """The seam at a peak: its middle, ends on the outline's box, and the gap where eased edges show as two lines."""
    along, strength = ring @ np.array([-m[1], m[0]]), np.nan_to_num(change.strength)
    step = float(change.offsets[1] - change.offsets[0])
    apart = step * _partner(strength, k, EASED * diameter / step) if change.sharp else 0.0
    at = change.located(k) + apart / 2
    start, end = at * m + np.array([[along.min()], [along.max()]]) * np.array([-m[1], m[0]])
    told, gap = (float(strength[k]), _showing(change.views(k))), abs(apart) * GAP_SHARE
    return SeamLine(m, at, start, end, *told, gap, change.along(k))


def _partner(strength: np.ndarray, k: int, reach: float) -> float:
    """Steps from a peak to the second line of the same joint, 0 where there is none: eased edges show as two lines."""
    low, high = max(1, int(k - reach)), min(len(strength) - 1, int(k + reach) + 1)
    partners = [
        j for j in range(low, high)
        if j != k and strength[j] > PARTNER * strength[k] and strength[j] >= max(strength[j - 1], strength[j + 1])
    ]
    return float(max(partners, key=lambda j: strength[j]) - k) if partners else 0.0


def _known_lines(sheet: Sheet, m: np.ndarray, touching: list[Sheet]) -> list[float]:
    """Offsets of the lines in which the sheet planes and the ends of touching boards meet this board."""
    lines = []
    for other in touching:
        lines += _ends_on(sheet, m, other)
        n = other.normal @ sheet.world_from_board[:3, :3]
        flat = float(np.hypot(n[0], n[1]))
        if flat < 0.2 or abs(n[:2] @ m) < 0.98 * flat:
            continue
        base = other.normal @ (other.world_from_board[:3, 3] - sheet.world_from_board[:3, 3])
        sign = np.sign(n[:2] @ m)
        for plane in (0.0, other.thickness.value):
            lines += [sign * (base + plane - n[2] * z) / flat for z in (0.0, sheet.thickness.value)]
    return lines


def _ends_on(sheet: Sheet, m: np.ndarray, other: Sheet) -> list[float]:
    """Between which two offsets another board's end lies on this one."""
    ring = np.asarray(other.region.exterior.coords)[:, :2]
    corners = np.concatenate([np.c_[ring, np.full(len(ring), z)] for z in (0.0, other.thickness.value)])
    x = sheet.to_board(other.to_world(corners))
    reach = sheet.thickness.value / 2
    across = x[(x[:, 2] > -reach) & (x[:, 2] < sheet.thickness.value + reach), :2] @ m
    return [float(across.min()), float(across.max())] if len(across) else []


def _crosses_all(region: Polygon, m: np.ndarray, offset: float, reach: float) -> bool:
    """Whether lines a little before and after the seam run through one stretch of wood: not past a hole or a bay. The
    seam itself may be an open slit.
    """
    tangent = np.array([-m[1], m[0]])
    for shift in (-reach, reach):
        middle = (offset + shift) * m
        chord = region.intersection(LineString([middle - 1e5 * tangent, middle + 1e5 * tangent]))
        if chord.geom_type != "LineString" or chord.is_empty:
            return False
    return True


def split_sheet(sheet: Sheet, seams: list[SeamLine], points: np.ndarray) -> list[Sheet]:
    """The pieces of a board between its seams, each with its own cloud points ((N, 3) world, of the whole cloud)."""
    bounds = [-np.inf, *(s.offset for s in seams), np.inf]
    m = seams[0].m
    tangent = np.array([-m[1], m[0]])
    pieces = []
    for below, above in pairwise(bounds):
        low, high = np.clip([below, above], -1e5, 1e5)
        strip = Polygon([a * m + b * tangent for a, b in ((low, -1e5), (high, -1e5), (high, 1e5), (low, 1e5))])
        region = sheet.region.intersection(strip)
        region = max(getattr(region, "geoms", [region]), key=lambda p: p.area)
        own = [
            idx[_between(sheet, points[idx], m, low, high)] for idx in (sheet.top_idx, sheet.bottom_idx, sheet.cut_idx)
        ]
        pieces.append(replace(sheet, region=region, top_idx=own[0], bottom_idx=own[1], cut_idx=own[2]))
    return pieces


def _between(sheet: Sheet, points: np.ndarray, m: np.ndarray, low: float, high: float) -> np.ndarray:
    across = sheet.to_board(points)[:, :2] @ m
    return (across > low) & (across < high)


def seam_segments(seam: SeamLine, contact: int | None) -> tuple[ConstraintSegment, ConstraintSegment]:
    """Constraint segments for the piece before the seam and the one after it; the wood lies on the left of each.

    contact: number of the contact that they make; None where the boards lie side by side with a gap.
    """
    low, high = sorted((seam.start, seam.end), key=lambda p: p @ [-seam.m[1], seam.m[0]])
    aside = 0.5 * seam.gap * seam.m
    origin, error = ("photo", 0.25 * seam.gap) if contact is None else ("contact", 0.2)
    before = ConstraintSegment(
        start=low - aside, end=high - aside, origin=origin, standard_error=max(error, 0.2), contact=contact
    )
    return before, replace(before, start=high + aside, end=low + aside)


def seam_contact(before: Sheet, after: Sheet, seam: SeamLine) -> Contact:
    """The contact of type 4, cut on cut, between two pieces of one board."""
    t = before.thickness.value
    corners = [(*seam.start, 0.0), (*seam.end, 0.0), (*seam.end, t), (*seam.start, t)]
    places = before.to_world(np.array(corners))
    normal = before.world_from_board[:3, :2] @ seam.m
    return Contact(
        type=4, a=before.name, b=after.name, face_a="edge", face_b="edge",
        point=_point(places[0]), normal=_point(normal),
        interface=(tuple(_point(p) for p in places),), area=float(np.linalg.norm(seam.end - seam.start) * t), angle=0.0,
        evidence=ContactEvidence(seam_score=seam.strength, views=seam.views, decided_by="seam"),
    )


def _point(v: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(c) for c in v)
