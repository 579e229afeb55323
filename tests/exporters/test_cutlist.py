"""The cut list as a spreadsheet reads it."""

import csv

import pytest

from kerfwright.model import Model
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.cutlist import COLUMNS, export, length_text
from simple import bevel, board, rectangle, stool


def read(path) -> list[dict[str, str]]:
    with open(path, encoding="utf-8-sig", newline="") as stream:
        return list(csv.DictReader(stream, delimiter=";"))


def test_columns_and_quantities(tmp_path):
    model = stool()
    twin = model.boards[2].model_copy(update={"same_as": "leg left"})
    model = model.model_copy(update={"boards": (*model.boards[:2], twin)})
    table, text = export(model, tmp_path, ExportOptions())
    rows = read(table)
    assert tuple(rows[0]) == COLUMNS
    assert [(r["Designation"], r["Quantity"]) for r in rows] == [("top", "1"), ("leg left", "2")]
    assert [rows[1][c] for c in ("Length", "Width", "Thickness")] == ["380.0 mm", "300.0 mm", "18.0 mm"]
    assert rows[1]["Instance names"] == "leg left, leg right"
    assert "| 2 | leg left, leg right | 2 | 380.0 mm | 300.0 mm | 18.0 mm |" in text.read_text()
    assert "3 boards, 0.348 m2" in text.read_text()


def test_mirrored_boards_with_bevels_stand_alone(tmp_path):
    cut = bevel((0, 0), (100, 0), 30)
    boards = (
        board(rectangle(100, 50), "left", bevels=(cut,)),
        board(rectangle(100, 50), "right", bevels=(cut,), same_as="left", mirrored=True),
        board(rectangle(90, 50), "plain"),
        board(rectangle(90, 50), "plain too", same_as="plain", mirrored=True),
    )
    rows = read(export(Model(boards=boards), tmp_path, ExportOptions())[0])
    assert [(r["Designation"], r["Quantity"], r["Description"]) for r in rows] == [
        ("left", "1", "bevels +30.0 deg"),
        ("right", "1", "bevels +30.0 deg; mirror image"),
        ("plain", "2", ""),
    ]


@pytest.mark.parametrize(
    ("mm", "text"), [(25.4, '1"'), (19.05, '3/4"'), (457.2 + 12.7, '18 1/2"'), (0.0, '0"'), (18.0, '45/64"')]
)
def test_inches_are_fractions(mm, text):
    assert length_text(mm, ExportOptions(units="in")) == text


def test_no_cell_is_a_formula(tmp_path):
    boards = (board(rectangle(90, 50), '=HYPERLINK("x")', stock="=1+1", notes=("-2 | @x\nnext",)),)
    table, text = export(Model(boards=boards), tmp_path, ExportOptions(unverified=True))
    (row,) = read(table)
    assert all(not cell.startswith(("=", "+", "-", "@")) for cell in row.values())
    assert "NOT VERIFIED" in row["Description"] and "NOT VERIFIED" in text.read_text()
    assert len([line for line in text.read_text().splitlines() if line.startswith("|")]) == 3
