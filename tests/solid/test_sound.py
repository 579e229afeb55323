"""One board without a solid does not lose the others: it is drawn more plainly, and told."""

import pytest

from kerfwright.model import Arc, Line, Loop
from kerfwright.model.faults import faults
from kerfwright.model.geometry import path_area
from kerfwright.solid import assembly_solids, check
from kerfwright.solid.sound import solid_problem, with_solids
from simple import bevel, board, hole, placed, polygon, rectangle, stool

BOW = [(0.0, 0.0), (300.0, 0.0), (300.0, 200.0), (290.0, -1.0), (0.0, 200.0)]  # crosses its lower edge near x = 290


def with_second_leg(**changes):
    """The stool, its second leg changed."""
    top, left, right = stool().boards
    return stool().model_copy(update={"boards": (top, left, right.model_copy(update=changes))})


def test_a_sound_model_is_left_alone():
    assert with_solids(stool()) == stool()
    assert [solid_problem(b) for b in stool().boards] == [None] * 3


def test_a_path_that_crosses_itself_becomes_a_polygon_and_the_rest_stays():
    model = with_second_leg(cut_path=board(polygon(BOW)).cut_path)
    assert solid_problem(model.boards[2]).startswith("outer: crosses itself")
    mended = with_solids(model)
    assert mended.boards[:2] == model.boards[:2] and mended.contacts == model.contacts
    assert not faults(mended) and len(assembly_solids(mended)) == 3
    assert path_area(mended.boards[2].cut_path) == pytest.approx(290 * 201 / 2, rel=0.02)
    (told,) = mended.findings
    assert (told.code, told.severity, told.boards) == ("K013", "warning", ("leg right",))
    assert "crosses itself" in told.message and "drawn as a plain polygon" in told.message
    assert not {f.code for f in check(mended)} & {"K105", "K106", "K109"}


def test_a_hole_over_the_edge_becomes_a_notch():
    path = board(rectangle(380, 300), holes=(hole(380.0, 150.0, 10.0),)).cut_path
    mended = with_solids(with_second_leg(cut_path=path)).boards[2]
    assert mended.cut_path.holes == () and solid_problem(mended) is None
    assert path_area(mended.cut_path) == pytest.approx(380 * 300 - 3.1416 * 100 / 2, abs=3)


def test_bevels_off_every_edge_are_left_out_and_nothing_else():
    model = with_second_leg(bevels=(bevel((100, 150), (200, 150), 30),))
    mended = with_solids(model)
    assert mended.boards[2].bevels == () and mended.boards[2].cut_path == model.boards[2].cut_path
    assert "drawn without bevels" in mended.findings[0].message


def test_an_arc_that_is_a_line_is_drawn_from_its_ends():
    lines = [Line(start=a, end=b) for a, b in (((0, 0), (100, 0)), ((100, 0), (100, 50)), ((0, 50), (0, 0)))]
    flat = Loop(edges=(*lines[:2], Arc(start=(100, 50), mid=(50, 50), end=(0, 50)), lines[2]))
    mended = with_solids(with_second_leg(cut_path=board(flat).cut_path)).boards[2]
    assert path_area(mended.cut_path) == pytest.approx(5000) and solid_problem(mended) is None


def test_repeats_of_a_board_drawn_anew_are_boards_of_their_own():
    top, left, right = stool().boards
    left = left.model_copy(update={"cut_path": board(polygon(BOW)).cut_path})
    right = right.model_copy(update={"same_as": "leg left"})
    mended = with_solids(stool().model_copy(update={"boards": (top, left, right)}))
    assert [b.same_as for b in mended.boards] == [None] * 3 and not faults(mended)


def test_a_board_without_area_is_left_out_with_its_contacts():
    top, left, right = stool().boards
    thread = board([(0.0, 0.0), (380.0, 0.0), (190.0, 0.0)]).cut_path
    right = right.model_copy(update={"bevels": (bevel((0, 300), (0, 0), 30, 18.0, contact=1),)})
    left = left.model_copy(update={"cut_path": thread})
    rail = board(rectangle(50, 50), "rail", pose=placed(at=(0, 900, 0)))
    mended = with_solids(stool().model_copy(update={"boards": (top, left, right, rail)}))
    assert [b.name for b in mended.boards] == ["top", "leg right", "rail"]
    assert [(c.a, c.b) for c in mended.contacts] == [("top", "leg right")]
    assert mended.boards[1].bevels[0].contact == 0
    assert [(f.code, f.severity, f.boards) for f in mended.findings] == [("K013", "error", ())]
    assert not faults(mended)
