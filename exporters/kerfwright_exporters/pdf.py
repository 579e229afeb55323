"""Cut sheets as a PDF: one page a sheet, drawn to a round scale, with names, sizes and dimension lines."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from kerfwright.model import Model
from kerfwright.model.geometry import sample_loop
from kerfwright_exporters.cutlist import length_text
from kerfwright_exporters.dimensions import LEAST_HEIGHT, Dimension, laid_polygon, sheet_dimensions
from kerfwright_exporters.drawing import text_room, upright
from kerfwright_exporters.naming import STAMP, ascii_name, title
from kerfwright_exporters.options import ExportOptions

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from kerfwright_exporters.drawing import Text
    from kerfwright_exporters.sheets import LaidBoard, Sheet

__all__ = ["label_room", "sheet_scale", "sheets_pdf"]

PAGE = (297.0, 210.0)  # A4 across, mm
BORDER, HEAD = 12.0, 16.0  # mm round the drawing, and for the title above it
LABEL_HEIGHTS = (3.0, 2.5, 2.1, 1.8, 1.5, 1.2, 1.0, 0.8)  # mm of paper, the largest that fits is taken
SCALES = (1, 2, 5, 10, 20, 25, 50, 100)
_COLOURS = {"outside": (0, 0, 0), "inside": (0, 0, 0.8), "bevel": (0.8, 0, 0)}


def sheets_pdf(model: Model, sheets: list[Sheet], options: ExportOptions) -> bytes:
    """The bytes of the file; the same sheets give the same bytes."""
    from reportlab.lib.units import mm
    from reportlab.pdfgen.canvas import Canvas

    stream = io.BytesIO()
    canvas = Canvas(stream, pagesize=(PAGE[0] * mm, PAGE[1] * mm), invariant=1)
    canvas.setTitle(f"Cut sheets: {title(model, options.unverified)}")
    for sheet in sheets:
        canvas.scale(mm, mm)
        _page(canvas, model, sheet, options)
        canvas.showPage()
    canvas.save()
    return stream.getvalue()


def _page(canvas: Any, model: Model, sheet: Sheet, options: ExportOptions) -> None:
    import shapely

    from kerfwright_exporters.sheets import caption

    scale = sheet_scale(sheet)
    canvas.setFont("Helvetica-Bold", 4.5)
    canvas.drawString(BORDER, PAGE[1] - BORDER, _shown(title(model, False), ascii_name(model.name)))
    canvas.setFont("Helvetica", 3.5)
    canvas.drawString(BORDER, PAGE[1] - BORDER - 6, f"{caption(sheet, options)}. Scale 1:{scale}. Grain runs across.")
    if options.unverified:
        canvas.setFillColorRGB(0.8, 0, 0)
        canvas.drawRightString(PAGE[0] - BORDER, PAGE[1] - BORDER, STAMP)
        canvas.setFillColorRGB(0, 0, 0)
    canvas.translate(BORDER, BORDER)
    canvas.setLineWidth(0.25)
    canvas.setStrokeColorRGB(0.5, 0.5, 0.5)
    canvas.rect(0, 0, sheet.length / scale, sheet.width / scale)
    dimensions = list(sheet_dimensions(sheet, scale, options))
    for dimension in dimensions:
        _dimension(canvas, dimension, scale)
    taken = shapely.union_all([dimension.room for dimension in dimensions])
    for board in sheet.boards:
        _board(canvas, board, taken, scale, options)


def _dimension(canvas: Any, dimension: Dimension, scale: int) -> None:
    canvas.setLineWidth(0.1)
    canvas.setStrokeColorRGB(0.35, 0.35, 0.35)
    for start, end in dimension.lines:
        canvas.line(*(np.concatenate([start, end]) / scale))
    _text(canvas, dimension.text, np.array(dimension.at) / scale, dimension.height / scale, dimension.turn)


def sheet_scale(sheet: Sheet) -> int:
    """The first round scale at which the sheet fits the page."""
    room = (PAGE[0] - 2 * BORDER, PAGE[1] - 2 * BORDER - HEAD)
    needed = max(sheet.length / room[0], sheet.width / room[1])
    return next((s for s in SCALES if s >= needed), SCALES[-1])


def _board(canvas: Any, board: LaidBoard, taken: BaseGeometry, scale: int, options: ExportOptions) -> None:
    canvas.setLineWidth(0.2)
    for cut in board.drawing.cuts:
        if cut.operation in _COLOURS:
            canvas.setStrokeColorRGB(*_COLOURS[cut.operation])
            _outline(canvas, sample_loop(cut.loop, 0.02 * scale) / scale)
    canvas.setStrokeColorRGB(*_COLOURS["bevel"])
    for bevel in board.drawing.bevels:
        canvas.line(*(np.array([*bevel.start, *bevel.end]) / scale))
    for text in board.drawing.texts:
        if text.operation == "label":
            _label(canvas, board, text, laid_polygon(board).difference(taken), scale, options)
        elif text.operation == "bevel":
            _text(canvas, text.text, np.array(text.at) / scale, max(LEAST_HEIGHT, text.height / scale), text.turn)


def _outline(canvas: Any, points: np.ndarray) -> None:
    path = canvas.beginPath()
    path.moveTo(*points[0])
    for point in points[1:]:
        path.lineTo(*point)
    path.close()
    canvas.drawPath(path)


def _label(canvas: Any, board: LaidBoard, text: Text, free: BaseGeometry, scale: int, options: ExportOptions) -> None:
    """Name and size, one above the other, along the board's longer side as it lies, where it is free."""
    lines = [_shown(board.name, board.stem), " x ".join(length_text(v, options) for v in board.size)]
    turn = text.turn if board.size[0] >= board.size[1] else upright(text.turn + np.pi / 2)
    at, height = label_room(free, lines, turn, scale)
    up = np.array([-np.sin(turn), np.cos(turn)])
    _text(canvas, lines[0], at / scale + 0.65 * height * up, height, turn)
    _text(canvas, lines[1], at / scale - 0.65 * height * up, 0.85 * height, turn)


def label_room(free: BaseGeometry, lines: list[str], turn: float, scale: int) -> tuple[np.ndarray, float]:
    """Where two turned lines of text fit on a board, mm of the board, and their height, mm of paper."""
    from reportlab.pdfbase.pdfmetrics import stringWidth
    from shapely import affinity

    turned = affinity.rotate(free, -turn, origin=(0, 0), use_radians=True)
    width = 0.5 + max(stringWidth(line, "Helvetica", 1) for line in lines)
    (x, y), height = text_room(turned, width, 2.6, [scale * h for h in LABEL_HEIGHTS])
    c, s = np.cos(turn), np.sin(turn)
    return np.array([c * x - s * y, s * x + c * y]), height / scale


def _shown(name: str, otherwise: str) -> str:
    """The name, if the fonts that every PDF reader has can show it."""
    try:
        name.encode("cp1252")
    except UnicodeEncodeError:
        return otherwise
    return name


def _text(canvas: Any, text: str, at: np.ndarray, height: float, turn: float) -> None:
    canvas.saveState()
    canvas.setFont("Helvetica", height)
    canvas.translate(*at)
    canvas.rotate(float(np.degrees(turn)))
    canvas.drawCentredString(0, -0.35 * height, text)
    canvas.restoreState()
