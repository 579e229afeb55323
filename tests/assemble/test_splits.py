"""Seams between boards that were seen as one: pieces, segments, contacts."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from shapely.geometry import box

from clouds import sheet
from kerfwright.assemble.discontinuity import Discontinuity
from kerfwright.assemble.face_seams import _crosses_all, _known_lines, _partner, seams_of_face
from kerfwright.assemble.splits import (
    SeamLine,
    _apart,
    _is_clear,
    _is_denied,
    _is_late_wood,
    _on_line,
    _wide_enough,
    seam_contact,
    seam_segments,
    split_sheet,
)
from kerfwright.assemble.texture import FaceStrips
from kerfwright.assemble.tone import ToneSteps

ACROSS = np.array([1.0, 0.0])
WIDE = sheet("wide", np.eye(4), 20.0, (0, 0, 300, 100), top_idx=np.arange(6))
POINTS = np.array([[x, 50.0, 20.0] for x in (10, 60, 110, 160, 210, 260)])


def seam(at: float, gap: float = 0.0) -> SeamLine:
    return SeamLine(ACROSS, at, np.array([at, 0.0]), np.array([at, 100.0]), 8.0, 6, gap)


def test_pieces_share_out_the_board_and_its_points():
    pieces = split_sheet(WIDE, [seam(100), seam(200)], POINTS)
    assert [p.region.bounds for p in pieces] == [(0, 0, 100, 100), (100, 0, 200, 100), (200, 0, 300, 100)]
    assert [list(p.top_idx) for p in pieces] == [[0, 1], [2, 3], [4, 5]]


def test_segments_have_each_piece_on_their_left():
    for segment, inside in zip(seam_segments(seam(100), 3), ([50, 50], [150, 50]), strict=True):
        along, to = segment.end - segment.start, np.array(inside) - segment.start
        assert along[0] * to[1] - along[1] * to[0] > 0
        assert (segment.origin, segment.contact) == ("contact", 3)


def test_boards_with_a_gap_end_either_side_of_its_middle():
    before, after = seam_segments(seam(100, gap=4.0), None)
    assert (before.start[0], after.start[0]) == (98, 102)
    assert {before.origin, after.origin} == {"photo"}


def test_the_contact_of_two_pieces_is_edge_to_edge():
    one, other = split_sheet(WIDE, [seam(100)], POINTS)
    contact = seam_contact(one, other, seam(100))
    assert (contact.type, contact.face_a, contact.face_b) == (4, "edge", "edge")
    assert contact.area == pytest.approx(2000)
    assert contact.point[0] == pytest.approx(100)


def test_a_seam_crosses_the_whole_board():
    holed = box(0, 0, 300, 100).difference(box(80, 40, 120, 60))
    assert _crosses_all(WIDE.region, ACROSS, 100, 10)
    assert not _crosses_all(holed, ACROSS, 100, 10)
    slit = box(0, 0, 300, 100).difference(box(99, 5, 101, 100))
    assert _crosses_all(slit, ACROSS, 100, 10)


def test_two_lines_side_by_side_are_one_joint():
    strength = np.ones(60)
    strength[[20, 28, 50]] = 10, 9, 9.5
    assert _partner(strength, 20, 12) == 8
    assert _partner(strength, 50, 12) == 0


def changing(strength: float, views: int, at: float = 100.0) -> Discontinuity:
    """A face of which `views` photographs show some change at one place, and the usual one elsewhere."""
    offsets = np.arange(0.0, 300.0)
    values = np.where(np.abs(offsets - at) < 2, strength, 1.0)
    none = np.zeros((300, 8, 1))
    return Discontinuity(offsets, values, none[:, 0], none, np.zeros((views, 300, 8, 3)), np.zeros((9, 1)))


@pytest.mark.parametrize(("other", "denied"), [
    (changing(1.2, 6), True), (changing(1.2, 3), False), (changing(5.0, 6), False), (changing(5.0, 6, at=150), True),
    (None, False),
])  # fmt: skip
def test_a_seam_goes_through_to_the_other_face(other, denied):
    assert _is_denied(seam(100), changing(8.0, 5), other, 500.0) is denied


@pytest.mark.parametrize(("strength", "views", "clear"), [(8, 4, False), (8, 5, True), (15, 4, True), (6, 8, False)])
def test_few_views_need_a_stronger_seam(strength, views, clear):
    line = SeamLine(ACROSS, 100.0, np.zeros(2), np.array([0.0, 100.0]), strength, views)
    assert _is_clear(line) is clear


@pytest.mark.parametrize(("strength", "clear"), [(6.0, False), (7.2, False), (8.0, True)])
def test_the_first_step_of_tone_has_to_be_clearer_than_further_ones(strength, clear):
    line = SeamLine(ACROSS, 100.0, np.zeros(2), np.array([0.0, 100.0]), strength, 12, by_tone=True)
    assert _is_clear(line) is clear


def stepping(strength: float, side: float, views: int = 6) -> ToneSteps:
    """A face whose tone steps to one side at 100 mm, as `views` photographs show it."""
    offsets = np.arange(0.0, 300.0)
    values = np.where(np.abs(offsets - 100) < 2, strength, 0.5)
    line = side * np.ones((300, 3))
    return ToneSteps(offsets, values, line, line, [], line, np.zeros((views, 300, 8, 3)), [], np.zeros(300))


def test_boards_step_to_the_same_side_on_both_faces():
    assert not _is_denied(seam(100), stepping(8, 1.0), stepping(8, 1.0), 500.0)
    assert _is_denied(seam(100), stepping(8, 1.0), stepping(8, -1.0), 500.0)
    assert _is_denied(seam(100), stepping(8, 1.0), stepping(8, 0.2), 500.0)


def test_a_strong_line_that_wanders_denies_a_step_of_tone():
    broken = replace(changing(9.0, 6), line=np.ones((300, 1)))  # no eighth of it shows anything
    assert _is_late_wood(seam(100), broken, 500.0)
    assert not _is_late_wood(seam(150), broken, 500.0)
    assert not _is_late_wood(seam(100), changing(6.0, 6), 500.0)
    assert not _is_late_wood(seam(100), replace(broken, flat=np.ones((300, 8, 1))), 500.0)


def test_a_step_of_tone_lies_where_a_line_near_by_does():
    assert _on_line(seam(100), [seam(103), seam(160)], 500.0).offset == 103
    assert _on_line(seam(100), [seam(110)], 500.0).offset == 100


def test_nothing_is_measured_across_a_known_seam():
    strips = FaceStrips(np.arange(300.0), np.arange(8.0), np.zeros((2, 300, 8, 3)))
    told = np.isfinite(_apart(strips, [seam(100)]).colours[..., 0]).all(axis=(0, 2))
    assert not told[98:103].any()
    assert told[:98].all()
    assert told[103:].all()
    assert np.isfinite(strips.colours).all()


def test_a_doubtful_seam_leaves_no_narrow_strip():
    offsets = [s.offset for s in _wide_enough(WIDE, ACROSS, [seam(100), seam(200), seam(280)])]
    assert offsets == [100, 200]
    certain = SeamLine(ACROSS, 280.0, np.array([280.0, 0]), np.array([280.0, 100]), 20.0, 6)
    assert len(_wide_enough(WIDE, ACROSS, [seam(100), seam(200), certain])) == 3


@dataclass(frozen=True)
class Asked:
    """A change at 100 mm that looks like a joint's at some offsets only."""

    good: tuple[int, ...]
    beside: tuple[int, ...] = (100,)
    offsets = np.arange(300.0)
    strength = np.where(np.arange(300) == 100, 9.0, 1.0)
    sharp = False

    def around(self, _k: int) -> tuple[int, ...]:
        return self.beside

    def along(self, k: int) -> float:
        return 0.9 if k in self.good else 0.2

    def unbroken(self, k: int) -> bool:
        return k in self.good

    def views(self, k: int) -> list[float]:
        return [1.0] * (6 if k in self.good else 1)

    def located(self, k: int) -> float:
        return float(self.offsets[self.beside[-1]])


@pytest.mark.parametrize(("asked", "found"), [
    (Asked(good=(100,)), [100]), (Asked(good=(104,)), []), (Asked(good=(104,), beside=(100, 104)), [104]),
    (Asked(good=(100,), beside=(100, 104)), [104]), (Asked(good=(), beside=(100, 104)), []),
])  # fmt: skip
def test_a_joint_is_asked_for_its_looks_where_it_lies_or_where_it_is_strongest(asked, found):
    seams = seams_of_face(WIDE, ACROSS, asked, [], 500.0, 5.0)
    assert [(s.offset, s.views, s.along) for s in seams] == [(at, 6, 0.9) for at in found]


def test_lines_of_a_board_underneath_are_known_from_above_too():
    """A rail behind a leg lies where its face may change: what shows there is no joint."""
    under = sheet("under", np.eye(4)[[0, 2, 1, 3]] * [[1], [-1], [1], [1]], 18.0, (80, -80, 120, 0))
    assert sorted(round(at) for at in _known_lines(WIDE, ACROSS, [under])) == [80, 120]
