"""The CadQuery program: run, solved, and equal to the model."""

import re

import pytest

from kerfwright.model import Model
from kerfwright.solid import assembly_solids
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.cadquery_program import export
from simple import bevel, board, hole, rectangle, stool
from truths import AVAILABLE, truth_model

SLOW = ("complex_stool", "nightstand")  # to solve: benchmarks/exports.py does


def assembly(source: str):
    space = {"__name__": "program"}
    exec(compile(source, "model_cadquery.py", "exec"), space)
    return space["assembly"]()


def assert_same(found, model: Model, places: float = 1e-5) -> None:
    for child, (name, expected) in zip(found.children, assembly_solids(model), strict=True):
        solid = child.obj.val().located(child.loc)
        assert child.name == name and solid.isValid()
        assert solid.Volume() == pytest.approx(expected.volume, rel=1e-9)
        assert solid.Center().toTuple() == pytest.approx(tuple(expected.center()), abs=places)


@pytest.mark.skipif(not AVAILABLE, reason="the captures with truth are not on this machine")
@pytest.mark.parametrize("name", [n for n in AVAILABLE if n not in SLOW])
def test_truths_are_solved_to_the_same_places(name, tmp_path):
    (path,) = export(truth_model(name), tmp_path, ExportOptions())
    assert_same(assembly(path.read_text()), truth_model(name))


def test_the_contacts_hold_the_boards(tmp_path):
    """Legs that were put elsewhere come back: it is the constraints that place them."""
    source = export(stool(), tmp_path, ExportOptions())[0].read_text()
    moved, count = re.subn(r'(name="leg_left", loc=place\()\(68,', r"\1(75,", source)
    assert count == 1
    assert_same(assembly(moved), stool(), places=1e-3)


def test_boards_without_contacts_stay_where_they_are(tmp_path):
    cut = board(rectangle(200, 100), "shelf", holes=(hole(50, 50, 9),), bevels=(bevel((200, 0), (200, 100), 30),))
    model = Model(boards=(cut, *stool().boards), contacts=stool().contacts)
    source = export(model, tmp_path, ExportOptions(unverified=True))[0].read_text()
    assert source.count('"Fixed"') == 2 and "NOT VERIFIED" in source
    assert_same(assembly(source), model)
