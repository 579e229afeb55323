"""All contacts of an assembly: who ends on whom (paper, Connections and Disambiguating Corners; types 1, 2 and mitres).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kerfwright.assemble.decided import Decided, swapped
from kerfwright.assemble.flush_ends import flush_end
from kerfwright.assemble.mitres import EndFace, corner_lines, look_for_mitre, mitred, overlapping
from kerfwright.assemble.notches import is_notch
from kerfwright.assemble.options import AssembleOptions
from kerfwright.assemble.severing import without_severing
from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.joints import Joint, end_on, face_plane
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.reaching import LEAST_VIEWS, Scene, end_is_seen, ends_elsewhere, goes_on_unseen, shown_end
from kerfwright.identify.seams import Seam, look_for_seam
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles
from kerfwright.model import Contact, ContactEvidence, Origin

__all__ = ["find_contacts", "to_contact"]

LEAST_SEAM = 1.35  # a visible seam is at least this much stronger than the face beside it
LEAST_SHARE = 0.25  # of the length of a corner's other joint; a shorter one is a ragged outline
CLEAR_MARGIN = 1.25  # ratio of seam scores from which a corner counts as decided by the photographs
OPEN_SEAM = 1.8  # below this the seam of a butt joint does not rule out that a corner is mitred as its twins are
LEAST_MITRE = 1.7  # strength of a mitre's seam on an end face; butt joints show up to 1.6 there
MITRE_MARGIN = 1.3  # ... over the seams of butt joints
MITRE_VIEWS = 6  # an end face is small: fewer photographs of it say nothing


def find_contacts(
    sheets: tuple[Sheet, ...], cloud: Cloud, photos: Photos, free: FreeSpace, options: AssembleOptions,
    earlier: Sequence[Decided] = (), ends: Sequence[tuple[str, str]] = (),
) -> list[Decided]:
    """Every pair of boards that meets cut on sheet, with corners decided.

    earlier : what was found before the regions were run on; its corners stay as they are, for they were decided when
        less was known that could hide their seams, and a board that was run on to another still ends there.
    ends : of boards that identification ran on to others, by name: (a, b) for b to a.
    """
    place = {sheet.name: k for k, sheet in enumerate(sheets)}
    known = {(d.joint.a, d.joint.b) for d in earlier if d.kind == 1}
    known |= {(place[a], place[b]) for a, b in ends if a in place and b in place}
    settled = {frozenset((d.joint.a, d.joint.b)): d for d in earlier if d.kind in (2, 4)}
    scene = Scene(sheets, cloud, photos, Obstacles(sheets, options.outline_error * cloud.diameter), free, options)
    near, far, doubtful = _all_joints(scene, known)
    found: list[Decided] = []
    for a in range(len(sheets)):
        for b in range(a + 1, len(sheets)):
            keys = ((a, b), (b, a))
            either = [near.get(key) or goes_on_unseen(scene, far.get(key)) for key in keys]
            either = [one or (doubtful.get(key) if other and key[::-1] not in near else None)
                      for key, one, other in zip(keys, either, either[::-1], strict=True)]
            if all(either) and any(key in near or key in doubtful for key in keys):
                found.append(_corner(scene, *either, settled.get(frozenset((a, b)))))
            elif any(either):
                found.append(Decided(either[0] or either[1], 1, None, ContactEvidence()))
            else:
                seen = [d for key in keys if (d := _confirmed(scene, far.get(key)))]
                found.extend(sorted(seen, key=lambda d: -d.evidence.seam_score)[:1])
    found = without_severing(sheets, _like_their_twins(scene, found))
    return [_with_flush_end(scene, d) for d in found]


def _with_flush_end(scene: Scene, d: Decided) -> Decided:
    """A contact with what the cloud shows of a slanted end beside it; at corners the end is flush anyway."""
    if d.kind != 1:
        return d
    return replace(d, flush=flush_end(scene.sheets, d.joint, _outer_face(scene, d.joint), scene.cloud))


_Joints = dict[tuple[int, int], Joint]


def _all_joints(scene: Scene, known: set[tuple[int, int]]) -> tuple[_Joints, _Joints, _Joints]:
    """Joints by (a, b): near ones, those further apart, and those where a's wood is not seen but may be. Those `known`
    are not asked for a seam again.
    """
    near, far, doubtful = {}, {}, {}
    pairs = [(a, b) for a in range(len(scene.sheets)) for b in range(len(scene.sheets)) if a != b]
    for a, b in pairs:
        joint = _told(scene, end_on(scene.sheets, a, b, scene.search(scene.options.outline_error)))
        if joint is None:
            maybe = _told(scene, end_on(scene.sheets, a, b, scene.search(scene.options.unseen_reach)))
            if maybe is not None and maybe.gap <= scene.mm(scene.options.reach):
                doubtful[a, b] = maybe
        elif joint.gap > scene.mm(scene.options.reach):
            far[a, b] = joint
        else:
            near[a, b] = joint
    near = {
        key: j for key, j in near.items()
        if key in known or _is_contact(scene, j, near.get(key[::-1]) or far.get(key[::-1]))
    }
    return near, far, doubtful


def _told(scene: Scene, joint: Joint | None) -> Joint | None:
    """The joint, unless it is one on a face of which nobody knows where it is, by a board that ends on a third one."""
    if joint is None or joint.face_a == "top" or scene.sheets[joint.a].thickness_seen:
        return joint
    return None if ends_elsewhere(scene, joint) else joint


def _is_contact(scene: Scene, joint: Joint, reverse: Joint | None) -> bool:
    """A near joint counts when it is long enough and, where photographs show its line, they show an edge there.

    A board whose outline covers the other's thickness stops there only if its outer face shows a seam, or the other may
    stop instead.
    """
    if joint.length < scene.mm(scene.options.reach) or end_is_seen(scene, joint):
        return False
    overlapping = joint.gap < -0.5 * scene.sheets[joint.a].thickness.value
    if overlapping and reverse is not None:
        return True
    faces = [_outer_face(scene, joint)] if overlapping else ["top", "bottom"]
    shown = [s for s in (_seam(scene, joint, face) for face in faces) if s.views >= LEAST_VIEWS]
    return not shown or max(s.score for s in shown) > LEAST_SEAM


def _seam(scene: Scene, joint: Joint, face: str) -> Seam:
    return look_for_seam(scene.sheets, joint, face, scene.photos, scene.obstacles, scene.mm(1 / 300))


def _confirmed(scene: Scene, joint: Joint | None) -> Decided | None:
    """A contact across a far joint that the photographs confirm."""
    end = shown_end(scene, joint)
    if joint is None or end is None:
        return None
    return Decided(joint, 1, None, ContactEvidence(seam_score=end.score, views=end.views, decided_by="seam"))


def _corner(scene: Scene, first: Joint, second: Joint, before: Decided | None) -> Decided:
    """Which of two boards stops: the one whose joint is far longer, or else whose outer face shows the seam."""
    if before is not None:
        joints = (first, second) if before.joint.b == first.b else (second, first)
        joints = mitred(scene.sheets, *joints) if before.kind == 4 else joints
        return replace(before, joint=joints[0], other=joints[1])
    if min(first.length, second.length) < LEAST_SHARE * max(first.length, second.length):
        joints = (first, second) if first.length > second.length else (second, first)
        return Decided(joints[0], 2, joints[1], ContactEvidence())
    seams = [_seam(scene, j, _outer_face(scene, j)) for j in (first, second)]
    notches = [is_notch(scene.sheets, j, scene.mm(scene.options.min_contact) / 4) for j in (first, second)]
    if notches[0] != notches[1]:
        return _without_notch(scene, (first, second), seams, notches.index(False))
    chosen = 0 if seams[0].score >= seams[1].score else 1
    margin = seams[chosen].score / max(seams[1 - chosen].score, 1e-6)
    evidence = ContactEvidence(
        seam_score=seams[chosen].score, seam_score_other=seams[1 - chosen].score, views=seams[chosen].views,
        decided_by="seam" if margin >= CLEAR_MARGIN and seams[chosen].score >= LEAST_SEAM else "default",
    )
    joints = (first, second)
    corner = Decided(joints[chosen], 2, joints[1 - chosen], evidence, _end_face(scene, first, second, seams))
    return _mitre(scene, corner, "seam") if seams[chosen].score < LEAST_SEAM and _shows_mitre(corner) else corner


def _without_notch(scene: Scene, joints: tuple[Joint, Joint], seams: list[Seam], chosen: int) -> Decided:
    """The corner at which only one board can end without a notch in the other; none at all where the other seems to end
    beside it only by a face that nobody saw.
    """
    joint, other = joints[chosen], joints[1 - chosen]
    if other.face_a == "top" and not scene.sheets[other.a].thickness_seen:
        return Decided(joint, 1, None, ContactEvidence())
    evidence = ContactEvidence(
        seam_score=seams[chosen].score, seam_score_other=seams[1 - chosen].score, views=seams[chosen].views,
    )
    return Decided(joint, 2, other, evidence)


def _end_face(scene: Scene, first: Joint, second: Joint, seams: list[Seam]) -> EndFace | None:
    """What the end faces show of a corner that may be a mitre: both boards reach its outer line, and both outer faces
    were seen without a strong seam of a butt joint.
    """
    may_be = all(seam.views >= LEAST_VIEWS and seam.score < OPEN_SEAM for seam in seams)
    if not may_be or not overlapping(scene.sheets, first, second):
        return None
    flush = scene.mm(scene.options.outline_error)
    return look_for_mitre(scene.sheets, first, second, scene.photos, scene.obstacles, scene.diameter, flush)


def _shows_mitre(corner: Decided) -> bool:
    face = corner.mitre
    if face is None or face.views < MITRE_VIEWS:
        return False
    return face.mitre >= LEAST_MITRE and face.mitre >= MITRE_MARGIN * face.butt


def _mitre(scene: Scene, corner: Decided, decided_by: str) -> Decided:
    """The corner as a mitre, with the score of its seam and the best one of a butt joint."""
    face = corner.mitre
    evidence = ContactEvidence(
        seam_score=face.mitre, seam_score_other=max(face.butt, corner.evidence.seam_score), views=face.views,
        decided_by=decided_by,
    )
    joint, other = mitred(scene.sheets, corner.joint, corner.other)
    return Decided(joint, 4, other, evidence, face)


def _outer_face(scene: Scene, joint: Joint) -> str:
    """The face of b on the outer side of the corner: the one away from a's bulk."""
    b = scene.sheets[joint.b]
    middle = b.to_board(scene.sheets[joint.a].to_world(_middle(scene.sheets[joint.a])))[0, 2]
    return "bottom" if middle > b.thickness.value / 2 else "top"


def _middle(sheet: Sheet) -> np.ndarray:
    centre = sheet.region.centroid
    return np.array([[centre.x, centre.y, sheet.thickness.value / 2]])


def _like_their_twins(scene: Scene, found: list[Decided]) -> list[Decided]:
    """Corners that the photographs leave open are decided as the corners between boards of the same sizes are; one that
    may be a mitre follows mitres before butt joints with faint seams.
    """
    butts = [d for d in found if d.kind == 1 or (d.kind == 2 and d.evidence.decided_by == "seam")]
    mitres = [d for d in found if d.kind == 4]
    out = []
    for d in found:
        if d.kind == 2 and d.mitre is not None and _votes(scene, d, mitres) > _votes(
            scene, d, [c for c in butts if c.mitre is None]
        ):
            d = _mitre(scene, d, "default")
        elif d.kind == 2 and d.evidence.decided_by == "default":
            votes = [sum(_alike(scene, j, c.joint) for c in butts) for j in (d.joint, d.other)]
            if votes[0] < votes[1]:
                d = replace(d, joint=d.other, other=d.joint, evidence=swapped(d.evidence))
        out.append(d)
    return out


def _votes(scene: Scene, corner: Decided, others: list[Decided]) -> int:
    """How many contacts there are between boards of the same sizes, whichever ends on which."""
    return sum(_alike_either_way(scene, corner, other) for other in others)


def _alike_either_way(scene: Scene, one: Decided, other: Decided) -> bool:
    return any(_alike(scene, joint, other.joint) for joint in (one.joint, one.other))


def _alike(scene: Scene, one: Joint, other: Joint) -> int:
    """1 when the boards of two joints have the same sizes in the same roles."""
    sheets = scene.sheets
    return int(_same_size(sheets[one.a], sheets[other.a]) and _same_size(sheets[one.b], sheets[other.b]))


def _same_size(a: Sheet, b: Sheet) -> bool:
    sides = np.array([_sides(s) for s in (a, b)])
    alike = np.abs(sides[0] - sides[1]) < 0.2 * sides.max(axis=0)
    return bool(alike.all()) and abs(a.thickness.value - b.thickness.value) < 0.15 * b.thickness.value


def _sides(sheet: Sheet) -> np.ndarray:
    """Length and width of the smallest rectangle about the region, mm."""
    ring = np.asarray(sheet.region.minimum_rotated_rectangle.exterior.coords)
    return np.sort(np.linalg.norm(np.diff(ring[:3], axis=0), axis=1))


def to_contact(decided: Decided, sheets: tuple[Sheet, ...]) -> Contact:
    """The model's contact with its interface as rectangles on the plane: each as wide as board b's cut face."""
    joint, is_mitre = decided.joint, decided.kind == 4
    a, b = sheets[joint.a], sheets[joint.b]
    normal, offset = _mitre_plane(decided, sheets) if is_mitre else face_plane(a, joint.face_a)
    polygons = tuple(_rectangle(joint, b, interval) for interval in joint.intervals)
    angle = float(np.degrees(np.arccos(min(abs(a.normal @ b.normal), 1.0))))
    return Contact(
        type=decided.kind, a=a.name, b=b.name, face_a="edge" if is_mitre else joint.face_a, face_b="edge",
        point=_point(normal * offset), normal=_point(normal), interface=polygons,
        area=joint.length * b.thickness.value / joint.trace.sine, angle=angle,
        bevelled=abs(joint.trace.slope) > 1e-3, evidence=decided.evidence,
        origin=Origin.INFERRED if decided.evidence.decided_by == "inferred" else Origin.MEASURED,
    )


def _mitre_plane(decided: Decided, sheets: tuple[Sheet, ...]) -> tuple[np.ndarray, float]:
    lines = corner_lines(sheets, decided.joint, decided.other)
    return lines.normal, float(lines.normal @ lines.inner)


def _rectangle(joint: Joint, b: Sheet, interval: tuple[float, float]) -> tuple:
    corners = []
    for along, z in (
        (interval[0], 0.0), (interval[1], 0.0), (interval[1], b.thickness.value), (interval[0], b.thickness.value)
    ):
        shift = joint.trace.slope * (z - joint.trace.depth)
        xy = joint.trace.place(np.array([shift]), np.array([along]))[0]
        corners.append(_point(b.to_world(np.array([[*xy, z]]))[0]))
    return tuple(corners)


def _point(v: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(c) for c in v)
