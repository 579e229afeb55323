"""What a generated build123d program says of boards; its source is written into every program."""

from __future__ import annotations

from dataclasses import dataclass

from build123d import Edge, Face, Location, Plane, Shell, Solid, Vector, Wire
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.GeomConvert import GeomConvert

__all__ = [
    "Sheet", "arc", "behind", "bezier", "board", "circle", "largest", "line", "off", "on", "squared", "stretched",
]  # fmt: skip


# --- begin ---
@dataclass(frozen=True)
class Sheet:
    """The two faces of a board: x and y run in its plane; `below` of its thickness lies under its origin."""

    origin: Vector
    x: Vector
    y: Vector
    thickness: float
    below: float

    @property
    def normal(self) -> Vector:
        return self.x.cross(self.y).normalized()

    @property
    def bottom(self) -> Plane:
        """The face that looks against the normal."""
        return Plane(self.origin - self.normal * (self.below * self.thickness), z_dir=-self.normal)

    @property
    def top(self) -> Plane:
        return Plane(self.origin + self.normal * ((1 - self.below) * self.thickness), z_dir=self.normal)


def stretched(vector, factors) -> Vector:
    """A place or a direction of the drawing in an object of another width, depth and height."""
    return Vector(*(a * b for a, b in zip(vector, factors, strict=True)))


def on(plane: Plane, place: Vector) -> Vector:
    """The place moved square onto a face."""
    return place - plane.z_dir * (place - plane.origin).dot(plane.z_dir)


def squared(plane: Plane, sheet: Sheet) -> Plane:
    """The face, square to the sheet if it all but is: by a few micrometres, and OCCT fails at slants that small."""
    slant = plane.z_dir.dot(sheet.normal)
    if abs(slant) > 4e-4:
        return plane
    middle = sheet.origin + sheet.normal * ((0.5 - sheet.below) * sheet.thickness)
    return Plane(on(plane, middle), z_dir=plane.z_dir - sheet.normal * slant)


def behind(plane: Plane, place: Vector, reach: float) -> Solid:
    """All that lies behind a face, as far as it matters: a block beside the place."""
    back = Plane(on(plane, place), z_dir=-plane.z_dir)
    corner = back.origin - (back.x_dir + back.y_dir) * reach
    return Solid.make_box(2 * reach, 2 * reach, reach, Plane(corner, x_dir=back.x_dir, z_dir=back.z_dir))


def line(*end):
    return lambda start, at: Edge.make_line(at(start), at(end)), end


def arc(middle, end):
    return lambda start, at: Edge.make_three_point_arc(at(start), at(middle), at(end)), end


def bezier(first, second, end):
    return lambda start, at: spline(*(at(p) for p in (start, first, second, end))), end


def spline(*poles) -> Edge:
    """A Bezier curve in the form of a B-spline: OCCT cannot check solids with sides swept by Bezier curves."""
    curve = BRep_Tool.Curve_s(Edge.make_bezier(*poles).wrapped, 0.0, 1.0)
    return Edge(BRepBuilderAPI_MakeEdge(GeomConvert.CurveToBSplineCurve_s(curve)).Edge())


def circle(centre, radius):
    return lambda start, at: Edge.make_circle(radius, Plane(at(centre))), None


def wire(start, segments, at) -> Wire:
    edges = []
    for make, end in segments:
        edges.append(make(start, at))
        start = end
    return Wire(edges)


def board(sheet, size, drawn, outline, holes=(), lies_on=(), bevels=()) -> Solid:
    """Cut a board.

    sheet: where its faces are; size: its length and width; drawn: the length and width that the outline is drawn in;
    outline, holes: a starting point and the segments from there; lies_on: faces that it ends on, looking towards it;
    bevels: bodies to take away, each given by the corners of its faces.
    """

    def at(point):
        return Vector(point[0] * size[0] / drawn[0], point[1] * size[1] / drawn[1], *point[2:])

    face = Face(wire(*outline, at), [wire(*hole, at) for hole in holes])
    place = Plane(sheet.origin - sheet.normal * (sheet.below * sheet.thickness), x_dir=sheet.x, z_dir=sheet.normal)
    solid = Solid.extrude(face, Vector(0, 0, sheet.thickness))
    for corners in bevels:
        rings = [Wire.make_polygon([at(p) for p in ring], close=True) for ring in corners]
        solid = solid.cut(Solid(Shell([Face(ring) for ring in rings]))).solid()
    solid = solid.moved(place.location)
    for plane in lies_on:
        solid = largest(solid.cut(behind(squared(plane, sheet), sheet.origin, 2 * sum(size))))
    return solid.clean()


def largest(cut) -> Solid:
    return max(cut.solids(), key=lambda piece: piece.volume)


def off(solid, other, sheet, gap=0.1) -> Solid:
    """The board as it is, unless it runs into the other: then without what that fills, and the gap round it."""
    if solid.volume - solid.cut(other).volume < 0.1:  # mm3, rounding
        return solid
    for axis in (sheet.x, sheet.y, sheet.normal):
        for step in (gap, -gap):
            solid = largest(solid.cut(other.moved(Location(axis * step))))
    return solid.clean()


# --- end ---
