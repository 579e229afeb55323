"""Corners of two upright boards, 100 mm high and 15 mm thick, seen from above: mitred, butted, square and skewed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import box

from clouds import box_cloud, cloud_only, pose, sheet
from kerfwright.assemble import AssembleOptions, contacts
from kerfwright.assemble.constraints import constraint_segments
from kerfwright.assemble.contacts import find_contacts, to_contact
from kerfwright.assemble.mitres import EndFace, corner_lines, look_for_mitre, mitred, overlapping
from kerfwright.assemble.snap import moved_with
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.joints import Search, end_on
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.seams import Seam
from painted import Painted, nothing_hides

T, D = 15.0, 300.0
SEARCH = Search(reach=10.0, slack=5.0, cover=5.0, step=1.5, shortest=3.0)


def corner(degrees: float = 90.0, thickness: float = T):
    """Two boards whose outer faces meet in the line x = y = 0: one along x, one turned by the angle from it."""
    turn = np.radians(degrees)
    along = np.array([np.cos(turn), np.sin(turn), 0])
    out_of_first, out_of_second = np.array([0, -1.0, 0]), np.array([-np.sin(turn), np.cos(turn), 0])
    first = sheet("first", pose(-T * out_of_first, (1, 0, 0), (0, 0, 1)), T, (0, 0, 200, 100))
    frame = pose((0, 0, 0), along, (0, 0, 1))
    if frame[:3, 2] @ out_of_second < 0:
        second = sheet("second", frame, thickness, (0, 0, 200, 100))
    else:
        frame[:3, 3] = -thickness * out_of_second
        second = sheet("second", frame, thickness, (0, 0, 200, 100))
    assert first.normal == pytest.approx(out_of_first)
    return first, second


def joints(sheets):
    return end_on(sheets, 0, 1, SEARCH), end_on(sheets, 1, 0, SEARCH)


@pytest.mark.parametrize("degrees", [90.0, 80.0, 100.0])
def test_boards_of_one_thickness_meet_in_the_plane_that_halves_their_angle(degrees):
    sheets = corner(degrees)
    in_second, in_first = mitred(sheets, *joints(sheets))
    for joint in (in_second, in_first):
        slant = np.degrees(np.arctan2(joint.trace.normal[2], np.hypot(*joint.trace.normal[:2])))
        assert abs(slant) == pytest.approx(90 - degrees / 2)
        outermost = joint.trace.place(np.zeros(2), np.array([0.0, 50.0]))
        world = sheets[joint.b].to_world(np.c_[outermost, np.full(2, joint.trace.depth)])
        assert world[:, :2] == pytest.approx(np.zeros((2, 2)), abs=1e-9)


def test_a_mitre_of_two_thicknesses_runs_through_both_corners():
    sheets = corner(thickness=20.0)
    lines = corner_lines(sheets, *joints(sheets))
    assert lines.outer[:2] == pytest.approx([0, 0], abs=1e-9)
    assert lines.inner[:2] == pytest.approx([20, 15])
    assert lines.normal @ lines.outer == pytest.approx(lines.normal @ lines.inner)
    assert lines.normal @ lines.into_b > 0 > lines.normal @ lines.into_a


def test_gaps_that_one_ragged_outline_leaves_are_closed():
    first, second = corner()
    ragged = replace(second, region=second.region.difference(box(-5, 30, 30, 70)))
    found = joints((first, ragged))
    assert len(found[0].intervals) == 2
    for joint in mitred((first, ragged), *found):
        (interval,) = joint.intervals
        assert np.ptp(interval) == pytest.approx(100, abs=3)


def end_face(tone, sheets):
    return look_for_mitre(sheets, *joints(sheets), Painted(tone), nothing_hides(), D, flush=3.0)


@pytest.mark.parametrize("degrees", [90.0, 80.0])
def test_the_end_face_shows_a_mitre(degrees):
    half = np.radians(degrees / 2)
    face = end_face(lambda x, y: np.where(np.arctan2(y, x) > half, 150.0, 165.0), corner(degrees))
    assert face.mitre > 2
    assert face.mitre > 1.5 * face.butt
    assert face.views == 8


@pytest.mark.parametrize("first_runs_through", [True, False])
def test_the_end_face_shows_a_butt_joint(first_runs_through):
    face = end_face(lambda x, y: np.where(y > T if first_runs_through else x < T, 150.0, 165.0), corner())
    assert face.butt > 1.5 * face.mitre


def test_boards_that_do_not_end_flush_have_no_end_face():
    first, second = corner()
    shorter = sheet("second", second.world_from_board, T, (0, 20, 200, 80))
    assert end_face(lambda x, y: x * 0, (first, shorter)).views == 0


def test_where_a_board_ends_is_read_beside_the_corner_even_where_its_joint_is_ragged():
    first, second = corner()
    ragged = second.region.difference(box(-5, 85, 4, 110))
    face = end_face(lambda x, y: np.where(y > x, 150.0, 165.0), (first, replace(second, region=ragged)))
    assert (face.views, face.mitre > 2) == (8, True)


def test_only_boards_that_both_reach_the_outer_corner_may_be_mitred():
    for degrees in (60, 90, 135):
        assert overlapping(corner(degrees), *joints(corner(degrees)))
    first, second = corner()
    stopped = sheet("second", second.world_from_board, T, (T - 6, 0, 200, 100))
    assert not overlapping((first, stopped), *joints((first, stopped)))


MITRE, BUTT, FAINT = EndFace(2.2, 1.1, 12), EndFace(1.1, 3.0, 12), EndFace(1.4, 1.2, 12)
NOTHING = EndFace(0.0, 0.0, 0)


def decided(monkeypatch, face, outer=1.1, views=8, sheets=None):
    """The contacts of a corner whose outer faces and end face show so much."""
    scores = iter(outer) if isinstance(outer, list) else None
    monkeypatch.setattr(contacts, "look_for_seam", lambda *a: Seam(next(scores) if scores else outer, views))
    faces = iter(face) if isinstance(face, list) else None
    monkeypatch.setattr(contacts, "look_for_mitre", lambda *a: next(faces) if faces else face)
    cloud = box_cloud(((0, 0, 0), (300, 200, 100)), spacing=20.0)
    return find_contacts(
        sheets or corner(), cloud, Photos(cloud_only(cloud)), FreeSpace((), (), 1.0, 1.0), AssembleOptions()
    )


def test_a_mitre_is_cut_on_cut_and_bevels_both_boards(monkeypatch):
    sheets = corner()
    (found,) = decided(monkeypatch, MITRE)
    contact = to_contact(found, sheets)
    assert (contact.type, contact.face_a, contact.face_b, contact.bevelled) == (4, "edge", "edge", True)
    assert contact.angle == pytest.approx(90)
    assert contact.area == pytest.approx(100 * T * np.sqrt(2), rel=0.03)
    assert contact.normal == pytest.approx((-np.sqrt(0.5), np.sqrt(0.5), 0))
    assert (contact.evidence.seam_score, contact.evidence.decided_by) == (2.2, "seam")
    for segments in constraint_segments(sheets, [found], D, AssembleOptions()):
        (cut,) = [s for s in segments if s.origin == "contact"]
        assert abs(np.degrees(np.arctan2(cut.normal[2], np.hypot(*cut.normal[:2])))) == pytest.approx(45)


@pytest.mark.parametrize(
    ("face", "outer", "views"), [(MITRE, 3.0, 8), (MITRE, 1.1, 2), (BUTT, 1.1, 8), (FAINT, 1.1, 8), (NOTHING, 1.1, 8),
                                 (EndFace(3.0, 1.0, 3), 1.1, 8)]
)  # fmt: skip
def test_without_clear_evidence_a_corner_is_a_butt_joint(monkeypatch, face, outer, views):
    (found,) = decided(monkeypatch, face, outer, views)
    assert found.kind == 2


@pytest.mark.parametrize(("face", "seam", "kind"), [(FAINT, 1.1, 4), (NOTHING, 1.1, 4), (FAINT, 1.6, 4),
                                                    (FAINT, 2.0, 2)])  # fmt: skip
def test_an_open_corner_follows_a_clear_mitre_between_boards_of_the_same_sizes(monkeypatch, face, seam, kind):
    first, second = corner()
    far = second.world_from_board.copy()
    far[:3, 3] += (200 - T, 0, 0)
    sheets = (first, second, sheet("third", far, T, second.region))
    both = decided(monkeypatch, [MITRE, face], [1.1, 1.1, seam, 1.1], sheets=sheets)
    assert [d.kind for d in both] == [4, kind]
    assert [d.evidence.decided_by for d in both] == ["seam", "default" if kind == 4 else "seam"]


def test_a_mitre_moves_with_its_boards(monkeypatch):
    (found,) = decided(monkeypatch, MITRE)
    thicker = corner(thickness=T + 1)
    (moved,) = moved_with(thicker, [found])
    lines = corner_lines(thicker, moved.joint, moved.other)
    assert lines.inner[:2] == pytest.approx([T + 1, T])
    assert moved.joint.trace.slope != pytest.approx(found.joint.trace.slope)


def test_a_mitre_stays_one_when_contacts_are_looked_for_again(monkeypatch):
    sheets = corner()
    earlier = decided(monkeypatch, MITRE)
    cloud = SimpleNamespace(diameter=D, points=np.zeros((0, 3)), normals=np.zeros((0, 3)))
    photos = Photos(cloud_only(box_cloud(((0, 0, 0), (300, 200, 100)), spacing=40.0)))
    (again,) = find_contacts(sheets, cloud, photos, FreeSpace((), (), 1.0, 1.0), AssembleOptions(), earlier)
    assert (again.kind, again.evidence) == (4, earlier[0].evidence)
    assert again.joint.trace.offset == pytest.approx(earlier[0].joint.trace.offset)
