"""The build123d program: the same solids, and an assembly that still fits after its dimensions were changed."""

import subprocess
import sys

import numpy as np
import pytest

from kerfwright.errors import ExportError
from kerfwright.model import Arc, Line, Loop, Model
from kerfwright.solid import assembly_solids
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.program import identifiers
from kerfwright_exporters.script import export
from scripted import dimensions, interference, problems, run, typed_contacts
from simple import bevel, board, placed, rectangle, stool
from truths import AVAILABLE, truth_model

truths = pytest.mark.skipif(not AVAILABLE, reason="the captures with truth are not on this machine")


def program(model: Model, folder) -> str:
    return export(model, folder, ExportOptions())[0].read_text()


def assert_same(solids: dict, model: Model) -> None:
    for name, expected in assembly_solids(model):
        assert solids[name].volume == pytest.approx(expected.volume, rel=1e-9)
        assert (solids[name].center() - expected.center()).length < 1e-6


@truths
@pytest.mark.parametrize("name", AVAILABLE)
def test_running_it_gives_the_same_solids(name, tmp_path):
    assert_same(run(program(truth_model(name), tmp_path))[0], truth_model(name))


@truths
@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("bookshelf", {"WIDTH": 704.0}),
        ("nightstand", {"STOCK_18": 20.0, "HEIGHT": 468.0}),
        ("stool", {"DEPTH": 261.0, "STOCK_18": 20.0}),
        ("tilted_stool", {"WIDTH": 480.0, "STOCK_18": 16.0}),
    ],
)
def test_changed_dimensions_keep_contacts_and_validity(name, changes, tmp_path):
    assert problems(program(truth_model(name), tmp_path), **changes) == []


def test_what_lies_on_a_contact_follows_its_neighbour(tmp_path):
    source = program(stool(), tmp_path)
    assert dimensions(source) == {"WIDTH": 400.0, "DEPTH": 300.0, "HEIGHT": 398.0, "STOCK_18": 18.0}
    solids, _ = run(source, HEIGHT=450.0, STOCK_18=21.0)
    assert pytest.approx(450 - 21, abs=1e-9) == solids["leg left"].bounding_box().max.Z
    assert solids["leg left"].volume == pytest.approx(21 * 300 * (450 - 21))
    solids, normals = run(source, TOP_LENGTH=500.0)
    assert pytest.approx(500) == solids["top"].bounding_box().size.X
    assert typed_contacts(solids, normals) == {
        ("top", "leg left"): ("sheet", "cut"),
        ("top", "leg right"): ("sheet", "cut"),
    }
    assert interference(solids) == 0


def test_boards_that_only_come_near_each_other_do_not_meet_after_a_change(tmp_path):
    shelf = board(rectangle(200, 100), "shelf", 18.0, placed(at=(18.5, 0, 100)))  # half a millimetre from the side
    side = board(rectangle(100, 300), "side", 18.0, placed((0, 1, 0), (0, 0, 1)))
    model = Model(boards=(side, shelf))
    source = program(model, tmp_path)
    assert_same(run(source)[0], model)
    solids, normals = run(source, STOCK_18=20.0)
    assert interference(solids) == 0 and typed_contacts(solids, normals) == {}
    assert pytest.approx(20.1) == solids["shelf"].bounding_box().min.X


def test_bevels_that_no_whole_plane_can_cut_are_cut_where_they_are(tmp_path):
    angle = [(0, 0), (300, 0), (300, 100), (100, 100), (100, 300), (0, 300)]
    inner = bevel((300, 100), (100, 100), 30.0, 18.0)  # its plane runs through the other leg
    outer = bevel((0, 0), (300, 0), 20.0, 18.0)
    model = Model(boards=(board(angle, "angle", 18.0, bevels=(inner, outer)),))
    source = program(model, tmp_path)
    assert source.count("bevels = [") == 1 and source.count("Plane(stretched(") == 1
    assert_same(run(source)[0], model)
    solids, _ = run(source, STOCK_18=20.0)
    thicker = board(angle, "angle", 20.0, bevels=(inner, outer))
    assert solids["angle"].volume == pytest.approx(assembly_solids(Model(boards=(thicker,)))[0][1].volume, rel=1e-9)


@pytest.mark.parametrize("height", [360.0, 398.0, 440.0])
def test_legs_that_lean_by_a_hair_are_still_cut(height, tmp_path):
    """OCCT leaves a round side whole where the cut slants by a ten thousandth of a radian."""
    sides = (Arc(start=(380, 0), mid=(190, -9), end=(0, 0)), Line(start=(0, 0), end=(0, 300)))
    sides = tuple(e.model_copy(update={"start": e.end, "end": e.start, **_middle(e)}) for e in reversed(sides))
    outline = Loop(edges=(*sides, Line(start=(380, 0), end=(380, 300)), Line(start=(380, 300), end=(0, 300))))
    turn = 1e-4
    model = stool()
    legs = [
        board(outline, leg.name, 18.0, placed((turn, 0, np.sqrt(1 - turn**2)), (0, 1, 0), (x, 0, 0)))
        for leg, x in zip(model.boards[1:], (68.0, 350.0), strict=True)
    ]
    model = model.model_copy(update={"boards": (model.boards[0], *legs)})
    source = program(model, tmp_path)
    assert problems(source, HEIGHT=dimensions(source)["HEIGHT"] * height / 398) == []


def _middle(edge) -> dict:
    return {"mid": edge.mid} if isinstance(edge, Arc) else {}


def test_it_runs_by_itself_without_kerfwright(tmp_path):
    (path,) = export(stool(), tmp_path, ExportOptions())
    source = path.read_text()
    assert "import kerfwright" not in source and "from kerfwright" not in source
    subprocess.run([sys.executable, path.name], cwd=tmp_path, check=True, capture_output=True)
    from build123d import import_step

    root = import_step(str(tmp_path / "model_from_script.step"))
    assert [child.label for child in root.children] == ["top", "leg_left", "leg_right"]
    assert_same({n: c for (n, _), c in zip(assembly_solids(stool()), root.children, strict=True)}, stool())


def test_names_become_identifiers():
    names = ["line", "2nd shelf", "class", "Leg", "leg_", "a.b", "Width"]
    found = identifiers(Model(boards=tuple(board(rectangle(50, 40), n) for n in names)))
    assert found == ["board_line", "board_2nd_shelf", "board_class", "leg", "leg2", "a_b", "board_width"]
    assert all(n.isidentifier() for n in found)


def test_same_bytes_and_stamp(tmp_path):
    (tmp_path / "b").mkdir()
    assert program(stool(), tmp_path) == program(stool(), tmp_path / "b")
    stamped = export(stool(), tmp_path, ExportOptions(unverified=True))[0].read_text()
    assert "NOT VERIFIED" in stamped.splitlines()[0]
    with pytest.raises(ExportError, match="at least one board"):
        export(Model(), tmp_path, ExportOptions())
