"""A side, a bottom that ends on it, and a diagonal that runs into the corner of both."""

from dataclasses import replace

import numpy as np

from clouds import pose, sheet
from kerfwright.assemble import AssembleOptions
from kerfwright.assemble.constraints import constraint_segments
from kerfwright.assemble.decided import Decided
from kerfwright.assemble.severing import severed_share, without_severing
from kerfwright.identify.joints import Search, end_on, face_plane
from kerfwright.model import ContactEvidence

T = 20.0
SLANT = np.array([1.0, 0, 1]) / np.sqrt(2)
SIDE = sheet("side", pose((0, 0, 0), (0, 0, 1), (0, 1, 0)), T, (0, 0, 400, 100))  # its inner face is x = 0
BOTTOM = sheet("bottom", pose((0, 0, 0), (1, 0, 0), (0, 1, 0)), T, (0, 0, 400, 100))
DIAGONAL = sheet("diagonal", pose((0, 0, T), SLANT, (0, 1, 0)), 16.0, (0, 0, 300, 100))
SHEETS = (SIDE, BOTTOM, DIAGONAL)
SEARCH = Search(reach=10.0, slack=5.0, cover=25.0, step=1.5, shortest=3.0)


def joint(a: int, b: int):
    return end_on(SHEETS, a, b, SEARCH)


def corner(a: int, b: int, decided_by: str = "default") -> Decided:
    evidence = ContactEvidence(seam_score=1.2, seam_score_other=1.1, decided_by=decided_by)
    return Decided(joint(a, b), 2, joint(b, a), evidence)


STANDS = Decided(joint(0, 1), 1, None, ContactEvidence())


def test_the_side_does_not_end_on_the_diagonal_where_the_bottom_ends_on_it() -> None:
    assert severed_share(SHEETS, joint(2, 0), STANDS.joint) > 0.5
    assert severed_share(SHEETS, joint(0, 2), STANDS.joint) == 0
    (kept, turned) = without_severing(SHEETS, [STANDS, corner(2, 0)])
    assert kept is STANDS
    assert (turned.joint.a, turned.joint.b) == (0, 2)
    assert (turned.evidence.decided_by, turned.evidence.seam_score) == ("geometry", 1.1)


def test_a_corner_that_severs_nothing_stays_as_the_photographs_decided() -> None:
    right = corner(0, 2, "seam")
    assert without_severing(SHEETS, [STANDS, right])[1] is right


def test_a_square_corner_by_default_does_not_turn_one_decided_by_a_seam() -> None:
    unsure = replace(STANDS, kind=2, other=STANDS.joint, evidence=ContactEvidence(decided_by="default"))
    clear = corner(2, 0, "seam")
    assert without_severing(SHEETS, [unsure, clear])[1] is clear


def test_the_side_ends_square_where_the_bottom_ends_on_it_and_not_flush_with_the_diagonal() -> None:
    found = [STANDS, corner(0, 2)]
    (side, _, diagonal) = constraint_segments(SHEETS, found, 500.0, AssembleOptions())
    assert not [s for s in side if s.origin == "corner"]
    assert [s.origin for s in diagonal if s.contact == 1] == ["contact"]
    (alone, _, _) = constraint_segments(SHEETS, found[1:], 500.0, AssembleOptions())
    assert [s.origin for s in alone if s.contact == 0] == ["corner"]


def test_both_slants_of_a_pointed_end_lie_on_one_line_though_the_planes_are_a_little_turned() -> None:
    turned = np.eye(4)
    turned[:2, :2] = [[np.cos(7e-4), -np.sin(7e-4)], [np.sin(7e-4), np.cos(7e-4)]]
    side = replace(SIDE, world_from_board=turned @ SIDE.world_from_board)
    sheets = (side, BOTTOM, replace(DIAGONAL, world_from_board=pose((-6, 0, T - 6), SLANT, (0, 1, 0))))
    found = [Decided(end_on(sheets, k, 2, SEARCH), 1, None, ContactEvidence()) for k in (0, 1)]
    first, second = constraint_segments(sheets, found, 500.0, AssembleOptions())[2]
    along = (first.end - first.start) / np.linalg.norm(first.end - first.start)
    for place in (second.start, second.end):
        away = place - first.start
        assert abs(away[0] * along[1] - away[1] * along[0]) < 1e-9
    for found_one, own in zip(found, (first, second), strict=True):  # and each slant is the other board's face still
        normal, offset = face_plane(sheets[found_one.joint.a], found_one.joint.face_a)
        middle = np.array([*(own.start + own.end) / 2, own.depth])
        assert abs(sheets[2].to_world(middle[None])[0] @ normal - offset) < 1e-9
