"""Cut sheets: the boards laid on stock sheets, a set for each thickness, as DXF, SVG and a PDF drawn to scale.

`sheets/sheets.json` says where every board lies and how much of the sheets is used.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from kerfwright.errors import ExportError
from kerfwright.model import Line, Loop, Model
from kerfwright.model.io import write_bytes
from kerfwright_exporters.cutlist import length_text
from kerfwright_exporters.dimensions import OUTSIDE, sheet_dimensions
from kerfwright_exporters.drawing import Drawing, Text, board_drawing, cutting_path, moved_drawing, outline_polygon
from kerfwright_exporters.dxf import add_drawing, dxf_bytes, new_document
from kerfwright_exporters.layers import layer_colour, layer_name
from kerfwright_exporters.naming import STAMP, file_stems, plain_name
from kerfwright_exporters.nesting import NestOptions, Place, nest
from kerfwright_exporters.options import ExportOptions
from kerfwright_exporters.pdf import sheet_scale, sheets_pdf
from kerfwright_exporters.svg import dimension_elements, drawing_elements, svg_document

__all__ = ["LaidBoard", "Sheet", "export", "lay_sheets"]

SAME_STOCK = 0.05  # mm; boards whose thickness differs by less come from one sheet
SNUG = 1e-6  # mm of rounding that two boards may be closer than the spacing


@dataclass(frozen=True)
class LaidBoard:
    """A board on a sheet: its drawing in the sheet's frame, its size in its own."""

    name: str
    stem: str  # of its own files
    drawing: Drawing
    size: tuple[float, float]
    area: float


@dataclass(frozen=True)
class Sheet:
    """One stock sheet: lower left corner at the origin, the grain along x."""

    name: str
    thickness: float
    length: float
    width: float
    boards: tuple[LaidBoard, ...]

    @property
    def utilisation(self) -> float:
        """Share of the sheet's area that becomes boards."""
        return sum(board.area for board in self.boards) / (self.length * self.width)


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `sheets/<stock>-<n>.dxf` and `.svg`, `sheets/sheets.pdf` and `sheets/sheets.json`.

    Raises
    ------
    ExportError
        If a board is larger than a sheet.
    """
    folder = Path(out_dir) / "sheets"
    folder.mkdir(parents=True, exist_ok=True)
    sheets = lay_sheets(model, options)
    paths = []
    for sheet in sheets:
        paths += [folder / f"{sheet.name}.dxf", folder / f"{sheet.name}.svg"]
        write_bytes(paths[-2], _dxf(sheet, options, str(paths[-2])))
        write_bytes(paths[-1], _svg(sheet, options))
    paths += [folder / "sheets.pdf", folder / "sheets.json"]
    write_bytes(paths[-2], sheets_pdf(model, sheets, options))
    write_bytes(paths[-1], (json.dumps(_summary(sheets, options), indent=1) + "\n").encode("utf-8"))
    return paths


def lay_sheets(model: Model, options: ExportOptions) -> list[Sheet]:
    """All sheets, the thickest stock first."""
    groups: dict[float, list[int]] = {}
    for k, board in enumerate(model.boards):
        near = [t for t in groups if abs(t - board.thickness.value) <= SAME_STOCK]
        groups.setdefault(near[0] if near else board.thickness.value, []).append(k)
    return [sheet for t in sorted(groups, reverse=True) for sheet in _sheets_of(model, groups[t], t, options)]


def _sheets_of(model: Model, numbers: list[int], thickness: float, options: ExportOptions) -> list[Sheet]:
    boards, stems = [model.boards[k] for k in numbers], [file_stems(model)[k] for k in numbers]
    outlines = [outline_polygon(cutting_path(board, options)) for board in boards]
    places = _nested(outlines, [board.name for board in boards], options)
    laid: dict[int, list[LaidBoard]] = {}
    for board, stem, outline, place in zip(boards, stems, outlines, places, strict=True):
        drawing = moved_drawing(board_drawing(board, options), _matrix(place, options.sheet_margin))
        size = tuple(float(x) for x in np.ptp(np.array(outline.exterior.coords), axis=0))
        laid.setdefault(place.sheet, []).append(LaidBoard(plain_name(board.name), stem, drawing, size, outline.area))
    stock = f"{thickness:.1f}mm"
    return [
        Sheet(f"{stock}-{k + 1}", thickness, options.sheet_length, options.sheet_width, tuple(laid[k]))
        for k in sorted(laid)
    ]


def _nested(outlines: list, names: list[str], options: ExportOptions) -> list[Place]:
    """Places on the usable part of the sheet, proved not to overlap."""
    length = options.sheet_length - 2 * options.sheet_margin
    width = options.sheet_width - 2 * options.sheet_margin
    spacing = max(options.spacing, options.kerf)
    turns = (0, 180) if options.grain else (0, 90, 180, 270)
    try:
        places = nest(outlines, NestOptions(length, width, spacing, turns))
    except ValueError as error:
        name = names[error.args[0]]
        raise ExportError(
            f"board {name!r}: sheets: does not fit {length:g} x {width:g} mm: give larger sheets or less margin"
        ) from error
    _prove(outlines, names, places, (length, width), spacing)
    return places


def _prove(outlines: list, names: list[str], places: list[Place], usable: tuple[float, float], spacing: float) -> None:
    """What is on one sheet must keep its distance and stay on it."""
    import shapely
    from shapely import affinity

    laid = [
        affinity.translate(affinity.rotate(outline, place.turn, origin=(0, 0)), *place.shift)
        for outline, place in zip(outlines, places, strict=True)
    ]
    room = shapely.box(-SNUG, -SNUG, usable[0] + SNUG, usable[1] + SNUG)
    for name, outline in zip(names, laid, strict=True):
        if not room.covers(outline):
            raise ExportError(f"board {name!r}: sheets: lies over the border: report this as a bug")
    for a, b in combinations(range(len(laid)), 2):
        if places[a].sheet == places[b].sheet and laid[a].distance(laid[b]) < spacing - SNUG:
            raise ExportError(f"boards {names[a]!r} and {names[b]!r}: sheets: lie too close: report this as a bug")


def _matrix(place: Place, margin: float) -> np.ndarray:
    """(2, 3): x_in_sheet from x_in_board."""
    turn = np.radians(place.turn)
    c, s = round(np.cos(turn), 12), round(np.sin(turn), 12)
    return np.array([[c, -s, place.shift[0] + margin], [s, c, place.shift[1] + margin]])


def sheet_loop(sheet: Sheet) -> Loop:
    """The sheet's own outline."""
    corners = [(0.0, 0.0), (sheet.length, 0.0), (sheet.length, sheet.width), (0.0, sheet.width)]
    pairs = zip(corners, [*corners[1:], corners[0]], strict=True)
    return Loop(edges=tuple(Line(start=a, end=b) for a, b in pairs))


def caption(sheet: Sheet, options: ExportOptions) -> str:
    """What a sheet is, for people."""
    size = " x ".join(length_text(v, options) for v in (sheet.length, sheet.width, sheet.thickness))
    return f"{sheet.name}: {size}, {len(sheet.boards)} boards, {100 * sheet.utilisation:.1f} % used"


def _dxf(sheet: Sheet, options: ExportOptions, name: str) -> bytes:
    document = new_document(options)
    layer = layer_name("sheet", options)
    document.layers.add(layer, color=layer_colour("sheet"))
    corners = [np.array(edge.start) / options.per_unit for edge in sheet_loop(sheet).edges]
    document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    for board in sheet.boards:
        add_drawing(document, board.drawing, options)
    _add_dimensions(document, sheet, options)
    title = Text("label", caption(sheet, options), (sheet.length / 2, sheet.width + 30), 20.0)
    add_drawing(document, Drawing((), (), (title,)), options)
    return dxf_bytes(document, name)


def _add_dimensions(document: Any, sheet: Sheet, options: ExportOptions) -> None:
    layer = layer_name("dimension", options)
    document.layers.add(layer, color=layer_colour("dimension"))
    for dimension in sheet_dimensions(sheet, sheet_scale(sheet), options):
        for ends in dimension.lines:
            document.modelspace().add_line(*(p / options.per_unit for p in ends), dxfattribs={"layer": layer})
        text = Text("dimension", dimension.text, dimension.at, dimension.height, dimension.turn)
        add_drawing(document, Drawing((), (), (text,)), options)


def _svg(sheet: Sheet, options: ExportOptions) -> bytes:
    scale = 1 / options.per_unit
    border = (
        f'<rect x="0" y="{-sheet.width * scale:.4f}" width="{sheet.length * scale:.4f}" '
        f'height="{sheet.width * scale:.4f}" fill="none" stroke="#7F7F7F" stroke-width="{scale:.4f}"/>'
    )
    elements = [border, *(e for board in sheet.boards for e in drawing_elements(board.drawing, options))]
    elements += [
        e for d in sheet_dimensions(sheet, sheet_scale(sheet), options) for e in dimension_elements(d, options)
    ]
    rim = 2 * OUTSIDE * sheet_scale(sheet)  # for the sheet's own dimensions
    box = (np.array([-rim, -rim]), np.array([sheet.length + rim, sheet.width + rim]))
    return svg_document(elements, box, options)


def _summary(sheets: list[Sheet], options: ExportOptions) -> dict[str, object]:
    """Utilisation of each sheet and of all of them."""
    area = sum(sheet.length * sheet.width for sheet in sheets)
    used = sum(board.area for sheet in sheets for board in sheet.boards)
    rows = [
        {
            "name": sheet.name,
            "thickness": sheet.thickness,
            "length": sheet.length,
            "width": sheet.width,
            "utilisation": round(sheet.utilisation, 4),
            "boards": [board.name for board in sheet.boards],
        }
        for sheet in sheets
    ]
    stamp = {"stamp": STAMP} if options.unverified else {}
    return {**stamp, "utilisation": round(used / area, 4) if area else 0.0, "sheets": rows}
