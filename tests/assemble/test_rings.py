"""Frames of boards in one plane: 400 x 300 mm, boards 60 mm wide, seen from above."""

from itertools import pairwise

import numpy as np
import pytest
from shapely.geometry import Polygon, box
from shapely.ops import unary_union

from clouds import pose, sheet
from kerfwright.assemble.rings import find_ring_seams, ring_corners, split_ring
from kerfwright.assemble.splits import seam_contact, seam_segments
from painted import Painted, nothing_hides

D = 400.0
OUTER, OPENING = box(0, 0, 400, 300), box(60, 60, 340, 240)
FRAME = sheet("frame", pose((0, 0, 20)), 18.0, OUTER.difference(OPENING))
NO_POINTS = np.zeros((0, 3))


def mitred_tone(x, y):
    """Rails of one tone, stiles of another, parted at 45 degrees."""
    beside = np.minimum(x, 400 - x) < np.minimum(y, 300 - y)
    return np.where(beside, 150.0, 165.0)


def butted_tone(x, y):
    """Stiles between the rails."""
    return np.where((y > 60) & (y < 240), 150.0, 165.0)


def one_panel(x, y):
    """Grain that runs along x over the whole of it."""
    return 160.0 + 4 * np.sin(y / 3.0 + np.sin(x / 50))


def seams_of(tone, frame=FRAME):
    return find_ring_seams(frame, Painted(tone), nothing_hides(), D)


def ragged(ring: Polygon, by: float) -> Polygon:
    points = np.array([ring.exterior.interpolate(s).coords[0] for s in np.arange(0, ring.exterior.length, 5.0)])
    return Polygon(points + np.random.default_rng(1).normal(0, by, points.shape))


def test_a_mitred_frame_is_cut_from_its_inner_corners_to_its_outer_ones():
    seams = seams_of(mitred_tone)
    ends = sorted((*np.round(s.start, 3), *np.round(s.end, 3)) for s in seams)
    assert ends == [(60, 60, 0, 0), (60, 240, 0, 300), (340, 60, 400, 0), (340, 240, 400, 300)]
    assert min(s.strength for s in seams) > 2.5


def test_a_butted_frame_is_cut_along_its_opening():
    seams = seams_of(butted_tone)
    ends = sorted((*np.round(s.start, 3), *np.round(s.end, 3)) for s in seams)
    assert ends == [(60, 60, 0, 60), (60, 240, 0, 240), (340, 60, 400, 60), (340, 240, 400, 240)]


def test_a_frame_sawn_out_of_one_panel_stays_whole():
    assert seams_of(one_panel) == []


@pytest.mark.parametrize("holes", [[], [box(180, 140, 200, 160)], [box(60, 60, 180, 240), box(220, 60, 340, 240)]])
def test_a_board_without_one_large_opening_is_no_ring(holes):
    region = OUTER.difference(unary_union(holes))
    assert ring_corners(region, D / 10, D / 100) == []


def test_corners_are_found_in_a_ragged_outline():
    region = ragged(OUTER, 0.8).difference(ragged(OPENING, 0.8))
    inner = sorted(tuple(c.inner) for c in ring_corners(region, D / 10, D / 100))
    assert np.array(inner) == pytest.approx(np.array([(60, 60), (60, 240), (340, 60), (340, 240)]), abs=1.0)


@pytest.mark.parametrize(("tone", "areas"), [(mitred_tone, [14400, 14400, 20400, 20400]),
                                             (butted_tone, [10800, 10800, 24000, 24000])])
def test_the_pieces_are_boards_that_meet_at_the_seams(tone, areas):
    seams = seams_of(tone)
    boards = split_ring(FRAME, seams, NO_POINTS, D)
    assert sorted(b.region.area for b in boards) == pytest.approx(areas, rel=1e-3)
    for (before, after), seam in zip(pairwise([boards[-1], *boards]), seams, strict=True):
        shared = before.region.boundary.intersection(after.region.boundary)
        assert shared.length == pytest.approx(np.hypot(*(seam.end - seam.start)), abs=0.1)
        contact = seam_contact(before, after, seam)
        assert (contact.type, contact.face_a, contact.face_b) == (4, "edge", "edge")
        for board, segment in zip((before, after), seam_segments(seam, 0), strict=True):
            along = segment.end - segment.start
            middle = np.array(board.region.representative_point().coords[0]) - segment.start
            assert along[0] * middle[1] - along[1] * middle[0] > 0


def grained(beside):
    """Boards of one tone whose grain runs along them: `beside` tells where the left and right ones are."""
    def tone(x, y):
        across, up = np.sin(x / 0.9 + np.sin(y / 40)), np.sin(y / 0.9 + np.sin(x / 40))
        return 160.0 + 6 * np.where(beside(x, y), across, up)
    return tone


def test_the_grain_tells_a_mitre_between_boards_of_one_tone():
    seams = seams_of(grained(lambda x, y: np.minimum(x, 400 - x) < np.minimum(y, 300 - y)))
    ends = sorted((*np.round(s.start), *np.round(s.end)) for s in seams)
    assert ends == [(60, 60, 0, 0), (60, 240, 0, 300), (340, 60, 400, 0), (340, 240, 400, 300)]


@pytest.mark.parametrize("beside, ends", [
    (lambda x, y: (y > 60) & (y < 240), [(60, 60, 0, 60), (60, 240, 0, 240), (340, 60, 400, 60), (340, 240, 400, 240)]),
    (lambda x, y: (x < 60) | (x > 340), [(60, 60, 60, 0), (60, 240, 60, 300), (340, 60, 340, 0), (340, 240, 340, 300)]),
])  # fmt: skip
def test_the_grain_tells_which_boards_run_through(beside, ends):
    found = sorted((*np.round(s.start), *np.round(s.end)) for s in seams_of(grained(beside)))
    assert found == ends
