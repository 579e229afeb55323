"""SVG, one file a board: real size, layers as groups, and the attributes that a Shaper Origin reads.

What a cut is, is said twice, as Shaper asks: by attributes, and by the fill and stroke that its own programs use.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from kerfwright.model import Arc, Bezier, Circle, Edge, Loop, Model
from kerfwright.model.geometry import arc_circle, sample_loop
from kerfwright.model.io import write_bytes
from kerfwright_exporters.dimensions import Dimension
from kerfwright_exporters.drawing import BevelLine, Cut, Drawing, Text, board_drawing
from kerfwright_exporters.layers import layer_name
from kerfwright_exporters.naming import file_stems
from kerfwright_exporters.options import ExportOptions

__all__ = ["dimension_elements", "drawing_elements", "export", "svg_document"]

SHAPER = "http://www.shapertools.com/namespaces/shaper"
MARGIN = 5.0  # mm of white round the drawing, so that strokes on its border show
_STYLES = {
    "outside": 'fill="black" stroke="black"',
    "inside": 'fill="white" stroke="black"',
    "outside_kerf": 'fill="none" stroke="#7F7F7F"',
    "inside_kerf": 'fill="none" stroke="#7F7F7F"',
}
_CUT_TYPES = {"outside": "outside", "inside": "inside", "outside_kerf": "online", "inside_kerf": "online"}
_TEXT_COLOURS = {"label": "#0068FF", "bevel": "#0068FF", "stamp": "#D00000", "dimension": "#7F7F7F"}


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `parts/<board>.svg` for every board."""
    folder = Path(out_dir) / "parts"
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for board, stem in zip(model.boards, file_stems(model), strict=True):
        drawing = board_drawing(board, options)
        points = np.concatenate([sample_loop(cut.loop, 0.1) for cut in drawing.cuts])
        box = (points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN)
        paths.append(folder / f"{stem}.svg")
        write_bytes(paths[-1], svg_document(list(drawing_elements(drawing, options)), box, options))
    return paths


def svg_document(elements: list[str], box: tuple[np.ndarray, np.ndarray], options: ExportOptions) -> bytes:
    """A whole file; box: lowest and highest corner, mm, y up."""
    (x0, y0), (x1, y1) = (corner / options.per_unit for corner in box)
    width, height = _number(x1 - x0), _number(y1 - y0)
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:shaper="{SHAPER}" version="1.1" '
        f'width="{width}{options.units}" height="{height}{options.units}" '
        f'viewBox="{_number(x0)} {_number(-y1)} {width} {height}">\n'
    )
    return (head + "".join(f"{element}\n" for element in elements) + "</svg>\n").encode("utf-8")


def drawing_elements(drawing: Drawing, options: ExportOptions) -> Iterator[str]:
    """One element a cut, bevel line and text; the outline comes first, so that what lies on it shows."""
    outside_first = sorted(drawing.cuts, key=lambda cut: not cut.operation.startswith("outside"))
    for cut in outside_first:
        yield _cut(cut, options)
    for bevel in drawing.bevels:
        yield _bevel(bevel, options)
    for text in drawing.texts:
        yield _text(text, options)


def _number(value: float) -> str:
    """At most a micrometre, without trailing zeros or minus zero."""
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _at(point: tuple[float, float], options: ExportOptions) -> str:
    """A point of the board as SVG has it: y down, in the file's unit."""
    return f"{_number(point[0] / options.per_unit)} {_number(-point[1] / options.per_unit)}"


def _cut(cut: Cut, options: ExportOptions) -> str:
    layer = layer_name(cut.operation, options, depth=cut.depth)
    depth = f"{_number(cut.depth / options.per_unit)}{options.units}"
    attributes = (
        f"class={quoteattr(layer)} {_STYLES[cut.operation]} stroke-width={quoteattr(_number(0.1 / options.per_unit))} "
        f'shaper:cutType="{_CUT_TYPES[cut.operation]}" shaper:cutDepth="{depth}"'
    )
    first = cut.loop.edges[0]
    if isinstance(first, Circle):
        x, y = _at(first.centre, options).split()
        return f'<circle cx="{x}" cy="{y}" r="{_number(first.radius / options.per_unit)}" {attributes}/>'
    return f'<path d="{_path(cut.loop, options)}" {attributes}/>'


def _path(loop: Loop, options: ExportOptions) -> str:
    start = _at(loop.edges[0].start, options)
    return f"M {start} " + " ".join(_segment(edge, options) for edge in loop.edges) + " Z"


def _segment(edge: Edge, options: ExportOptions) -> str:
    if isinstance(edge, Bezier):
        return "C " + " ".join(_at(p, options) for p in (edge.control_1, edge.control_2, edge.end))
    if isinstance(edge, Arc):
        _, radius, sweep = arc_circle(edge)
        r = _number(radius / options.per_unit)
        # y points down in SVG: what turns left on the board has sweep flag 0
        return f"A {r} {r} 0 {int(abs(sweep) > np.pi)} {int(sweep < 0)} {_at(edge.end, options)}"
    return f"L {_at(edge.end, options)}"


def _bevel(bevel: BevelLine, options: ExportOptions) -> str:
    layer = layer_name("bevel", options, angle=bevel.angle)
    (x1, y1), (x2, y2) = (_at(p, options).split() for p in (bevel.start, bevel.end))
    return (
        f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" class={quoteattr(layer)} stroke="#0068FF" '
        f'stroke-width="{_number(0.5 / options.per_unit)}" shaper:cutType="guide"/>'
    )


def dimension_elements(dimension: Dimension, options: ExportOptions) -> Iterator[str]:
    """The lines of a dimension, which a Shaper takes as guides, and its figure."""
    layer, width = layer_name("dimension", options), _number(0.2 / options.per_unit)
    for ends in dimension.lines:
        (x1, y1), (x2, y2) = (_at(tuple(p), options).split() for p in ends)
        yield (
            f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" class={quoteattr(layer)} stroke="#7F7F7F" '
            f'stroke-width="{width}" shaper:cutType="guide"/>'
        )
    yield _text(Text("dimension", dimension.text, dimension.at, dimension.height, dimension.turn), options)


def _text(text: Text, options: ExportOptions) -> str:
    x, y = _at(text.at, options).split()
    size = text.height / options.per_unit
    turn = f' transform="rotate({_number(-np.degrees(text.turn))} {x} {y})"' if abs(text.turn) > 1e-9 else ""
    return (
        f'<text x="{x}" y="{y}" font-family="sans-serif" font-size="{_number(size)}" text-anchor="middle" '
        f'dominant-baseline="central" fill="{_TEXT_COLOURS[text.operation]}"{turn} shaper:cutType="guide">'
        f"{escape(text.text)}</text>"
    )
