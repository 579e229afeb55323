"""Boards side by side in parallel planes, flush or not, whose traced edges meet: an apron of 15 mm between legs of 22.

Nothing of a sheet plane makes such an end, and where the two masks meet each runs over the other by some millimetres.
The line is that of the board whose edge goes on beyond the contact; there the photographs show it against what is
behind.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.identify.coplanar import PARALLEL, moved_region
from kerfwright.identify.outlines import largest_piece
from kerfwright.identify.types import Sheet
from kerfwright.model import Contact, ContactEvidence

__all__ = ["with_abutting"]

LEVEL = 0.5  # of the thinner board's thickness, which the other lies beside
NEAR = 1 / 200  # of D, between two traced edges that may be in contact, and beyond a contact's ends
SHORTEST = 1 / 20  # of D, of a contact: rounded corners come near each other over less
WIDEST = 1 / 20  # of D, over which the two masks may share wood or miss it
OPEN = 1 / 300  # of D, mean width of what lies between two boards in contact: a gap is open all along
FREE = 1 / 20  # of D, of an edge beyond the contact that tells its line
SAMPLE = 1 / 5  # of NEAR, between places on an outline
ERROR = 0.2  # mm, of the line


@dataclass(frozen=True, eq=False)
class Meeting:
    """The line m.xy = offset between two parallel boards, in the first one's frame, which lies on its lesser side."""

    m: np.ndarray
    offset: float
    along: tuple[float, float]  # from where to where on the tangent, to which m is turned by a right angle
    heights: tuple[float, float]

    def place(self, along: float) -> np.ndarray:
        """(2,) at a distance along the line."""
        return self.offset * self.m + along * np.array([-self.m[1], self.m[0]])


def with_abutting(assembly: Assembly, diameter: float) -> Assembly:
    """The assembly with a contact, and a segment on either board, for every two parallel boards whose edges meet."""
    contacts, constraints = list(assembly.contacts), [list(c) for c in assembly.constraints]
    known = {frozenset((c.a, c.b)) for c in contacts}
    for i, j in combinations(range(len(assembly.sheets)), 2):
        a, b = assembly.sheets[i], assembly.sheets[j]
        meeting = None if frozenset((a.name, b.name)) in known else meeting_of(a, b, diameter)
        if meeting is None:
            continue
        own = _segment(meeting, len(contacts))
        constraints[i].append(own)
        constraints[j].append(_turned(own, a, b))
        contacts.append(_contact(meeting, a, b))
    return replace(assembly, contacts=tuple(contacts), constraints=tuple(map(tuple, constraints)))


def meeting_of(a: Sheet, b: Sheet, diameter: float) -> Meeting | None:
    """Where b's edge meets a's; None where the boards are not parallel, or keep apart."""
    heights = _common_heights(a, b)
    if heights is None:
        return None
    ours, theirs, near = a.region, moved_region(b, a), NEAR * diameter
    zone = ours.buffer(near).intersection(theirs.buffer(near))
    if zone.area < near**2:
        return None
    box = np.asarray(largest_piece(zone).minimum_rotated_rectangle.exterior.coords)
    sides = box[1:3] - box[:2]
    length, width = sorted(np.linalg.norm(sides, axis=1))[::-1]
    if length < SHORTEST * diameter or width > WIDEST * diameter:
        return None
    m = _direction(ours, theirs, sides[np.argmax(np.linalg.norm(sides, axis=1))] / length)
    if (np.subtract(*(np.array(r.centroid.coords[0]) for r in (theirs, ours)))) @ m < 0:
        m = -m
    m, offset = _line(ours, theirs, m, box[:4].mean(axis=0), (length / 2 - near, width), diameter)
    along = box @ np.array([-m[1], m[0]])
    along = (float(along.min()) + near, float(along.max()) - near)
    meeting = Meeting(m, offset, along, heights)
    return meeting if _opening(meeting, ours, theirs, width) < OPEN * diameter else None


def _direction(ours: Polygon, theirs: Polygon, tangent: np.ndarray) -> np.ndarray:
    """(2,) across the line: the boards' own edge that is longest, of those along a tangent that masks have turned."""
    edges = []
    for region in (ours, theirs):
        box = np.asarray(region.minimum_rotated_rectangle.exterior.coords)
        edges += list(box[1:3] - box[:2])
    along = max(edges, key=lambda edge: (abs(edge @ tangent) > LEVEL * np.linalg.norm(edge), np.linalg.norm(edge)))
    return np.array([along[1], -along[0]]) / np.linalg.norm(along)


def _common_heights(a: Sheet, b: Sheet) -> tuple[float, float] | None:
    """Between which heights of a both boards lie; None where they are not parallel, or hardly beside each other."""
    if abs(a.normal @ b.normal) < PARALLEL:
        return None
    faces = b.to_world(np.array([[*b.region.representative_point().coords[0], z] for z in (0.0, b.thickness.value)]))
    low, high = np.sort(a.to_board(faces)[:, 2])
    low, high = max(low, 0.0), min(high, a.thickness.value)
    return (low, high) if high - low > LEVEL * min(a.thickness.value, b.thickness.value) else None


def _line(
    ours: Polygon, theirs: Polygon, m: np.ndarray, middle: np.ndarray, half: tuple[float, float], diameter: float
) -> tuple[np.ndarray, float]:
    """The line between two boards: the longest free edge's beyond the contact, or half way between both edges."""
    tangent, step = np.array([-m[1], m[0]]), SAMPLE * NEAR * diameter
    found, facing = [], []
    for region in (ours, theirs):
        xy = _places(region, step)
        along, across = (xy - middle) @ tangent, (xy - middle) @ m
        level = np.abs(across) < half[1]
        found.append(xy[level & (np.abs(along) > half[0] + 2 * NEAR * diameter)])
        facing.append(xy[level & (np.abs(along) < half[0])])
    free = max(found, key=len)
    if len(free) * step > FREE * diameter:
        return _fitted(free, m)
    levels = [float(np.median(xy @ m)) for xy in facing if len(xy)]
    return m, float(np.mean(levels)) if levels else float(middle @ m)


def _fitted(xy: np.ndarray, m: np.ndarray) -> tuple[np.ndarray, float]:
    """The line through places that lie roughly across m: the median slope of pairs (Theil and Sen)."""
    xy = xy[:: max(1, len(xy) // 100)]
    u, v = xy @ np.array([-m[1], m[0]]), xy @ m
    one, two = np.triu_indices(len(xy), 1)
    apart = np.abs(u[two] - u[one]) > np.ptp(u) / 3
    slope = float(np.median((v[two] - v[one])[apart] / (u[two] - u[one])[apart]))
    m = (m - slope * np.array([-m[1], m[0]])) / np.hypot(1, slope)
    return m, float(np.median(xy @ m))


def _places(region: Polygon, step: float) -> np.ndarray:
    """(N, 2) places on a region's outer outline."""
    ring = region.exterior
    return shapely.get_coordinates(shapely.line_interpolate_point(ring, np.arange(0, ring.length, step)))


def _opening(meeting: Meeting, ours: Polygon, theirs: Polygon, width: float) -> float:
    """Mean width, mm, of what neither board covers about the line."""
    low, high = meeting.along
    ends = np.array([meeting.place(low), meeting.place(high)])
    strip = Polygon([*(ends - width * meeting.m), *(ends + width * meeting.m)[::-1]])
    return float(strip.difference(ours).difference(theirs).area / (high - low))


def _segment(meeting: Meeting, contact: int) -> ConstraintSegment:
    """That of the first board: its wood lies on the left, on the lesser side of the line."""
    start, end = (meeting.place(along) for along in meeting.along)
    return ConstraintSegment(start=start, end=end, origin="contact", standard_error=ERROR, contact=contact)


def _turned(segment: ConstraintSegment, a: Sheet, b: Sheet) -> ConstraintSegment:
    """A segment of board a for the board b on its other side, in that one's frame."""
    flat = np.array([[*segment.end, 0.0], [*segment.start, 0.0]])
    start, end = b.to_board(a.to_world(flat))[:, :2]
    return replace(segment, start=start, end=end) if a.normal @ b.normal > 0 else replace(segment, start=end, end=start)


def _contact(meeting: Meeting, a: Sheet, b: Sheet) -> Contact:
    """The contact of type 4, cut on cut."""
    (low, high), (bottom, top) = meeting.along, meeting.heights
    places = [(*meeting.place(s), z) for s, z in ((low, bottom), (high, bottom), (high, top), (low, top))]
    corners = tuple(_point(p) for p in a.to_world(np.array(places)))
    return Contact(
        type=4, a=a.name, b=b.name, face_a="edge", face_b="edge", point=corners[0],
        normal=_point(a.world_from_board[:3, :2] @ meeting.m), interface=(corners,),
        area=float((high - low) * (top - bottom)), angle=0.0, evidence=ContactEvidence(),
    )


def _point(v: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(c) for c in v)
