"""A shelf on an upright that stands on the floor."""

import numpy as np
import pytest
from shapely.geometry import Polygon

from clouds import pose, sheet, turned
from kerfwright.assemble import AssembleOptions
from kerfwright.assemble.constraints import constraint_segments
from kerfwright.assemble.decided import Decided
from kerfwright.identify.joints import Joint, Search, end_on, face_plane, trace_of
from kerfwright.model import ContactEvidence

D = 400.0
SHELF = sheet("shelf", pose((0, 0, 200)), 18.0, (-150, 0, 150, 100))
UPRIGHT = sheet("upright", pose((-9, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 2, 100, 197))
SIDE = sheet("side", pose((-150, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 2, 100, 217))


def joint(sheets, a, b):
    return end_on(sheets, a, b, Search(reach=15.0, slack=6.0, cover=6.0, step=2.0, shortest=5.0))


def segments_of(sheets, *decided):
    return constraint_segments(sheets, list(decided), D, AssembleOptions())


def tee():
    sheets = (SHELF, UPRIGHT)
    return sheets, segments_of(sheets, Decided(joint(sheets, 0, 1), 1, None, ContactEvidence()))


def left_of(segment, point) -> float:
    along = segment.end - segment.start
    along = along / np.linalg.norm(along)
    return float(np.array([-along[1], along[0]]) @ (np.asarray(point) - segment.start))


def test_the_board_that_ends_gets_a_segment_on_the_other_ones_plane():
    _, (shelf, (contact, _)) = tee()
    assert shelf == ()
    assert (contact.origin, contact.contact) == ("contact", 0)
    ends = UPRIGHT.to_world(np.array([[*contact.start, 0.0], [*contact.end, 0.0]]))
    assert ends[:, 2] == pytest.approx(200)
    assert np.linalg.norm(contact.end - contact.start) == pytest.approx(100, abs=2)
    assert contact.normal is None


def test_material_lies_on_the_left():
    _, (_, upright) = tee()
    middle = np.array([50.0, 100.0])
    assert [left_of(s, middle) > 0 for s in upright] == [True, True]


def test_a_board_that_stands_on_the_floor_ends_there():
    _, (_, upright) = tee()
    ground = upright[-1]
    assert (ground.origin, ground.contact) == ("ground", None)
    assert ground.start[1] == ground.end[1] == pytest.approx(0)
    assert left_of(ground, (50.0, 100.0)) == pytest.approx(100)


def test_boards_off_the_floor_have_no_ground():
    raised = sheet("raised", pose((-9, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 30, 100, 197))
    assert segments_of((raised,)) == ((),)


def test_a_board_that_ends_on_another_at_the_floor_has_no_ground_there():
    """A base plate sunk into the floor plane: the upright ends on its top, not on the floor."""
    base = sheet("base", pose((0, 0, -8)), 10.0, (-150, 0, 150, 100))
    standing = sheet("upright", pose((-9, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 4, 100, 197))
    sheets = (base, standing)
    found = segments_of(sheets, Decided(joint(sheets, 0, 1), 1, None, ContactEvidence()))
    assert [s.origin for s in found[1]] == ["contact"]


def test_a_corner_closes_both_boards():
    """The side stops under the shelf; the shelf runs on to the side's outer face."""
    sheets = (SHELF, SIDE)
    chosen, other = joint(sheets, 0, 1), joint(sheets, 1, 0)
    shelf, side = segments_of(sheets, Decided(chosen, 2, other, ContactEvidence()))
    assert [s.origin for s in shelf] == ["corner"]
    assert [s.origin for s in side] == ["contact", "ground"]
    assert shelf[0].start[0] == shelf[0].end[0] == pytest.approx(-150)
    assert left_of(shelf[0], (0.0, 50.0)) == pytest.approx(150)


def test_a_slanted_cut_keeps_its_normal_and_depth():
    frame = turned("y", 70.0)
    frame[:3, 3] = 0.0, 0.0, 100.0
    leaning = sheet("leaning", frame, 18.0, (-99, 0, 60, 80))
    sheets = (SHELF, leaning)
    (segment,) = segments_of(sheets, Decided(joint(sheets, 0, 1), 1, None, ContactEvidence()))[1]
    assert frame[:3, :3] @ segment.normal == pytest.approx([0, 0, 1])
    place = leaning.to_world(np.array([[*segment.start, segment.depth]]))[0]
    assert place[2] == pytest.approx(200)


def test_a_traced_foot_ends_where_its_arch_begins():
    """The arch rises 9 mm over 6: within reach of the floor, but higher than the rest of a foot that was traced."""
    foot = Polygon([(0, 0), (40, 0), (46, 9), (60, 100), (0, 100)])
    leg = sheet("leg", pose((-9, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, foot)
    ((rough,),), ((traced,),) = (
        constraint_segments((leg,), [], 500.0, AssembleOptions(rough=r, outline_error=e))
        for r, e in ((True, 1 / 60), (False, 1 / 200))
    )
    assert np.linalg.norm(rough.end - rough.start) > 45
    assert np.linalg.norm(traced.end - traced.start) == pytest.approx(41, abs=2)


def corner_with_a_diagonal():
    """A top, a diagonal that stops in its corner, and what is known of that corner."""
    n, u = np.array([1, 0, 1]) / np.sqrt(2), np.array([1, 0, -1]) / np.sqrt(2)
    top = sheet("top", pose((-200, 0, 0), (1, 0, 0), (0, 1, 0)), 16.0, (0, 0, 400, 100))
    diagonal = sheet("diagonal", pose(np.array([-184, 0, 0]) - 8 * n, u, (0, 1, 0)), 16.0, (3, 0, 250, 100))
    inner = Joint(1, 0, "top", trace_of(top, *face_plane(diagonal, "top")), ((0.0, 100.0),), 0.0, np.zeros((0, 2)))
    return (top, diagonal), Decided(joint((top, diagonal), 0, 1), 2, inner, ContactEvidence())


def test_the_board_that_runs_through_at_a_slanted_corner_ends_flush():
    sheets, corner = corner_with_a_diagonal()
    (end,) = segments_of(sheets, corner)[0]
    assert (end.origin, end.normal is not None) == ("corner", True)


def test_a_diagonal_within_the_corner_of_a_case_does_not_bevel_its_end():
    """The case's side stands where the bevel would be."""
    (top, diagonal), corner = corner_with_a_diagonal()
    side = sheet("side", pose((-200, 0, -200), (0, 1, 0), (0, 0, 1)), 16.0, (0, 0, 100, 198))
    sheets = (top, diagonal, side)
    assert segments_of(sheets, corner, Decided(joint(sheets, 0, 2), 1, None, ContactEvidence()))[0] == ()
