"""Corners at which three boards meet: a cut may not take away the wood on which another board ends.

A diagonal that runs into the corner of two boards could end on either of them, or they on it, and the photographs show
little in there. But a side that was cut off along the diagonal would no longer reach the board that stands on it: where
one choice severs a square contact that is surer and the other does not, the other is right (paper, Disambiguating
Corners). Slanted contacts sever nothing here: the ends of such boards are pointed, and only half of them is there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kerfwright.assemble.decided import Decided, swapped
from kerfwright.identify.joints import Joint
from kerfwright.identify.types import Sheet

__all__ = ["severed_share", "severs", "without_severing"]

SQUARE = 0.02  # slope of a cut that counts as square
SEVERED = 0.3  # of another contact's interface; less is a rough outline
LESS = 0.5  # of that which the other choice may sever
HEIGHTS = (0.1, 0.3, 0.5, 0.7, 0.9)  # of a board's thickness
PLACES = 9  # along each stretch of an interface


def without_severing(sheets: Sequence[Sheet], found: Sequence[Decided]) -> list[Decided]:
    """The contacts, those corners turned round that would sever a contact that is surer than they are."""
    return [_turned(sheets, d, found) if d.kind == 2 and not _is_square(d.joint) else d for d in found]


def _is_square(joint: Joint) -> bool:
    return abs(joint.trace.slope) < SQUARE


def severs(sheets: Sequence[Sheet], joint: Joint, corner: Decided, found: Sequence[Decided]) -> bool:
    """Whether the cut of a slanted corner's `joint` takes away wood on which a board ends by a square contact."""
    square = [c.joint for c in found if c is not corner and c.kind != 4 and _is_square(c.joint)]
    return not _is_square(joint) and any(severed_share(sheets, joint, c) >= SEVERED for c in square)


def _turned(sheets: Sequence[Sheet], d: Decided, found: Sequence[Decided]) -> Decided:
    surer = [c.joint for c in found if c is not d and _is_surer(c, d)]
    here, there = (max((severed_share(sheets, joint, c) for c in surer), default=0.0) for joint in (d.joint, d.other))
    if here < SEVERED or there > LESS * here:
        return d
    evidence = swapped(d.evidence).model_copy(update={"decided_by": "geometry"})
    return replace(d, joint=d.other, other=d.joint, evidence=evidence)


def _is_surer(contact: Decided, corner: Decided) -> bool:
    """Square ends that only one board can have are certain; square corners decided by a seam are surer than slanted
    ones decided by default.
    """
    if contact.kind == 4 or not _is_square(contact.joint):
        return False
    return contact.kind == 1 or (contact.evidence.decided_by == "seam" and corner.evidence.decided_by != "seam")


def severed_share(sheets: Sequence[Sheet], joint: Joint, contact: Joint) -> float:
    """Share of a contact's interface, at the board that `joint` ends, that lies beyond the cut; 0 if it is elsewhere.
    """
    if joint.b not in (contact.a, contact.b) or {joint.a, joint.b} == {contact.a, contact.b}:
        return 0.0
    x = sheets[joint.b].to_board(_interface(sheets[contact.b], contact))
    inside, along = joint.trace.coordinates(x[:, :2])
    beyond = inside < joint.trace.slope * (x[:, 2] - joint.trace.depth)
    beside = np.zeros(len(x), bool)
    for low, high in joint.intervals:
        beside |= (along > low) & (along < high)
    return float((beyond & beside).mean())


def _interface(board: Sheet, contact: Joint) -> np.ndarray:
    """(N, 3) places spread over the cut face with which a board ends, world."""
    trace, places = contact.trace, []
    for low, high in contact.intervals:
        along = np.linspace(low, high, PLACES)
        for share in HEIGHTS:
            z = share * board.thickness.value
            shift = np.full(PLACES, trace.slope * (z - trace.depth))
            places.append(np.c_[trace.place(shift, along), np.full(PLACES, z)])
    return board.to_world(np.concatenate(places))
