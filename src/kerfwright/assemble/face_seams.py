"""The seams that one face of a board shows: places where its wood changes all along a straight line, in every stretch
of it and in the views, but for lines in which other boards meet it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely.geometry import LineString, Polygon

from kerfwright.assemble.discontinuity import Discontinuity
from kerfwright.assemble.tone import ToneSteps
from kerfwright.identify.types import Sheet

__all__ = ["LEAST_VIEWS", "NARROWEST", "SEPARATE", "Change", "SeamLine", "seams_of_face"]

LEAST_ALONG = 0.5  # share of the change that every third of the line must show
LEAST_VIEWS = 4
LEAST_AGREEMENT = 0.75  # mean share of the change that a single view shows
EASED = 1 / 40  # of D; eased edges of two boards lie no further apart
GAP_SHARE = 0.5  # of the way between two such lines: the rest is rounding; it cannot be told apart from above
PARTNER = 0.7  # strength of the weaker line of the two
NARROWEST = 1 / 16  # of D; narrower strips are shadows and edges more often than boards
SEPARATE = 2 / 3  # of it, within which one joint is looked for
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
    by_tone: bool = False  # known by a step of tone rather than by a line


def seams_of_face(
    sheet: Sheet, m: np.ndarray, change: Change, beside: list[Sheet], diameter: float, least: float
) -> list[SeamLine]:
    """Seams of one face square to m that are stronger than `least`; `beside` are the boards that touch it."""
    ring = np.asarray(sheet.region.exterior.coords)[:, :2]
    margin = NARROWEST * diameter
    known = _known_lines(sheet, m, beside)
    places = _seam_places(change, ring @ m, margin, least)
    seams = [_seam(change, *place, m, ring, diameter) for place in places]
    return [
        s for s in seams
        if all(abs(s.offset - other) > KNOWN * diameter for other in known)
        and _crosses_all(sheet.region, m, s.offset, margin / 4)
    ]


def _seam_places(change: Change, across: np.ndarray, margin: float, least: float) -> list[tuple[int, int]]:
    """Offsets whose change is strong and the strongest near by, each with one close to it at which it runs along the
    whole line and shows in the views.
    """
    strength = np.nan_to_num(change.strength)
    inner = (change.offsets > across.min() + margin) & (change.offsets < across.max() - margin)
    reach = round(margin / (change.offsets[1] - change.offsets[0]) * SEPARATE)
    peaks = [
        int(k) for k in np.flatnonzero(inner & (strength > least))
        if strength[k] == strength[max(0, k - reach) : k + reach + 1].max()
    ]
    return [(k, shown[0]) for k in peaks if (shown := [j for j in change.around(k) if _looks_so(change, j)])]


def _looks_so(change: Change, k: int) -> bool:
    return change.along(k) >= LEAST_ALONG and change.unbroken(k) and _agreed(change.views(k))


def _agreed(shares: list[float]) -> bool:
    """Whether the views show the change: several each for itself, and all on the mean. A glint shows in one."""
    return _showing(shares) >= LEAST_VIEWS and float(np.mean(shares)) >= LEAST_AGREEMENT


def _showing(shares: list[float]) -> int:
    return sum(share > LEAST_ALONG for share in shares)


def _seam(change: Change, k: int, shown: int, m: np.ndarray, ring: np.ndarray, diameter: float) -> SeamLine:
    """The seam at a peak k, as shown at the offset beside: its middle, ends on the outline's box, and the gap where
    eased edges show as two lines.
    """
    along, strength = ring @ np.array([-m[1], m[0]]), np.nan_to_num(change.strength)
    step = float(change.offsets[1] - change.offsets[0])
    apart = step * _partner(strength, k, EASED * diameter / step) if change.sharp else 0.0
    at = change.located(k) + apart / 2
    start, end = at * m + np.array([[along.min()], [along.max()]]) * np.array([-m[1], m[0]])
    told, gap = (float(strength[k]), _showing(change.views(shown))), abs(apart) * GAP_SHARE
    return SeamLine(m, at, start, end, *told, gap, change.along(shown), not change.sharp)


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
