"""Assembling again with what the photographs showed, and without what contacts say of cut paths."""

from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import box

from clouds import pose, sheet
from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.identify.types import Parts
from kerfwright.refine import Outline, RefineOptions, alternate

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
