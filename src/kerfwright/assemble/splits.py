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
from shapely.geometry import Polygon

from kerfwright.assemble.discontinuity import Discontinuity, discontinuity
from kerfwright.assemble.face_seams import (
    LEAST_VIEWS,
    NARROWEST,
    SEPARATE,
    Change,
    SeamLine,
    seams_of_face,
)
from kerfwright.assemble.texture import FaceStrips, face_strips
from kerfwright.assemble.tone import runs_along_grain, tone_steps
from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles
from kerfwright.model import Contact, ContactEvidence

__all__ = ["SeamLine", "SeamSearch", "find_seam_lines", "seam_contact", "seam_segments", "split_sheet"]

LEAST_STRENGTH = 7.0  # of a board's best seam, against the usual change across lines of its face
LENT_STRENGTH = 4.0  # of further ones: where two boards were glued, more may have been
CLEAR_TONE = 7.5  # of a board's best seam, where tone tells it: a stool's top, which is one board, had 5.5, and 30 made
# single boards (seeds from 1000) 3.4 at most
LEAST_TONE = 5.5  # of further ones: of the joints of 30 panels that were found none had less than 5.8
LINE_ALONG = 0.6  # share of a line's change in every third, where no geometry expects one: a year ring all along a made
# single board had .55
CERTAIN = 2.0  # times LEAST_STRENGTH; steep grain that passed for a seam in four views had up to 1.13
THROUGH = 1 / 150  # of D, between a seam's places on both faces
TOGETHER = 1 / 100  # of D, within which a line and a step of tone are the same joint's
MOST_ROUNDS = 4  # of a search for further seams once some are known
STRIP_SHARE = 1 / 3  # of the usual width of the boards; boards of a panel are of like widths
CUT = 2  # samples to either side of a known seam that belong to neither board


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
        if least:
            return _on_either_face(self, m, [s and discontinuity(s) for s in strips], least)
        seams = self._unexpected(m, strips)
        if not any(_is_clear(s) for s in seams):
            return []
        for _ in range(MOST_ROUNDS):
            more = self._unexpected(m, [s and _apart(s, seams) for s in strips])
            if not more:
                break
            seams += more
        return _wide_enough(self.sheet, m, seams)

    def _unexpected(self, m: np.ndarray, strips: list[FaceStrips | None]) -> list[SeamLine]:
        """Seams square to m that lines and steps of tone tell of, where no geometry expects one."""
        changes = [s and discontinuity(s) for s in strips]
        steps = [s and tone_steps(s, c and c.strength) for s, c in zip(strips, changes, strict=True)]
        along = [s is not None and runs_along_grain(s) for s in strips]
        tones = _on_either_face(self, m, [t if a else None for t, a in zip(steps, along, strict=True)], LEAST_TONE)
        tones = [t for t in tones if not any(c and _is_late_wood(t, c, self.diameter) for c in changes)]
        shaded = [t for t, a in zip(steps, along, strict=True) if t is not None and not a]
        lines = _on_either_face(self, m, changes, LENT_STRENGTH)
        unshaded = [s for s in lines if s.along > LINE_ALONG and not any(t.slopes(s.offset) for t in shaded)]
        return _merged(unshaded, [_on_line(t, lines, self.diameter) for t in tones], self.diameter)


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


def _apart(strips: FaceStrips, seams: list[SeamLine]) -> FaceStrips:
    """The strips as those of several boards: nothing is measured across a known seam, so that what is usual within a
    board is known better than from a face that holds seams.
    """
    colours = strips.colours.copy()
    for seam in seams:
        k = int(np.abs(strips.offsets - seam.offset).argmin())
        colours[:, max(0, k - CUT) : k + CUT + 1] = np.nan
    return replace(strips, colours=colours)


def _is_late_wood(seam: SeamLine, lines: Discontinuity, diameter: float) -> bool:
    """Whether a step of tone is the border of a band of late wood: its line is the clearer of the two, and wanders."""
    strength = np.where(np.abs(lines.offsets - seam.offset) < TOGETHER * diameter, np.nan_to_num(lines.strength), 0.0)
    k = int(strength.argmax())
    if strength[k] < max(LEAST_STRENGTH, seam.strength):
        return False
    return lines.along(k) < LINE_ALONG or not lines.unbroken(k)


def _on_either_face(
    search: SeamSearch, m: np.ndarray, faces: list[Change | None], least: float
) -> list[SeamLine]:
    """Seams of the face that shows the strongest one, all that the other face does not deny."""
    found = []
    for own, other in zip(faces, faces[::-1], strict=True):
        if own is None:
            continue
        seams = seams_of_face(search.sheet, m, own, search.touching, search.diameter, least)
        found.append([s for s in seams if not _is_denied(s, own, other, search.diameter)])
    return max(found, key=_strongest, default=[])


def _wide_enough(sheet: Sheet, m: np.ndarray, seams: list[SeamLine]) -> list[SeamLine]:
    """Seams without those, not certain by themselves, that leave a strip much narrower than the other boards."""
    across, seams = np.asarray(sheet.region.exterior.coords)[:, :2] @ m, sorted(seams, key=lambda s: s.offset)
    for seam in sorted(seams, key=lambda s: s.strength):
        widths = np.diff([across.min(), *(s.offset for s in seams), across.max()])
        k = seams.index(seam)
        if seam.strength < CERTAIN * LEAST_STRENGTH and min(widths[k : k + 2]) < STRIP_SHARE * np.median(widths):
            seams.remove(seam)
    return seams


def _on_line(seam: SeamLine, lines: list[SeamLine], diameter: float) -> SeamLine:
    """A step of tone, moved to the line that shows where it is, however faint: wood is of one tone up to its rim."""
    near = [line for line in lines if abs(line.offset - seam.offset) < TOGETHER * diameter]
    best = max(near, key=lambda line: line.strength, default=seam)
    return replace(seam, offset=best.offset, start=best.start, end=best.end, gap=best.gap)


def _merged(lines: list[SeamLine], tones: list[SeamLine], diameter: float) -> list[SeamLine]:
    """One seam a joint. A joint that shows as a line is known best by it, and is as clear as its tone makes it."""
    out, tones = [], list(tones)
    for seam in sorted(lines, key=lambda s: -s.strength):
        same = [t for t in tones if abs(t.offset - seam.offset) < TOGETHER * diameter]
        rivals = [t for t in tones if abs(t.offset - seam.offset) < SEPARATE * NARROWEST * diameter and t not in same]
        if any(t.strength > seam.strength for t in rivals):
            continue
        best = max([seam, *same], key=lambda s: s.strength)
        out.append(replace(seam, strength=best.strength, views=best.views, by_tone=best.by_tone))
        tones = [t for t in tones if t not in same and t not in rivals]
    return out + tones


def _is_denied(seam: SeamLine, own: Change, other: Change | None, diameter: float) -> bool:
    """Whether the other face, shown by as many views, changes no more than usual there: a seam goes right through."""
    if other is None or other.shown < own.shown:
        return False
    near = np.abs(other.offsets - seam.offset) < THROUGH * diameter
    told = np.isfinite(other.strength) & near
    alike = other.like(own, int(np.abs(own.offsets - seam.offset).argmin()))
    return bool(told.any() and not (other.strength[told & alike] > other.denied).any())


def _is_clear(seam: SeamLine) -> bool:
    """Whether a seam counts by itself: one that just passes must show in more than the least views."""
    least = CLEAR_TONE if seam.by_tone else LEAST_STRENGTH
    return seam.strength > least and (seam.views > LEAST_VIEWS or seam.strength > CERTAIN * LEAST_STRENGTH)


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
