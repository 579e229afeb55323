"""A CadQuery program: the boards as `cq.Assembly`, held together by constraints from the contacts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kerfwright.model import Arc, Bezier, Board, Circle, Contact, Edge, Loop, Model
from kerfwright.model.frames import board_from_model, model_from_board, transform_points, transform_vectors
from kerfwright.solid.bevels import bevel_bodies, polyhedron_faces
from kerfwright.solid.faces import plane_axes
from kerfwright_exporters.naming import STAMP, ascii_labels, ascii_name, board_colours, plain_name, title
from kerfwright_exporters.options import ExportOptions
from kerfwright_exporters.program import exact, identifiers, number, point, write_program

__all__ = ["export"]

_LIBRARY = '''
import cadquery as cq
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.GeomConvert import GeomConvert


def bezier(*poles):
    """A Bezier curve in the form of a B-spline: OCCT cannot check solids with sides swept by Bezier curves."""
    curve = BRep_Tool.Curve_s(cq.Edge.makeBezier(list(poles)).wrapped, 0.0, 1.0)
    return cq.Edge(BRepBuilderAPI_MakeEdge(GeomConvert.CurveToBSplineCurve_s(curve)).Edge())


MAKE = {
    "line": cq.Edge.makeLine,
    "arc": cq.Edge.makeThreePointArc,
    "bezier": bezier,
    "circle": lambda centre, radius: cq.Edge.makeCircle(radius, centre),
}


def wire(segments):
    """A wire of segments: what it is, and its points."""
    place = [[cq.Vector(*p) if isinstance(p, tuple) else p for p in points] for _, *points in segments]
    return cq.Wire.assembleEdges([MAKE[kind](*points) for (kind, *_), points in zip(segments, place)])


def board(thickness, outline, holes=(), bevels=()):
    """The outline extruded, less the bodies that the bevels take off, each given by its faces."""
    face = cq.Face.makeFromWires(wire(outline), [wire(hole) for hole in holes])
    solid = cq.Solid.extrudeLinear(face, cq.Vector(0, 0, thickness))
    for polygons in bevels:
        rings = [cq.Wire.makePolygon([cq.Vector(*p) for p in polygon], close=True) for polygon in polygons]
        faces = [cq.Face.makeFromWires(ring) for ring in rings]
        solid = solid.cut(cq.Solid.makeSolid(cq.Shell.makeShell(faces)))
    return cq.Workplane(obj=solid.clean())


def place(origin, x, normal):
    """Where a board lies."""
    return cq.Location(cq.Plane(origin=origin, xDir=x, normal=normal))


def touch(assembly, a, b, on_a, on_b):
    """Two boards touch: at a point, face to face, and without turning on each other; point, normal and direction."""
    faces = [cq.Face.makePlane(1, 1, cq.Vector(*p), cq.Vector(*n)) for p, n, _ in (on_a, on_b)]
    edges = [cq.Edge.makeLine(cq.Vector(*p), cq.Vector(*p) + cq.Vector(*d)) for p, _, d in (on_a, on_b)]
    assembly.constrain(a, faces[0], b, faces[1], "Plane")
    assembly.constrain(a, edges[0], b, edges[1], "Axis", 0)
'''


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `model_cadquery.py`.

    Raises
    ------
    ExportError
        If the model has no boards.
    """
    return write_program(model, Path(out_dir) / "model_cadquery.py", _program(model, options))


def _program(model: Model, options: ExportOptions) -> Iterator[str]:
    names = identifiers(model)
    yield f'"""{title(model, options.unverified)}, written by kerfwright: run it to write a STEP file."""'
    yield from ([f"# {STAMP}: the checker found errors in this model"] if options.unverified else [])
    yield _LIBRARY.rstrip()
    for board, name in zip(model.boards, names, strict=True):
        yield from _function(board, name)
    yield "\n\nNAMES = (" + " ".join(f'"{label}",' for label in ascii_labels(model)) + ")"
    yield "\n\ndef assembly():"
    yield '    """All boards where their contacts hold them."""'
    yield f'    found = cq.Assembly(name="{ascii_name(model.name)}")'
    for board, name, rgb in zip(model.boards, names, board_colours(model), strict=True):
        yield f'    found.add({name}(), name="{name}", loc={_place(board)}, color=cq.Color{rgb})'
    boards = {board.name: (board, name) for board, name in zip(model.boards, names, strict=True)}
    yield from (f'    found.constrain("{boards[name][1]}", "Fixed")' for name in _fixed(model))
    yield from (line for contact in model.contacts for line in _touch(contact, boards))
    yield from (["    found.solve()"] if model.contacts else [])
    yield "    for child, name in zip(found.children, NAMES):  # not before: constraints take plain letters only"
    yield "        child.name = name"
    yield "    return found"
    yield '\n\nif __name__ == "__main__":'
    yield '    assembly().export("model_from_cadquery.step")'


def _fixed(model: Model) -> list[str]:
    """The first board of every group that contacts hold together: the rest is held by the contacts."""
    groups = [{board.name} for board in model.boards]
    for contact in model.contacts:
        together = [g for g in groups if contact.a in g or contact.b in g]
        groups = [g for g in groups if g not in together] + [set().union(*together)]
    return [next(b.name for b in model.boards if b.name in group) for group in groups]


def _function(board: Board, name: str) -> Iterator[str]:
    yield f"\n\ndef {name}():"
    yield f'    """{plain_name(board.name)}."""'
    yield f"    outline = {_loop(board.cut_path.outer)}"
    yield f"    holes = [{', '.join(_loop(hole) for hole in board.cut_path.holes)}]"
    yield "    bevels = ["
    for body in bevel_bodies(board):
        yield "        ["
        yield from (f"            [{', '.join(point(p) for p in face)}]," for face in polyhedron_faces(body))
        yield "        ],"
    yield "    ]"
    yield f"    return board({number(board.thickness.value)}, outline, holes, bevels)"


def _loop(loop: Loop) -> str:
    return "[\n        " + ",\n        ".join(_segment(edge) for edge in loop.edges) + ",\n    ]"


def _segment(edge: Edge) -> str:
    if isinstance(edge, Circle):
        return f'("circle", {point(edge.centre)}, {number(edge.radius)})'
    points = [edge.start, edge.end]
    if isinstance(edge, Arc):
        points.insert(1, edge.mid)
    elif isinstance(edge, Bezier):
        points[1:1] = [edge.control_1, edge.control_2]
    return f'("{edge.kind}", {", ".join(point(p) for p in points)})'


def _place(board: Board) -> str:
    pose = model_from_board(board)
    return f"place({point(pose[:3, 3])}, {exact(pose[:3, 0])}, {exact(pose[:3, 2])})"


def _touch(contact: Contact, boards: dict[str, tuple[Board, str]]) -> Iterator[str]:
    """The contact in both boards' own frames: a point, the face's outward normal, a direction along it."""
    normal = np.array(contact.normal) / np.linalg.norm(contact.normal)
    along = plane_axes(normal)[0]
    sides = []
    for name, outward in ((contact.a, normal), (contact.b, -normal)):
        pose = board_from_model(boards[name][0])
        vectors = (transform_vectors(pose, v) for v in (outward, along))
        sides.append(f"({point(transform_points(pose, contact.point))}, {', '.join(map(exact, vectors))})")
    yield "    touch("
    yield f'        found, "{boards[contact.a][1]}", "{boards[contact.b][1]}",'
    yield from (f"        {side}," for side in sides)
    yield "    )"
