"""DXF, one file a board: closed polylines with bulges, circles, layers by operation, millimetres or inches."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from kerfwright.errors import ExportError
from kerfwright.model import Arc, Bezier, Circle, Edge, Loop, Model
from kerfwright.model.geometry import arc_bulge
from kerfwright.model.io import write_bytes
from kerfwright_exporters.drawing import Cut, Drawing, board_drawing
from kerfwright_exporters.layers import layer_colour, layer_name
from kerfwright_exporters.naming import file_stems
from kerfwright_exporters.options import ExportOptions

__all__ = ["add_drawing", "dxf_bytes", "export", "new_document"]


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `parts/<board>.dxf` for every board.

    Raises
    ------
    ExportError
        If a drawing does not pass ezdxf's audit.
    OutputError
        If the folder cannot be written.
    """
    folder = Path(out_dir) / "parts"
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for board, stem in zip(model.boards, file_stems(model), strict=True):
        document = new_document(options)
        add_drawing(document, board_drawing(board, options), options)
        paths.append(folder / f"{stem}.dxf")
        write_bytes(paths[-1], dxf_bytes(document, str(paths[-1])))
    return paths


def new_document(options: ExportOptions) -> Any:
    """An empty R2010 drawing in the units of the options."""
    import ezdxf
    from ezdxf import units

    with _no_time_stamps():
        document = ezdxf.new("R2010")
    document.units = units.IN if options.units == "in" else units.MM
    document.header["$MEASUREMENT"] = 0 if options.units == "in" else 1
    return document


def add_drawing(document: Any, drawing: Drawing, options: ExportOptions) -> None:
    """Draw one board; layers are made as they are needed."""
    space, scale = document.modelspace(), 1 / options.per_unit

    def layer(operation: str, **details: float) -> dict[str, str]:
        name = layer_name(operation, options, **details)
        if name not in document.layers:
            document.layers.add(name, color=layer_colour(operation))
        return {"layer": name}

    for cut in drawing.cuts:
        _add_cut(space, cut, scale, layer(cut.operation, depth=cut.depth))
    for bevel in drawing.bevels:
        ends = (np.array(p) * scale for p in (bevel.start, bevel.end))
        space.add_line(*ends, dxfattribs=layer("bevel", angle=bevel.angle))
    for text in drawing.texts:
        attributes = layer(text.operation, angle=0.0) if text.operation != "bevel" else layer("label")
        _add_text(space, text, scale, attributes)


def _add_text(space: Any, text: Any, scale: float, attributes: dict[str, str]) -> None:
    from ezdxf.enums import TextEntityAlignment

    entity = space.add_text(
        text.text, height=text.height * scale, rotation=float(np.degrees(text.turn)), dxfattribs=attributes
    )
    entity.set_placement(np.array(text.at) * scale, align=TextEntityAlignment.MIDDLE_CENTER)


def _add_cut(space: Any, cut: Cut, scale: float, attributes: dict[str, str]) -> None:
    first = cut.loop.edges[0]
    if isinstance(first, Circle):
        space.add_circle(np.array(first.centre) * scale, first.radius * scale, dxfattribs=attributes)
    elif any(isinstance(edge, Bezier) for edge in cut.loop.edges):
        _add_chain(space, cut.loop, scale, attributes)
    else:
        rows = [_vertex(edge, scale) for edge in cut.loop.edges]
        space.add_lwpolyline(rows, format="xyb", close=True, dxfattribs=attributes)


def _vertex(edge: Edge, scale: float) -> tuple[float, float, float]:
    return (edge.start[0] * scale, edge.start[1] * scale, arc_bulge(edge) if isinstance(edge, Arc) else 0.0)


def _add_chain(space: Any, loop: Loop, scale: float, attributes: dict[str, str]) -> None:
    """A loop with splines as a chain of entities: no closed one of DXF mixes splines with lines and arcs."""
    for run in _runs(loop):
        if isinstance(run[0], Bezier):
            points = [np.array(p) * scale for p in (run[0].start, run[0].control_1, run[0].control_2, run[0].end)]
            space.add_open_spline([(*p, 0.0) for p in points], degree=3, dxfattribs=attributes)
        else:
            end = (run[-1].end[0] * scale, run[-1].end[1] * scale, 0.0)
            space.add_lwpolyline([*(_vertex(e, scale) for e in run), end], format="xyb", dxfattribs=attributes)


def _runs(loop: Loop) -> Iterator[list[Edge]]:
    """Every Bezier for itself, and the lines and arcs between two of them together."""
    run: list[Edge] = []
    for edge in loop.edges:
        if isinstance(edge, Bezier):
            if run:
                yield run
            yield [edge]
            run = []
        else:
            run.append(edge)
    if run:
        yield run


def dxf_bytes(document: Any, name: str) -> bytes:
    """The drawing as the bytes of a file, without time stamps.

    Raises
    ------
    ExportError
        If ezdxf's audit finds a fault.
    """
    _show_all(document)
    _name_classes(document)
    auditor = document.audit()
    if auditor.has_errors or auditor.has_fixes:
        faults = "; ".join(str(e.message) for e in (*auditor.errors, *auditor.fixes))
        raise ExportError(f"{name}: {faults}: the drawing does not pass its audit: report this as a bug")
    stream = io.StringIO()
    with _no_time_stamps():
        document.write(stream)
    return stream.getvalue().encode(document.output_encoding, errors="dxfreplace")


def _show_all(document: Any) -> None:
    """Let viewers open on the whole drawing."""
    from ezdxf import bbox, zoom

    space = document.modelspace()
    cuts = [entity for entity in space if entity.dxftype() != "TEXT"]  # texts are as wide as the fonts of the machine
    box = bbox.extents(cuts, fast=True)
    if box.has_data:
        space.reset_extents(box.extmin, box.extmax)
        zoom.window(space, box.extmin, box.extmax)


def _name_classes(document: Any) -> None:
    """Register the classes in order: ezdxf's own writer takes them out of a set, another order in each process."""
    for dxftype in sorted(document.entitydb.dxf_types_in_use()):
        document.classes.add_class(dxftype)


@contextmanager
def _no_time_stamps() -> Iterator[None]:
    """The same drawing gives the same bytes: ezdxf's own switch, turned back afterwards."""
    import ezdxf

    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
