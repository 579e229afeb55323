"""How snugly boards meet: gap, overlap and area of every contact, measured on the solids' faces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.solid.faces import FlatFace, Shape, plane_axes

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

__all__ = ["Meeting", "interface_polygons", "meet", "touching"]

LEAST_AREA = 0.01  # mm2; less is rounding along a shared edge,
LEAST_SHARE = 2e-6  # as is less of the smaller face where that is smaller still


@dataclass(frozen=True)
class Meeting:
    """What two boards share on a plane: area in mm2, the widest gap and the deepest overlap in mm, both >= 0."""

    area: float
    gap: float
    overlap: float


def meet(a: Shape, b: Shape, normal: np.ndarray, reach: float, tilt: float) -> Meeting | None:
    """Measure where faces of `a` that look along the normal face those of `b` that look back.

    Parameters
    ----------
    a, b : shapes in one frame
    normal : (3,) from a to b
    reach : faces further apart than this (mm) do not meet
    tilt : radians by which the faces may turn from the normal

    Returns
    -------
    None where nothing meets.
    """
    axes = plane_axes(normal)
    origin = a.points[0]
    found = [m for fa, fb in _facing(a, b, normal, tilt) if (m := _pair(fa, fb, origin, normal, axes, reach))]
    if not found:
        return None
    return Meeting(sum(m.area for m in found), max(m.gap for m in found), max(m.overlap for m in found))


def _facing(a: Shape, b: Shape, normal: np.ndarray, tilt: float) -> Iterator[tuple[FlatFace, FlatFace]]:
    least = np.cos(tilt)
    ahead = [f for f in a.faces if f.normal @ normal >= least]
    back = [f for f in b.faces if f.normal @ normal <= -least]
    return product(ahead, back)


def _pair(
    fa: FlatFace, fb: FlatFace, origin: np.ndarray, normal: np.ndarray, axes: np.ndarray, reach: float
) -> Meeting | None:
    """Two faces: the overlap of their projections, and their distance at its corners."""
    if not _near(fa, fb, normal, reach):
        return None
    areas = fa.polygon(origin, axes), fb.polygon(origin, axes)
    shared = areas[0].intersection(areas[1])
    if shared.area < min(LEAST_AREA, LEAST_SHARE * min(a.area for a in areas)):
        return None
    corners = origin + _corners(shared) @ axes
    distance = _height(fb, corners, normal) - _height(fa, corners, normal)
    if np.abs(distance).min() > reach:
        return None
    return Meeting(shared.area, max(0.0, float(distance.max())), max(0.0, float(-distance.min())))


def _near(fa: FlatFace, fb: FlatFace, normal: np.ndarray, reach: float) -> bool:
    """Whether the faces' ranges along the normal come within reach."""
    along_a, along_b = fa.rings[0] @ normal, fb.rings[0] @ normal
    return bool(along_b.min() - along_a.max() <= reach and along_a.min() - along_b.max() <= reach)


def _height(face: FlatFace, points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """How far along the normal the face's plane lies from the points, (N,)."""
    return (face.offset - points @ face.normal) / (normal @ face.normal)


def _corners(shape: BaseGeometry) -> np.ndarray:
    """Corners (N, 2) of the areas of a geometry."""
    import shapely

    areas = [part for part in shapely.get_parts(shape) if part.area > 0]
    return np.concatenate([shapely.get_coordinates(part) for part in areas])


def touching(a: Shape, b: Shape, reach: float, tilt: float, least_area: float) -> Meeting | None:
    """The largest meeting of two boards on any of the first one's faces; None below the least area."""
    meetings = (meet(a, b, normal, reach, tilt) for normal in _directions(a, tilt))
    return max((m for m in meetings if m and m.area >= least_area), key=lambda m: m.area, default=None)


def _directions(shape: Shape, tilt: float) -> list[np.ndarray]:
    """Normals of the shape's faces, each direction once."""
    kept: list[np.ndarray] = []
    for face in shape.faces:
        if not any(face.normal @ other > np.cos(tilt) for other in kept):
            kept.append(face.normal)
    return kept


def interface_polygons(a: Shape, b: Shape, normal: np.ndarray, reach: float, tilt: float) -> list[np.ndarray]:
    """Outlines (N, 3) of where faces of two boards meet, on the face of `a`, counter-clockwise about the normal.

    Parameters as for `meet`; an interface with a hole gives its outer outline.
    """
    import shapely

    axes, origin = plane_axes(normal), a.points[0]
    outlines: list[np.ndarray] = []
    for fa, fb in _facing(a, b, normal, tilt):
        if _pair(fa, fb, origin, normal, axes, reach) is None:
            continue
        for part in shapely.get_parts(fa.polygon(origin, axes).intersection(fb.polygon(origin, axes))):
            if part.area >= LEAST_AREA:
                ring = shapely.get_coordinates(shapely.orient_polygons(part).exterior)[:-1]
                flat = origin + ring @ axes
                outlines.append(flat + np.outer(_height(fa, flat, normal), normal))
    return outlines
