"""Assembling again with what the photographs showed, and without what contacts say of cut paths."""

from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import box

from clouds import pose, sheet
from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.identify.types import Parts
from kerfwright.refine import BoundaryLoop, Outline, RefineOptions, alternate

TRACED, RUN_ON = box(0, 0, 200, 110), box(0, 0, 200, 120)


@pytest.fixture
def again(monkeypatch):
    """What `assembled_again` gives when assembly runs the one board on to a contact."""
    segment = ConstraintSegment(np.array([200.0, 120]), np.array([0.0, 120]), "contact", 0.15)
    assembly = Assembly((sheet("board_01", pose((0, 0, 50)), 18.0, RUN_ON),), (), ((segment,),))
    monkeypatch.setattr(alternate, "assemble", lambda parts, capture, options: assembly)
    piece = alternate.Piece(sheet("board_01", pose((0, 0, 50)), 18.0, TRACED), Outline((), "images"))
    capture = SimpleNamespace(cloud=SimpleNamespace(diameter=450.0))
    parts = Parts((), (), 0.3)
    return lambda **options: alternate.assembled_again([piece], parts, capture, RefineOptions(**options))[1]


def test_boards_are_cut_on_what_they_end_on(again):
    assembly = again()
    assert assembly.sheets[0].region.equals(RUN_ON)
    assert len(assembly.constraints[0]) == 1


def test_without_constraints_boards_keep_the_outlines_that_were_traced(again):
    assembly = again(use_constraints=False)
    assert assembly.sheets[0].region.equals(TRACED)
    assert assembly.constraints == ((),)


def test_assembly_starts_again_from_what_was_traced(monkeypatch):
    seen = sheet("board_01", pose((0, 0, 50)), 18.0, box(0, 0, 300, 300))
    started: list = []

    def assembled(parts, capture, options):
        started.extend(parts.sheets)
        return Assembly(parts.sheets, (), ((),))

    monkeypatch.setattr(alternate, "assemble", assembled)
    monkeypatch.setattr(alternate, "kept_apart", lambda assembly, diameter: assembly)
    capture = SimpleNamespace(cloud=SimpleNamespace(diameter=450.0))
    alternate.assembled_again([piece(TRACED)], Parts((seen,), (), 0.3), capture, RefineOptions())
    assert started[0].region.equals(TRACED)


def piece(region, z: float = 50.0) -> alternate.Piece:
    """A board whose outline has the corners of its region."""
    ring = np.asarray(region.exterior.coords)[:-1]
    own = sheet("board", pose((0, 0, z)), 18.0, region, top_idx=np.array([int(z)]))
    return alternate.Piece(own, Outline((BoundaryLoop(ring, np.full(len(ring), 0.2)),), "images"))


LEG = box(0, 0, 80, 400).union(box(0, 300, 145, 400))
FACING = box(220, 0, 300, 400).union(box(143, 300, 300, 400))


def test_two_legs_that_both_have_half_of_the_rail_become_one_board():
    (one,) = alternate._one_where_they_overlap([piece(LEG), piece(FACING)], 500.0)
    assert one.sheet.region.symmetric_difference(LEG.union(FACING)).area < 1
    assert sum(len(loop.points) for loop in one.outline.loops) == 16


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (piece(box(0, 0, 101, 400)), piece(box(99, 0, 200, 400))),  # plain neighbours, traced a little too wide
        (piece(LEG), piece(FACING, z=90.0)),  # in another plane
        (piece(LEG), piece(box(220, 0, 300, 400))),  # apart
    ],
)
def test_other_neighbours_stay_two(first, second):
    assert alternate._one_where_they_overlap([first, second], 500.0) == [first, second]
