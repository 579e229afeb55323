"""The cut list: a CSV in the columns of OpenCutList's export, and a table to read, as Markdown."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from kerfwright.model import Board, Model
from kerfwright.model.geometry import path_area, sample_loop
from kerfwright.model.io import write_bytes
from kerfwright_exporters.naming import STAMP, plain_name, title
from kerfwright_exporters.options import ExportOptions

__all__ = ["Row", "cut_rows", "export", "length_text"]

COLUMNS = (
    "No.", "Designation", "Quantity", "Length - raw", "Width - raw", "Thickness - raw", "Length", "Width", "Thickness",
    "Area - final", "Material type", "Material name", "Instance names", "Description", "Tags",
)  # fmt: skip
FRACTION = 64  # inches are given to the nearest part of so many, as a workshop's rule is divided


@dataclass(frozen=True)
class Row:
    """One line: congruent boards together; lengths in mm, area of one board in mm2."""

    name: str
    boards: tuple[str, ...]
    length: float
    width: float
    thickness: float
    area: float
    material: str
    notes: tuple[str, ...]


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `cutlist.csv` and `cutlist.md`."""
    rows = cut_rows(model, options)
    paths = [Path(out_dir) / "cutlist.csv", Path(out_dir) / "cutlist.md"]
    write_bytes(paths[0], _csv(rows, options).encode("utf-8-sig"))  # the mark makes spreadsheets read UTF-8
    write_bytes(paths[1], _markdown(model, rows, options).encode("utf-8"))
    return paths


def cut_rows(model: Model, options: ExportOptions) -> list[Row]:
    """Rows by thickness, thickest first, then by size, largest first, then by the model's order."""
    groups: dict[tuple[str, bool], list[Board]] = {}
    for board in model.boards:
        # the mirror image of a board with bevels is another board; without, it is the same turned over
        mirrored = board.mirrored and bool(board.bevels)
        groups.setdefault((board.same_as or board.name, mirrored), []).append(board)
    rows = [_row(boards, options) for boards in groups.values()]
    return sorted(rows, key=lambda row: (-round(row.thickness, 3), -round(row.length * row.width)))


def _row(boards: list[Board], options: ExportOptions) -> Row:
    first = boards[0]
    width, length = sorted(np.ptp(sample_loop(first.cut_path.outer), axis=0))
    stock = first.stock or f"sheet {length_text(first.thickness.value, options)}"
    return Row(
        name=plain_name(first.name),
        boards=tuple(plain_name(board.name) for board in boards),
        length=float(length),
        width=float(width),
        thickness=first.thickness.value,
        area=path_area(first.cut_path),
        material=stock,
        notes=tuple(_notes(first)),
    )


def _notes(board: Board) -> list[str]:
    notes = []
    if board.bevels:
        notes.append("bevels " + ", ".join(f"{b.angle.value:+.1f} deg" for b in board.bevels))
    if board.mirrored:
        notes.append("mirror image")
    if board.cut_path.holes:
        count = len(board.cut_path.holes)
        notes.append(f"{count} hole{'s' if count > 1 else ''}")
    return notes + list(board.notes)


def length_text(value: float, options: ExportOptions) -> str:
    """A length for people: tenths of a millimetre, or inches and fractions."""
    if options.units == "mm":
        return f"{value:.1f} mm"
    parts = round(value / 25.4 * FRACTION)
    whole, rest = divmod(parts, FRACTION)
    fraction = Fraction(rest, FRACTION)
    words = [str(whole)] * (whole > 0 or rest == 0) + [f"{fraction.numerator}/{fraction.denominator}"] * (rest > 0)
    return " ".join(words) + '"'


def _csv(rows: list[Row], options: ExportOptions) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, delimiter=";", lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for number, row in enumerate(rows, start=1):
        sizes = [length_text(v, options) for v in (row.length, row.width, row.thickness)]
        description = "; ".join([*row.notes, *([STAMP] if options.unverified else [])])
        cells = (number, row.name, len(row.boards), *sizes, *sizes, f"{row.area / 1e6:.4f} m2", "Sheet good",
                 row.material, ", ".join(row.boards), description, "")  # fmt: skip
        writer.writerow([_harmless(str(cell)) for cell in cells])
    return stream.getvalue()


def _harmless(cell: str) -> str:
    """A cell that no spreadsheet takes for a formula."""
    return f"'{cell}" if cell[:1] in "=+-@\t\r" and cell else cell


def _markdown(model: Model, rows: list[Row], options: ExportOptions) -> str:
    head = ["No.", "Board", "Quantity", "Length", "Width", "Thickness", "Material", "Notes"]
    lines = [f"# Cut list: {title(model, options.unverified)}", "", _line(head), _line(["---"] * len(head))]
    for number, row in enumerate(rows, start=1):
        sizes = [length_text(v, options) for v in (row.length, row.width, row.thickness)]
        names = row.name if len(row.boards) == 1 else ", ".join(row.boards)
        lines.append(_line([str(number), names, str(len(row.boards)), *sizes, row.material, "; ".join(row.notes)]))
    boards = sum(len(row.boards) for row in rows)
    area = sum(row.area * len(row.boards) for row in rows) / 1e6
    return "\n".join([*lines, "", f"{boards} boards, {area:.3f} m2 of sheet.", ""])


def _line(cells: list[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"
