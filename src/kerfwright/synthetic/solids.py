"""OCCT solids of the truth: written apart from `kerfwright.solid`, so that an error there cannot hide in the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kerfwright.model import Arc, Bezier, Board, Circle, Edge, Line, Loop
from kerfwright.model.frames import matrix

if TYPE_CHECKING:
    from build123d import Solid

__all__ = ["truth_solid"]


def truth_solid(board: Board) -> Solid:
    """The board as a solid in the model's frame, millimetres."""
    from build123d import Face, Keep, Plane, Solid, Vector, split

    face = Face(_wire(board.cut_path.outer), [_wire(hole) for hole in board.cut_path.holes])
    if face.normal_at().Z < 0:
        face = -face
    solid = Solid.extrude(face, Vector(0, 0, board.thickness.value))
    for bevel in board.bevels:
        solid = split(solid, bisect_by=Plane(origin=bevel.point, z_dir=bevel.normal), keep=Keep.BOTTOM)
    pose = matrix(board.model_from_board)
    plane = Plane(origin=tuple(pose[:3, 3]), x_dir=tuple(pose[:3, 0]), z_dir=tuple(pose[:3, 2]))
    return (solid if isinstance(solid, Solid) else solid.solid()).moved(plane.location)


def _wire(loop: Loop):
    from build123d import Wire

    return Wire([_edge(e) for e in loop.edges])


def _edge(edge: Edge):
    from build123d import Edge as CadEdge
    from build123d import Plane, Vector

    def at(point) -> Vector:
        return Vector(float(point[0]), float(point[1]), 0)

    if isinstance(edge, Line):
        return CadEdge.make_line(at(edge.start), at(edge.end))
    if isinstance(edge, Arc):
        return CadEdge.make_three_point_arc(at(edge.start), at(edge.mid), at(edge.end))
    if isinstance(edge, Bezier):
        return CadEdge.make_bezier(at(edge.start), at(edge.control_1), at(edge.control_2), at(edge.end))
    assert isinstance(edge, Circle)
    return CadEdge.make_circle(edge.radius, Plane(at(edge.centre)))
