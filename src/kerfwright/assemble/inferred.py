"""Boards that nothing holds, joined to the others by the least wood that nobody saw.

Such a board floats, or its support is hidden. Of all ways to hold it that nothing contradicts, the one that takes the
least wood is taken: its end run on to a sheet of another board, or the other way round, or a face that nobody saw put
on another board's. What was added is marked as inferred; where every way is contradicted, the board stays as it is,
and the checker tells of it (K112).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kerfwright.assemble.decided import Decided
from kerfwright.identify.coplanar import PARALLEL, moved_region
from kerfwright.identify.joints import Joint, Search, end_on, face_plane
from kerfwright.identify.laid import Pair, facing_pairs, is_seen_through, put_on_plane, share_seen
from kerfwright.identify.reaching import Scene, may_reach
from kerfwright.identify.types import INFERRED_FACES, Sheet
from kerfwright.model import Contact, ContactEvidence, Finding, Origin

__all__ = ["joined_up", "marked", "told"]

FURTHEST = 1 / 4  # of D, that a board may be run on: twice as far as boards that others hold
FACING = 1 / 20  # of D, between two faces of which one was not seen
UNSEEN = 0.05  # share of a hidden face that may show points: stray ones
BESIDE = 1 / 100  # of D, between boards side by side in one plane, which a seam will join
SAME_LINE = 0.02  # sine, between an inferred end and a contact's line
SAME_PLACE = 1 / 60  # of D


@dataclass(frozen=True, eq=False)
class _Way:
    """How two groups of boards could be joined: by an end, or by a hidden face (board, face, other board, its face)."""

    wood: float  # mm3 that it takes
    joint: Joint | None = None
    face: tuple[int, str, int, str] | None = None


def joined_up(scene: Scene, decided: Sequence[Decided]) -> tuple[tuple[Sheet, ...], list[Decided]]:
    """The sheets and contacts of a scene, with every group of boards that floats joined to the others if it may be."""
    added: list[Decided] = []
    while True:
        groups = _groups(scene, [*decided, *added])
        ways = _ways(scene, groups) if len(groups) > 1 else []
        if not ways:
            return scene.sheets, [*decided, *added]
        best = min(ways, key=lambda way: way.wood)
        sheets = list(scene.sheets)
        if best.joint is not None:
            k, trace = best.joint.b, best.joint.trace
            added.append(Decided(best.joint, 1, None, ContactEvidence(decided_by="inferred")))
            line = (float(trace.m[0]), float(trace.m[1]), float(trace.offset))
            sheets[k] = replace(sheets[k], inferred=(*sheets[k].inferred, line))
        else:
            k, face, other, beyond = best.face
            normal, offset = face_plane(sheets[other], beyond)
            moved = put_on_plane(sheets[k], face, normal, offset)
            quantity = moved.thickness.model_copy(update={"origin": Origin.INFERRED})
            sheets[k] = replace(moved, thickness=quantity, inferred=(*moved.inferred, INFERRED_FACES[face]))
        scene = replace(scene, sheets=tuple(sheets))


def _groups(scene: Scene, decided: Sequence[Decided]) -> list[set[int]]:
    """Boards that hold together: by contacts, laid on one another, or side by side, edge to edge."""
    sheets, near = scene.sheets, BESIDE * scene.diameter
    pairs = [{d.joint.a, d.joint.b} for d in decided]
    shortest = scene.mm(scene.options.min_contact)
    pairs += [{p.a, p.b} for p in facing_pairs(sheets, shortest) if p.gap < near]
    pairs += [{a, b} for a in range(len(sheets)) for b in range(a) if _side_by_side(sheets[a], sheets[b], near)]
    groups = [{k} for k in range(len(sheets))]
    for pair in pairs:
        together = [g for g in groups if g & pair]
        groups = [g for g in groups if not g & pair] + [set().union(*together)]
    return groups


def _side_by_side(a: Sheet, b: Sheet, near: float) -> bool:
    """Whether the edges of two parallel boards come near each other: seams and abutting edges join them later."""
    if abs(a.normal @ b.normal) < PARALLEL:
        return False
    middle = b.region.representative_point()
    faces = b.to_world(np.array([[middle.x, middle.y, 0.0], [middle.x, middle.y, b.thickness.value]]))
    low, high = sorted(a.to_board(faces)[:, 2])
    beside = min(high, a.thickness.value) > max(low, 0.0)
    return bool(beside and moved_region(b, a).distance(a.region) < near)


def _ways(scene: Scene, groups: list[set[int]]) -> list[_Way]:
    """All ways to join two groups that nothing contradicts."""
    group = {k: n for n, own in enumerate(groups) for k in own}
    ways = []
    for a in range(len(scene.sheets)):
        for b in range(len(scene.sheets)):
            if group[a] != group[b]:
                ways += _by_end(scene, a, b)
    shortest = scene.mm(scene.options.min_contact)
    for pair in facing_pairs(scene.sheets, shortest, scene.mm(FACING)):
        if group[pair.a] != group[pair.b] and not is_seen_through(pair, scene.sheets, scene.free):
            ways += _by_face(scene, pair)
    return ways


def _by_end(scene: Scene, a: int, b: int) -> list[_Way]:
    """Board b run on to a sheet of a."""
    o = scene.options
    search = Search(
        scene.mm(FURTHEST), scene.mm(o.outline_error), scene.mm(o.outline_error), scene.mm(1 / 200),
        scene.mm(o.min_contact), scene.mm(o.ragged),
    )
    joint = end_on(scene.sheets, a, b, search)
    if joint is None or not may_reach(scene, joint):
        return []
    return [_Way(max(joint.gap, 0.0) * joint.length * scene.sheets[b].thickness.value, joint=joint)]


def _by_face(scene: Scene, pair: Pair) -> list[_Way]:
    """A face that nobody saw put on the one that it looks at: of boards whose thickness is a guess."""
    ends = ((pair.a, pair.face_a), (pair.b, pair.face_b))
    ways = []
    for (k, face), (other, beyond) in (ends, ends[::-1]):
        sheet = scene.sheets[k]
        seen = share_seen(sheet, face, pair, scene.sheets[pair.a], scene.cloud, scene.options)
        if not sheet.thickness_seen and seen < UNSEEN:
            ways.append(_Way(abs(pair.gap) * pair.overlap.area, face=(k, face, other, beyond)))
    return ways


def marked(decided: Sequence[Decided], sheets: Sequence[Sheet], diameter: float) -> list[Decided]:
    """The contacts, those marked whose board ends there only because an earlier assembly ran it on: the outline that
    came of it shows nothing.
    """
    out = []
    for d in decided:
        trace = d.joint.trace
        again = any(
            abs(mx * trace.m[1] - my * trace.m[0]) < SAME_LINE and mx * trace.m[0] + my * trace.m[1] > 0
            and abs(offset - trace.offset) < SAME_PLACE * diameter
            for mx, my, offset in sheets[d.joint.b].inferred
        )
        evidence = d.evidence.model_copy(update={"decided_by": "inferred"}) if again else d.evidence
        out.append(replace(d, evidence=evidence))
    return out


def told(contacts: Sequence[Contact]) -> tuple[Finding, ...]:
    """A finding for each contact that nothing showed."""
    return tuple(
        Finding(
            code="K012", severity="warning", boards=(c.a, c.b),
            message=f"{c.a}, {c.b}: nothing else would hold these boards, and nobody saw that they meet; the smallest "
            "extension that joins them is inferred",
            remedy="compare this contact with the object, or photograph it from where it shows",
        )
        for c in contacts if c.origin is Origin.INFERRED
    )
