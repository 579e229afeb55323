"""The flat faces of a solid as polygons: what contacts and separation are measured on.

Booleans of nearly coincident faces are slow and say nothing at a tilt of a twentieth of a degree; polygons projected
on a common plane do.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import build123d
    from shapely.geometry import Polygon

__all__ = ["FlatFace", "Shape", "plane_axes", "shape_of"]

CHORD = 0.005  # mm; half of what a contact may be off


@dataclass(frozen=True, eq=False)
class FlatFace:
    """A flat face: outward unit normal (3,), and rings (N, 3), the outer one first, curves within CHORD of it."""

    normal: np.ndarray
    rings: tuple[np.ndarray, ...]

    @property
    def offset(self) -> float:
        """normal @ x of the face's plane."""
        return float(self.normal @ self.rings[0].mean(axis=0))

    def polygon(self, origin: np.ndarray, axes: np.ndarray) -> Polygon:
        """The face projected along a plane's normal on its two axes (2, 3)."""
        from shapely import make_valid
        from shapely.geometry import Polygon

        rings = [(ring - origin) @ axes.T for ring in self.rings]
        polygon = Polygon(rings[0], rings[1:])
        return polygon if polygon.is_valid else make_valid(polygon)


@dataclass(frozen=True, eq=False)
class Shape:
    """A board's solid in the model frame with what is measured on it."""

    name: str
    solid: build123d.Solid
    faces: tuple[FlatFace, ...]

    @cached_property
    def points(self) -> np.ndarray:
        """Points (N, 3) whose convex hull holds the solid to within CHORD: extruded sides are hulls of their ends."""
        return np.concatenate([ring for face in self.faces for ring in face.rings])

    @cached_property
    def box(self) -> np.ndarray:
        """Lowest and highest corner (2, 3)."""
        return np.stack([self.points.min(axis=0), self.points.max(axis=0)])


def shape_of(name: str, solid: build123d.Solid) -> Shape:
    """A solid with its flat faces."""
    from build123d import GeomType

    faces = [_flat_face(face) for face in solid.faces() if face.geom_type == GeomType.PLANE]
    return Shape(name, solid, tuple(faces))


def _flat_face(face: build123d.Face) -> FlatFace:
    rings = [_ring(wire) for wire in (face.outer_wire(), *face.inner_wires())]
    normal = np.array(tuple(face.normal_at()))
    return FlatFace(normal / np.linalg.norm(normal), tuple(rings))


def _ring(wire: build123d.Wire) -> np.ndarray:
    """Points (N, 3) round a wire, not closed."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.TopAbs import TopAbs_Orientation

    points: list[np.ndarray] = []
    explorer = BRepTools_WireExplorer(wire.wrapped)
    while explorer.More():
        edge = explorer.Current()
        if not BRep_Tool.Degenerated_s(edge):
            chain = _curve_points(BRepAdaptor_Curve(edge))
            backwards = edge.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
            points.append(chain[:0:-1] if backwards else chain[:-1])
        explorer.Next()
    return np.concatenate(points)


def _curve_points(curve: object) -> np.ndarray:
    """Points (N, 3) along an OCCT curve, chords within CHORD."""
    from OCP.GCPnts import GCPnts_QuasiUniformDeflection
    from OCP.GeomAbs import GeomAbs_CurveType

    if curve.GetType() == GeomAbs_CurveType.GeomAbs_Line:
        ends = (curve.Value(curve.FirstParameter()), curve.Value(curve.LastParameter()))
    else:
        sampler = GCPnts_QuasiUniformDeflection(curve, CHORD)
        ends = [sampler.Value(k + 1) for k in range(sampler.NbPoints())]
    return np.array([(p.X(), p.Y(), p.Z()) for p in ends])


def plane_axes(normal: np.ndarray) -> np.ndarray:
    """Two unit axes (2, 3) of the plane with that normal; with it they are right-handed."""
    u = np.cross(np.eye(3)[np.abs(normal).argmin()], normal)
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(normal, u)])
