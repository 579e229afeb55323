"""Boards as OCCT solids: sketch, extrude, bevel (paper, section on fabrication-aware geometry).

Solids are derived from the model whenever they are needed and never stored.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kerfwright.errors import ModelError
from kerfwright.model import Arc, Bezier, Board, Circle, Edge, Loop, Model
from kerfwright.model.frames import model_from_board
from kerfwright.solid.bevels import HalfSpace, bevel_bodies, polyhedron_faces

if TYPE_CHECKING:
    import build123d

__all__ = ["assembly_solids", "board_face", "board_solid", "location", "solid_is_valid"]


def assembly_solids(model: Model) -> list[tuple[str, build123d.Solid]]:
    """Name and solid of every board, in the model frame (mm), in the model's order.

    Raises
    ------
    ModelError
        If a board has no solid: see `board_solid`.
    """
    return [(b.name, board_solid(b).moved(location(model_from_board(b)))) for b in model.boards]


def board_solid(board: Board) -> build123d.Solid:
    """The board as one solid with one shell, board frame, mm.

    Raises
    ------
    ModelError
        If the cut path encloses nothing, or the bevels leave nothing or several pieces.
    """
    from build123d import Solid, Vector

    thickness = board.thickness.value
    if thickness <= 0:
        raise ModelError(f"board {board.name!r}: thickness: {thickness:g} mm: give a thickness above 0")
    blank = Solid.extrude(board_face(board), Vector(0, 0, thickness))
    bodies = [convex_solid(body) for body in bevel_bodies(board)]
    return _cut(board, blank, [body for body in bodies if body is not None]) if bodies else blank


def board_face(board: Board) -> build123d.Face:
    """The outline with its holes as a face in z = 0, board frame, its normal +z.

    Raises
    ------
    ModelError
        If OCCT makes no face of the cut path.
    """
    from build123d import Face
    from OCP.Standard import Standard_Failure, Standard_TypeMismatch

    path = board.cut_path
    try:
        face = Face(_wire(path.outer), [_wire(hole) for hole in path.holes])
    except (ValueError, RuntimeError, Standard_Failure, Standard_TypeMismatch) as error:
        raise ModelError(f"board {board.name!r}: cut_path: {error}: no face: redraw the path") from error
    if face.area <= 0:
        raise ModelError(f"board {board.name!r}: cut_path: area {face.area:g} mm2: redraw the path")
    return face


def _wire(loop: Loop) -> build123d.Wire:
    from build123d import Wire

    return Wire([_edge(edge) for edge in _joined(loop)])


def _joined(loop: Loop) -> list[Edge]:
    """The loop's edges with each end exactly on the next start, whatever rounding made of them."""
    if len(loop.edges) == 1:
        return list(loop.edges)
    onward = (*loop.edges[1:], loop.edges[0])
    return [e.model_copy(update={"end": after.start}) for e, after in zip(loop.edges, onward, strict=True)]


def _edge(edge: Edge) -> build123d.Edge:
    from build123d import Edge as OcctEdge
    from build123d import Plane

    if isinstance(edge, Circle):
        return OcctEdge.make_circle(edge.radius, Plane(origin=(*edge.centre, 0)))
    if isinstance(edge, Arc):
        return OcctEdge.make_three_point_arc(edge.start, edge.mid, edge.end)
    if isinstance(edge, Bezier):
        return _spline(edge)
    return OcctEdge.make_line(edge.start, edge.end)


def _spline(edge: Bezier) -> build123d.Edge:
    """The same curve as a B-spline: OCCT gives up checking solids whose sides are swept by Bezier curves."""
    from build123d import Edge as OcctEdge
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.Geom import Geom_BSplineCurve
    from OCP.gp import gp_Pnt
    from OCP.TColgp import TColgp_Array1OfPnt
    from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal

    poles = TColgp_Array1OfPnt(1, 4)
    for k, point in enumerate((edge.start, edge.control_1, edge.control_2, edge.end), start=1):
        poles.SetValue(k, gp_Pnt(*point, 0))
    knots, multiplicities = TColStd_Array1OfReal(1, 2), TColStd_Array1OfInteger(1, 2)
    for k in (1, 2):
        knots.SetValue(k, k - 1.0)
        multiplicities.SetValue(k, 4)
    return OcctEdge(BRepBuilderAPI_MakeEdge(Geom_BSplineCurve(poles, knots, multiplicities, 3)).Edge())


def convex_solid(body: list[HalfSpace]) -> build123d.Solid | None:
    """The solid of a bounded intersection of half-spaces; None where it has no volume."""
    from build123d import Face, Shell, Solid, Vector, Wire

    polygons = polyhedron_faces(body)
    if len(polygons) < 4:
        return None
    faces = [Face(Wire.make_polygon([Vector(*p) for p in polygon], close=True)) for polygon in polygons]
    return Solid(Shell(faces))


def _cut(board: Board, blank: build123d.Solid, bodies: list[build123d.Solid]) -> build123d.Solid:
    """The blank without the bodies, coplanar faces merged."""
    rest = blank.cut(*bodies)
    pieces = rest.solids() if rest is not None else []
    if len(pieces) != 1:
        raise ModelError(
            f"board {board.name!r}: bevels: leave {len(pieces)} pieces of the board: correct the bevels' planes"
        )
    return pieces[0].clean()


def location(target_from_source: np.ndarray) -> build123d.Location:
    """A rigid (4, 4) transform as a build123d location."""
    from build123d import Location
    from OCP.gp import gp_Trsf

    transform = gp_Trsf()
    transform.SetValues(*(float(x) for x in np.asarray(target_from_source)[:3].ravel()))
    return Location(transform)


def solid_is_valid(solid: build123d.Solid, thorough: bool = True) -> bool:
    """Whether OCCT calls the solid valid: its topology and, if thorough, that no face crosses another (to 140 ms)."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Check
    from OCP.BRepCheck import BRepCheck_Analyzer

    shape = solid.wrapped
    if not BRepCheck_Analyzer(shape).IsValid():
        return False
    return not thorough or BRepAlgoAPI_Check(shape, True, True).IsValid()
