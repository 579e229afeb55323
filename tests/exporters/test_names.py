"""Names in letters of any script, and names that no file should have, in every format that carries names."""

import csv
import json
import runpy

import ezdxf
import pytest

from kerfwright.model import Model
from kerfwright_exporters import ExportOptions, export_all, formats
from kerfwright_exporters.naming import ascii_labels, file_stems, plain_name
from simple import board, placed, rectangle

NAMES = ("Rückwand 2", "棚板", "Üç-Łódź", "𠮷野", "plain")


def model() -> Model:
    boards = (board(rectangle(200, 100 + k), n, 18.0, placed(at=(0, 0, 18 * k))) for k, n in enumerate(NAMES))
    return Model(name="Höcker", boards=tuple(boards))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("names")
    export_all(model(), formats(), out, findings=())
    return out


@pytest.mark.parametrize("name", ["model.step", "model_ap214.step"])
def test_step_reads_back_the_letters(folder, name):
    from build123d import import_step

    assert (folder / name).read_bytes().isascii()
    root = import_step(str(folder / name))
    assert root.label == "Höcker" and [c.label for c in root.children] == [n.replace(" ", "_") for n in NAMES]


def test_files_are_ascii_and_told_apart(folder):
    assert file_stems(model()) == ["Ruckwand_2", "board", "Uc-odz", "board-2", "plain"]
    assert {p.stem for p in (folder / "parts").iterdir()} == set(file_stems(model()))


def test_what_is_engraved_is_the_name(folder):
    texts = [t.dxf.text for t in ezdxf.readfile(folder / "parts" / "board.dxf").modelspace().query("TEXT")]
    assert texts == ["棚板"]
    assert "Rückwand 2</text>" in (folder / "parts" / "Ruckwand_2.svg").read_text(encoding="utf-8")


def test_tables_and_meshes_have_the_names(folder):
    with (folder / "cutlist.csv").open(encoding="utf-8-sig", newline="") as stream:
        assert {row["Designation"] for row in csv.DictReader(stream, delimiter=";")} == set(NAMES)
    glb = (folder / "model.glb").read_bytes()
    document = json.loads(glb[20 : 20 + int.from_bytes(glb[12:16], "little")])
    assert [node["name"] for node in document["nodes"]] == ["Höcker", *NAMES]


@pytest.mark.parametrize("program", ["model_build123d.py", "model_cadquery.py"])
def test_programs_run_with_labels_that_their_step_writers_carry(folder, program):
    children = runpy.run_path(str(folder / program), run_name="program")["assembly"]().children
    assert [getattr(c, "label", None) or c.name for c in children] == ascii_labels(model())
    assert "Rückwand 2" in (folder / program).read_text(encoding="utf-8")


def test_sheets_show_what_pdf_fonts_can(folder):
    pdf = (folder / "sheets" / "sheets.pdf").read_bytes()
    assert pdf.startswith(b"%PDF")
    summary = json.loads((folder / "sheets" / "sheets.json").read_text(encoding="utf-8"))
    assert sorted(n for sheet in summary["sheets"] for n in sheet["boards"]) == sorted(NAMES)


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("../up", "_up"),
        ('le"g', "le_g"),
        ("=1+1", "_1_1"),
        ("a\nb", "a_b"),
        ("leg\u202e", "leg_"),
        ("/", "_"),
        ("", "board"),
    ],
)
def test_what_could_mean_something_is_taken_out(name, plain):
    assert plain_name(name) == plain


def test_composed_letters_are_one():
    assert plain_name("Ru\u0308ckwand") == "R\u00fcckwand"
    assert ExportOptions().unverified is False
