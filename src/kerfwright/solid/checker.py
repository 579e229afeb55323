"""Whether the model can be built: numbered findings, errors (K1xx), warnings (K2xx) and notes (K3xx) apart.

An error forbids an export. A finding names boards by name and says what to do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np

from kerfwright.errors import ModelError, OptionError
from kerfwright.model import Board, Contact, Finding, Model
from kerfwright.model.faults import Fault, faults
from kerfwright.model.frames import model_from_board
from kerfwright.solid.build import board_solid, location, solid_is_valid
from kerfwright.solid.codes import finding, severity
from kerfwright.solid.contacts import Meeting, meet, touching
from kerfwright.solid.faces import Shape, shape_of
from kerfwright.solid.interference import common_volume, near_pairs, penetration
from kerfwright.solid.workshop import bevel_angle, fits_rectangle, inside_radius, narrowest_web

__all__ = ["CheckOptions", "check"]

SAW_SCALE = 0.05  # degrees; finer than the scale of a saw's tilt
LEAST_SIZE = 100.0  # mm of the whole; what a smaller one is asked for shrinks with it, for its scale must be wrong
AREA_AGREES = 0.25  # of the larger area, as contacts are commonly compared


@dataclass(frozen=True)
class CheckOptions:
    """What the checker asks for; lengths in mm, for a whole of LEAST_SIZE at least.

    Raises
    ------
    OptionError
        If a value is not a positive number.
    """

    snug: float = 0.01  # gap or overlap of a contact above this is a warning: no saw holds less
    reach: float = 0.5  # a contact further apart than this does not touch: an error
    tilt: float = 1.0  # degrees by which the two faces of a contact may turn from each other
    contact_area: float = 1.0  # mm2, below which a contact does not touch
    shared_volume: float = 1.0  # mm3 that two boards may share; less is rounding of the boolean
    ground: float = 1.0  # height up to which a board stands on the floor
    tool_diameter: float = 6.0  # of the router bit that cuts inside corners
    web: float = 6.0  # narrowest web that stands the cutting
    bevel: float = 45.0  # degrees that the saw tilts either way
    sheet_length: float = 2440.0
    sheet_width: float = 1220.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value) or value <= 0:
                raise OptionError(f"check option {field.name}: {value!r}: give a number above 0")


def check(model: Model, options: CheckOptions | None = None) -> tuple[Finding, ...]:
    """Every finding, errors first, then by number and by the model's order.

    Parameters
    ----------
    model : the assembly; it may contradict itself, that is what this finds out
    options : what to ask for
    """
    options = options or CheckOptions()
    findings = [_fault_finding(fault) for fault in faults(model)]
    broken = {name for f in findings for name in f.boards if f.code not in ("K101", "K102", "K108")}
    sound = [b for b in model.boards if b.name not in broken]
    shapes: list[Shape] = []
    for board in sound:
        findings += _solid_findings(board, shapes)
    findings += [f for board in sound for f in _workshop_findings(board, options)]
    size = _size(shapes)
    if 0 < size < LEAST_SIZE:
        findings.append(finding("K211", value=size, size=LEAST_SIZE))
        options = _shrunk(options, size / LEAST_SIZE)
    findings += _assembly_findings(model, shapes, options)
    return tuple(sorted(findings, key=lambda f: f.code))


def _size(shapes: list[Shape]) -> float:
    """mm of the longest side of the box about all solids; 0 when there are none."""
    if not shapes:
        return 0.0
    return float(np.ptp(np.concatenate([shape.points for shape in shapes]), axis=0).max())


def _shrunk(options: CheckOptions, factor: float) -> CheckOptions:
    """What is asked of how boards meet, for an object that is so many times as large."""
    powers = {"snug": 1, "reach": 1, "ground": 1, "contact_area": 2, "shared_volume": 3}
    return replace(options, **{name: getattr(options, name) * factor**k for name, k in powers.items()})


def _fault_finding(fault: Fault) -> Finding:
    return Finding(
        code=fault.code,
        severity=severity(fault.code),
        message=f"{fault.field}: {fault.found}",
        remedy=fault.remedy,
        boards=fault.boards,
    )


def _solid_findings(board: Board, shapes: list[Shape]) -> Iterator[Finding]:
    """Build the board into `shapes`; what hinders that."""
    try:
        solid = board_solid(board)
    except ModelError as error:
        yield finding("K109", board.name, why=error)
        return
    # a simple path makes a simple prism; only bevels could make its faces cross
    if not solid_is_valid(solid, thorough=bool(board.bevels)):
        yield finding("K109", board.name, why=f"{board.name}: OCCT calls the solid invalid")
    shapes.append(shape_of(board.name, solid.moved(location(model_from_board(board)))))


def _workshop_findings(board: Board, options: CheckOptions) -> Iterator[Finding]:
    """What one board asks of tools and stock."""
    radius, (x, y) = inside_radius(board)
    tool = options.tool_diameter / 2
    if radius < tool - options.snug:
        yield finding("K203", board.name, value=radius, x=x, y=y, tool=tool)
    if (web := narrowest_web(board, options.web)) is not None:
        yield finding("K204", board.name, value=web, web=options.web)
    if not fits_rectangle(board, options.sheet_length, options.sheet_width):
        yield finding("K206", board.name, length=options.sheet_length, width=options.sheet_width)
    for index, bevel in enumerate(board.bevels):
        angle = bevel_angle(bevel)
        if abs(angle) > options.bevel + SAW_SCALE:
            yield finding("K205", board.name, value=angle, index=index, limit=options.bevel)
        if abs(angle - bevel.angle.value) > SAW_SCALE:
            yield finding("K209", board.name, value=angle, index=index, said=bevel.angle.value)


def _assembly_findings(model: Model, shapes: list[Shape], options: CheckOptions) -> Iterator[Finding]:
    """What the boards do to each other."""
    by_name = {shape.name: shape for shape in shapes}
    contacts = [(k, c) for k, c in enumerate(model.contacts) if {c.a, c.b} <= set(by_name) and c.a != c.b]
    meetings = [_meeting(by_name, contact, options) for _, contact in contacts]
    yield from _interference_findings(shapes, options)
    for (index, contact), meeting in zip(contacts, meetings, strict=True):
        yield from _contact_findings(index, contact, meeting, options)
    joined = {frozenset((c.a, c.b)) for (_, c), m in zip(contacts, meetings, strict=True) if m}
    yield from _unlisted_findings(model, shapes, joined, options)
    yield from _floating_findings([s.name for s in shapes], joined)
    yield from _ground_findings(shapes, options)


def _meeting(shapes: dict[str, Shape], contact: Contact, options: CheckOptions) -> Meeting | None:
    normal = np.array(contact.normal)
    length = np.linalg.norm(normal)
    if length == 0:
        return None
    found = meet(shapes[contact.a], shapes[contact.b], normal / length, options.reach, np.radians(options.tilt))
    return found if found and found.area >= options.contact_area else None


def _interference_findings(shapes: list[Shape], options: CheckOptions) -> Iterator[Finding]:
    for a, b in near_pairs(shapes, 0.0):
        depth = penetration(a, b)
        if depth <= options.snug:  # what touches snugly is no interference; the contact's own findings tell the overlap
            continue
        volume = common_volume(a, b)
        if volume > options.shared_volume:
            yield finding("K110", a.name, b.name, value=volume, volume=volume, depth=depth)


def _contact_findings(
    index: int, contact: Contact, meeting: Meeting | None, options: CheckOptions
) -> Iterator[Finding]:
    pair = (contact.a, contact.b)
    if meeting is None:
        yield finding("K111", *pair, index=index, reach=options.reach)
        return
    if meeting.gap > options.snug:
        yield finding("K201", *pair, value=meeting.gap, index=index)
    if meeting.overlap > options.snug:
        yield finding("K202", *pair, value=meeting.overlap, index=index)
    if abs(meeting.area - contact.area) > AREA_AGREES * max(meeting.area, contact.area):
        yield finding("K210", *pair, value=meeting.area, index=index, said=contact.area)


def _unlisted_findings(
    model: Model, shapes: list[Shape], joined: set[frozenset[str]], options: CheckOptions
) -> Iterator[Finding]:
    """Pairs that touch although no contact says so; they count as joined from here on."""
    listed = {frozenset((c.a, c.b)) for c in model.contacts}
    for a, b in near_pairs(shapes, options.snug):
        pair = frozenset((a.name, b.name))
        if pair in listed:
            continue
        meeting = touching(a, b, options.snug, np.radians(options.tilt), options.contact_area)
        if meeting:
            joined.add(pair)
            yield finding("K301", a.name, b.name, value=meeting.area)


def _floating_findings(names: list[str], joined: set[frozenset[str]]) -> Iterator[Finding]:
    """Boards that nothing holds to the largest group; of groups as large, to the one that comes first."""
    groups = [{name} for name in names]
    for pair in joined:
        together = [g for g in groups if g & pair]
        groups = [g for g in groups if not g & pair] + [set().union(*together)]
    main = max(groups, key=lambda g: (len(g), -min(map(names.index, g))), default=set())
    yield from (finding("K112", name) for name in names if name not in main)


def _ground_findings(shapes: list[Shape], options: CheckOptions) -> Iterator[Finding]:
    """Whether something stands on the floor, and the whole keeps upright on it."""
    if not shapes:
        return
    points = np.concatenate([shape.points for shape in shapes])
    low = points[points[:, 2] <= options.ground]
    if not len(low):
        yield finding("K207", value=float(points[:, 2].min()))
    elif not _stands(shapes, low):
        yield finding("K208")


def _stands(shapes: list[Shape], low: np.ndarray) -> bool:
    """Whether the centre of mass of solids of one density is above the hull of the points on the floor."""
    import shapely

    volumes = np.array([shape.solid.volume for shape in shapes])
    centres = np.array([tuple(shape.solid.center()) for shape in shapes])
    centre = volumes @ centres / volumes.sum()
    hull = shapely.convex_hull(shapely.multipoints(low[:, :2]))
    return bool(shapely.distance(hull, shapely.points(centre[:2])) <= 1e-6)
