"""A build123d program: one function a board, named dimensions at the top, lengths and bevels from the neighbours."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import numpy as np

from kerfwright.model import Arc, Bezier, Circle, Edge, Loop, Model
from kerfwright_exporters.clearance import close_pairs
from kerfwright_exporters.design import BoardDesign, NeighbourCut, design_boards, model_box
from kerfwright_exporters.naming import STAMP, ascii_labels, ascii_name, plain_name, title
from kerfwright_exporters.options import ExportOptions
from kerfwright_exporters.program import exact, identifiers, number, point, write_program

__all__ = ["export"]


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `model_build123d.py`.

    Raises
    ------
    ExportError
        If the model has no boards.
    """
    return write_program(model, Path(out_dir) / "model_build123d.py", _program(model, options))


def _program(model: Model, options: ExportOptions) -> Iterator[str]:
    designs, names = design_boards(model), identifiers(model)
    yield f'"""{title(model, options.unverified)}, written by kerfwright.'
    yield ""
    yield "Change the dimensions below and run the program: python model_build123d.py writes model_from_script.step."
    yield "Millimetres; x is the width, y the depth, z the height, and the object stands on z = 0."
    yield from ([STAMP + ": the checker found errors in this model."] if options.unverified else [])
    yield '"""'
    yield _library()
    yield from _dimensions(model, designs, names)
    yield from _sheets(designs, names, _stocks(model))
    for design, name in zip(designs, names, strict=True):
        yield from _function(design, name, names)
    yield from _close(model, names)
    yield from _assembly(model, names)


def _library() -> str:
    """The source that every program shares, imports included, without what only kerfwright needs."""
    source = files("kerfwright_exporters").joinpath("_furniture.py").read_text(encoding="utf-8")
    body = source.split("# --- begin ---\n", 1)[1].split("# --- end ---", 1)[0].rstrip()
    head = (
        "from dataclasses import dataclass\n\n"
        "from build123d import Compound, Edge, Face, Location, Plane, Shell, Solid, Vector, Wire, export_step\n"
        "from OCP.BRep import BRep_Tool\n"
        "from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge\n"
        "from OCP.GeomConvert import GeomConvert\n\n\n"
    )
    return head + body


def _stocks(model: Model) -> dict[float, str]:
    """A name for every thickness."""
    found: dict[float, str] = {}
    for value in sorted({board.thickness.value for board in model.boards}, reverse=True):
        name = "STOCK_" + number(round(value, 2)).replace(".", "_")
        taken = sum(other.split("_V")[0] == name for other in found.values())
        found[value] = f"{name}_V{taken + 1}" if taken else name
    return found


def _dimensions(model: Model, designs: list[BoardDesign], names: list[str]) -> Iterator[str]:
    size = np.ptp(model_box(model), axis=0)
    yield "\n\n# The object, over all"
    for label, value in zip(("WIDTH", "DEPTH", "HEIGHT"), size, strict=True):
        yield f"{label} = {number(value)}"
    yield "# Stock"
    yield from (f"{name} = {number(value)}" for value, name in _stocks(model).items())
    yield "\nDRAWN = " + point(size) + "  # the size that the numbers below were taken at: leave it"
    yield "FACTORS = tuple(a / b for a, b in zip((WIDTH, DEPTH, HEIGHT), DRAWN))"
    yield "\n# Boards, along their own x and y axes; give a number to free one from the object's size"
    for design, name in zip(designs, names, strict=True):
        for label, value, axis in (("LENGTH", design.size[0], design.x), ("WIDTH", design.size[1], design.y)):
            yield f"{name.upper()}_{label} = {number(value)} * stretched({exact(axis)}, FACTORS).length"


def _sheets(designs: list[BoardDesign], names: list[str], stocks: dict[float, str]) -> Iterator[str]:
    """Where every board's sheet lies; boards only ever rest on earlier ones."""
    yield "\n\n# Where the boards' sheets lie"
    for k, design in enumerate(designs):
        place = f"stretched({point(design.origin)}, FACTORS)"
        if design.rests_on:
            place = f"on({names[design.rests_on.board].upper()}.{design.rests_on.face}, {place})"
        yield f"{names[k].upper()} = Sheet("
        yield f"    origin={place},"
        yield f"    x=stretched({exact(design.x)}, FACTORS).normalized(),"
        yield f"    y=stretched({exact(design.y)}, FACTORS).normalized(),"
        yield f"    thickness={stocks[design.board.thickness.value]},"
        yield f"    below={number(design.below)},"
        yield ")"


def _function(design: BoardDesign, name: str, names: list[str]) -> Iterator[str]:
    constant = name.upper()
    ends = dict.fromkeys(names[c.board] for c in design.cuts if isinstance(c, NeighbourCut))
    said = f", which ends on {', '.join(ends)}" if ends else ""
    yield f"\n\ndef {name}(length={constant}_LENGTH, width={constant}_WIDTH):"
    yield f'    """{plain_name(design.board.name)}{said}."""'
    yield "    outline = " + _loop(design.outline)
    yield "    holes = [" + ", ".join(_loop(hole) for hole in design.holes) + "]"
    yield "    lies_on = ["
    yield from (f"        {_cut(cut, names)}," for cut in design.cuts)
    yield "    ]"
    yield from _bodies(design)
    bevels = ", bevels" if design.bodies else ""
    yield f"    return board({constant}, (length, width), {point(design.size)}, outline, holes, lies_on{bevels})"


def _bodies(design: BoardDesign) -> Iterator[str]:
    """What bevels take off that cut only a part of the board's breadth."""
    if not design.bodies:
        return
    yield "    bevels = ["
    for body in design.bodies:
        yield "        ["
        yield from (f"            [{', '.join(point(p) for p in face)}]," for face in body)
        yield "        ],"
    yield "    ]"


def _cut(cut: object, names: list[str]) -> str:
    if isinstance(cut, NeighbourCut):
        return f"{names[cut.board].upper()}.{cut.face}"
    # a plane stretched by factors: its normal is stretched by their reciprocals
    normal = f"stretched({exact(cut.normal)}, [1 / f for f in FACTORS])"
    return f"Plane(stretched({point(cut.point)}, FACTORS), z_dir={normal})"


def _loop(loop: Loop) -> str:
    """A starting point and the segments from there."""
    first = loop.edges[0]
    start = first.centre if isinstance(first, Circle) else first.start
    indent = "\n        "
    return f"({point(start)}, [{indent}" + f",{indent}".join(_segment(edge) for edge in loop.edges) + ",\n    ])"


def _segment(edge: Edge) -> str:
    if isinstance(edge, Circle):
        return f"circle({point(edge.centre)}, {number(edge.radius)})"
    if isinstance(edge, Arc):
        return f"arc({point(edge.mid)}, {point(edge.end)})"
    if isinstance(edge, Bezier):
        return f"bezier({point(edge.control_1)}, {point(edge.control_2)}, {point(edge.end)})"
    return f"line({number(edge.end[0])}, {number(edge.end[1])})"


def _close(model: Model, names: list[str]) -> Iterator[str]:
    labels = ascii_labels(model)
    yield "\n\n# Boards near each other that do not touch: should two meet after a change, the first is cut back"
    yield "CLOSE = ["
    for pair in close_pairs(model):
        yield f'    ("{labels[pair.gives_way]}", "{labels[pair.stays]}", {names[pair.stays].upper()}),'
    yield "]"


def _assembly(model: Model, names: list[str]) -> Iterator[str]:
    yield "\n\ndef assembly():"
    yield '    """All boards, named."""'
    yield "    boards = {"
    for label, name in zip(ascii_labels(model), names, strict=True):
        yield f'        "{label}": {name}(),'
    yield "    }"
    yield "    for first, second, sheet in CLOSE:"
    yield "        boards[first] = off(boards[first], boards[second], sheet)"
    yield "    for name, solid in boards.items():"
    yield "        solid.label = name"
    yield f'    return Compound(label="{ascii_name(model.name)}", children=list(boards.values()))'
    yield '\n\nif __name__ == "__main__":'
    yield '    export_step(assembly(), "model_from_script.step")'
