"""Regions run on to their constraint segments, mended, and kept apart."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from clouds import pose, sheet
from kerfwright.assemble import AssembleOptions
from kerfwright.assemble.apart import kept_apart
from kerfwright.assemble.flush import flush_neighbours
from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.gaps import mended
from kerfwright.identify.outlines import constrained_region, filled_region, largest_piece
from kerfwright.model import Contact

BLIND = FreeSpace((), (), 1.0, 1.0)
UNDER = ConstraintSegment(np.array([0.0, 0.0]), np.array([100.0, 0.0]), "contact", 0.1)  # wood above y = 0


def test_a_region_is_run_on_to_its_segment():
    assert filled_region(box(0, 40, 100, 90), (UNDER,), 60).area == pytest.approx(9000, rel=1e-3)


def test_a_strip_left_as_a_hole_outside_the_shell_is_no_part_of_the_region():
    """As GEOS 3.14 made it of a small shelf, cut off behind a segment on which its edge nearly lay."""
    strip = box(10, -25, 90, -1e-8)
    broken = Polygon(box(0, 0, 100, 50).exterior, [strip.exterior])
    assert not broken.is_valid
    assert largest_piece(broken).equals(box(0, 0, 100, 50))


def test_it_is_not_run_on_further_than_told():
    assert filled_region(box(0, 40, 100, 90), (UNDER,), 30).area == pytest.approx(5000, rel=1e-3)


def test_a_step_beside_the_segment_is_left_alone():
    stepped = box(0, 5, 60, 90).union(box(60, 50, 100, 90))
    filled = filled_region(stepped, (UNDER,), 60)
    assert filled.area == pytest.approx(60 * 90 + 40 * 40, rel=0.03)


def test_what_lies_behind_a_segment_is_cut_off():
    assert constrained_region(box(0, -8, 100, 90), (UNDER,), 60, 20).bounds[1] == pytest.approx(0, abs=0.02)


def on_face(spacing: float, region: Polygon) -> np.ndarray:
    """Points on z = 18 inside a region, on a lattice."""
    low_x, low_y, high_x, high_y = region.bounds
    x, y = np.meshgrid(np.arange(low_x, high_x, spacing), np.arange(low_y, high_y, spacing))
    keep = [region.contains(box(a, b, a + 1e-6, b + 1e-6)) for a, b in zip(x.ravel(), y.ravel(), strict=True)]
    return np.c_[x.ravel()[keep], y.ravel()[keep], np.full(sum(keep), 18.0)]


HOLED = box(0, 0, 300, 200).difference(box(100, 80, 160, 120))
BAYED = box(0, 0, 300, 200).difference(box(100, 0, 120, 40))
BRIGHT = box(400, 0, 700, 200)


def boards(region: Polygon, spacing: float, cut: np.ndarray | None = None):
    """The board in question, its points so far apart; a bright one beside it; and their cloud of about D = 700."""
    own, bright = on_face(spacing, region), on_face(4.0, BRIGHT)
    edge = np.zeros((0, 3)) if cut is None else cut
    points = np.concatenate([own, bright, edge])
    idx = np.split(np.arange(len(points)), [len(own), len(own) + len(bright)])
    cloud = Cloud(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    first = sheet("dim", np.eye(4), 18.0, region, top_idx=idx[0], cut_idx=idx[2])
    return (first, sheet("bright", np.eye(4), 18.0, BRIGHT, top_idx=idx[1])), cloud


@pytest.mark.parametrize("region", [HOLED, BAYED])
def test_gaps_in_wood_seen_badly_are_filled(region):
    sheets, cloud = boards(region, 12.0)
    assert mended(sheets, cloud, BLIND, AssembleOptions())[0].region.area == pytest.approx(60_000, rel=1e-3)


@pytest.mark.parametrize("region", [HOLED, BAYED])
def test_gaps_in_wood_seen_well_are_real(region):
    sheets, cloud = boards(region, 4.0)
    assert mended(sheets, cloud, BLIND, AssembleOptions())[0].region.area == pytest.approx(region.area, rel=1e-3)


def test_a_gap_that_cut_faces_line_is_real():
    ring = HOLED.interiors[0]
    cut = np.array([[*ring.interpolate(s).coords[0], 9.0] for s in np.arange(0, ring.length, 3)])
    sheets, cloud = boards(HOLED, 12.0, cut)
    assert mended(sheets, cloud, BLIND, AssembleOptions())[0].region.area == pytest.approx(HOLED.area, rel=1e-3)


def test_a_gap_that_cameras_saw_through_is_real():
    sheets, cloud = boards(HOLED, 12.0)
    free = SimpleNamespace(votes=lambda places: np.full(len(places), 2))
    assert mended(sheets, cloud, free, AssembleOptions())[0].region.area == pytest.approx(HOLED.area, rel=1e-3)


def test_neighbours_that_measure_the_same_share_a_plane():
    a = sheet("a", np.eye(4), 18.0, (0, 0, 100, 100))
    b = sheet("b", pose((100, 0, 0.3)), 18.0, (0, 0, 300, 100))
    c = sheet("c", pose((400, 0, 3.0)), 18.0, (0, 0, 100, 100))
    heights = [s.world_from_board[2, 3] for s in flush_neighbours((a, b, c), 500.0, AssembleOptions())]
    assert heights == pytest.approx([0.225, 0.225, 3.0])


def test_parallel_boards_apart_keep_their_planes():
    a, b = sheet("a", np.eye(4), 18.0, (0, 0, 100, 100)), sheet("b", pose((300, 0, 0.3)), 18.0, (0, 0, 100, 100))
    assert flush_neighbours((a, b), 500.0, AssembleOptions())[1].world_from_board[2, 3] == 0.3


FLOOR = sheet("floor", np.eye(4), 18.0, (0, 0, 400, 300))
FOOT = sheet("foot", pose((0, 100, 0), (0, 0, 1), (1, 0, 0)), 15.0, (10, 50, 200, 150))  # 8 mm into the floor board


def test_a_board_is_cut_back_from_one_that_it_does_not_meet():
    slip = replace(FOOT, world_from_board=pose((0, 100, 5), (0, 0, 1), (1, 0, 0)))
    apart = kept_apart(Assembly((FLOOR, slip), (), ((), ())), 500)
    low = apart.sheets[1].to_world(np.array([[apart.sheets[1].region.bounds[0], 60, 0]]))[0, 2]
    assert low == pytest.approx(18.25, abs=0.01)
    assert apart.sheets[0] is FLOOR


def test_a_board_is_cut_back_from_a_parallel_one_beside_it_and_not_from_one_laid_on_it():
    beside = sheet("beside", pose((395, 0, 4)), 10.0, (0, 0, 200, 100))
    laid = sheet("laid", pose((0, 0, 18)), 10.0, (0, 0, 200, 100))
    apart = kept_apart(Assembly((FLOOR, beside, laid), (), ((), (), ())), 500)
    assert apart.sheets[1].region.bounds == pytest.approx((5.25, 0, 200, 100))
    assert apart.sheets[2] is laid


def test_boards_that_meet_are_left_to_their_contact():
    contact = Contact(
        type=1, a="floor", b="foot", face_a="top", face_b="edge", point=(0, 0, 18), normal=(0, 0, 1), interface=(),
        area=1.0, angle=90.0,
    )
    assert kept_apart(Assembly((FLOOR, FOOT), (contact,), ((), ())), 500).sheets[1] is FOOT


def test_a_large_overlap_is_left_for_the_checker():
    deep = replace(FOOT, world_from_board=pose((0, 100, -40), (0, 0, 1), (1, 0, 0)))
    assert kept_apart(Assembly((FLOOR, deep), (), ((), ())), 500).sheets[1] is deep
