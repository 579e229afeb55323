"""Contacts computed from geometry alone: faces that coincide.

The typed contacts of a synthetic object are not written down by its family but found here, so that the truth cannot
disagree with the geometry.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from kerfwright.model import Board, Contact, Model, Origin
from kerfwright.model.frames import matrix
from kerfwright.synthetic.meshes import face_normals, mesh_in_model, plane_basis

__all__ = ["PlaneFace", "find_contacts", "plane_faces"]

COPLANAR_MM = 0.02  # two faces this near are one plane; synthetic boards touch exactly but for rounding
OPPOSED = -1 + 1e-6  # cosine of their normals
LEAST_AREA = 15.0  # mm2; what ../shared/tools/score.py takes for a contact


@dataclass(frozen=True, eq=False)
class PlaneFace:
    """A plane face of a board, model frame: n.x = offset, and its outline on the plane."""

    board: int
    kind: str  # "top", "bottom" or "edge"
    normal: np.ndarray
    offset: float
    triangles: np.ndarray  # (M, 3, 3)

    def outline(self, basis: np.ndarray) -> shapely.Geometry:
        """Its outline in the coordinates of a plane basis (3, 2)."""
        return shapely.union_all(shapely.polygons(self.triangles @ basis))


def plane_faces(index: int, board: Board) -> list[PlaneFace]:
    """The plane faces of a board; narrow facets of curves are faces too."""
    vertices, triangles = mesh_in_model(board)
    normals, areas = face_normals((vertices, triangles))
    keep = areas > 1e-6
    normals, corners = normals[keep], vertices[triangles[keep]]
    offsets = np.einsum("ij,ij->i", normals, corners[:, 0])
    key = np.column_stack([np.round(normals, 5), np.round(offsets, 2)]) + 0.0
    _, first, group = np.unique(key, axis=0, return_index=True, return_inverse=True)
    up = matrix(board.model_from_board)[:3, 2]
    return [
        PlaneFace(index, _kind(normals[f] @ up), normals[f], offsets[f], corners[group == g])
        for g, f in enumerate(first)
    ]


def _kind(cosine: float) -> str:
    return "edge" if abs(cosine) < 0.999 else "top" if cosine > 0 else "bottom"


def find_contacts(model: Model) -> tuple[Contact, ...]:
    """Every pair of boards whose faces coincide over 15 mm2 or more, by its largest interface; sorted by board."""
    faces = [plane_faces(i, b) for i, b in enumerate(model.boards)]
    boxes = [(v.min(0), v.max(0)) for v in (np.concatenate([f.triangles for f in fs]).reshape(-1, 3) for fs in faces)]
    found = []
    for i, j in combinations(range(len(faces)), 2):
        apart = np.maximum(boxes[i][0], boxes[j][0]) - np.minimum(boxes[i][1], boxes[j][1])
        if (apart < COPLANAR_MM).all():
            shared = list(_shared(faces[i], faces[j]))
            if shared:
                found.append(_contact(model, *max(shared, key=lambda s: s[2])[:2]))
    return tuple(found)


def _shared(first: list[PlaneFace], second: list[PlaneFace]) -> Iterator[tuple[PlaneFace, PlaneFace, float]]:
    """Pairs of faces that coincide, and the area they share."""
    for a in first:
        for b in second:
            if a.normal @ b.normal < OPPOSED and abs(a.offset + b.offset) < COPLANAR_MM:
                basis = plane_basis(a.normal)
                common = shapely.intersection(a.outline(basis), b.outline(basis))
                if common.area >= LEAST_AREA:
                    yield a, b, common.area


def _contact(model: Model, a: PlaneFace, b: PlaneFace) -> Contact:
    """The contact of two faces; a sheet comes first, as the paper has it."""
    if a.kind == "edge" and b.kind != "edge":
        a, b = b, a
    basis = plane_basis(a.normal)
    common = shapely.intersection(a.outline(basis), b.outline(basis))
    up = [matrix(model.boards[f.board].model_from_board)[:3, 2] for f in (a, b)]
    polygons = [
        shapely.orient_polygons(p) for p in shapely.get_parts(common) if p.geom_type == "Polygon" and p.area > 1e-3
    ]
    rings = [np.asarray(p.exterior.coords)[:-1] @ basis.T + a.normal * a.offset for p in polygons]
    cosine = min(1.0, abs(float(up[0] @ up[1])))
    return Contact(
        type=_type(a, b, common, basis),
        a=model.boards[a.board].name,
        b=model.boards[b.board].name,
        face_a=a.kind,
        face_b=b.kind,
        point=tuple(map(float, rings[0].mean(axis=0))),
        normal=tuple(map(float, a.normal)),
        interface=tuple(tuple(tuple(map(float, p)) for p in ring) for ring in rings),
        area=float(common.area),
        angle=float(np.degrees(np.arccos(cosine))),
        bevelled=_bevelled(a, up[0]) or _bevelled(b, up[1]),
        origin=Origin.GIVEN,
    )


def _type(a: PlaneFace, b: PlaneFace, common: shapely.Geometry, basis: np.ndarray) -> int:
    """1 to 4 of the paper; a corner (2) is where the interface runs along the rim of the sheet."""
    if a.kind != "edge":
        return 3 if b.kind != "edge" else 2 if _at_rim(a, common, basis) else 1
    return 4


def _at_rim(sheet: PlaneFace, common: shapely.Geometry, basis: np.ndarray) -> bool:
    """Whether the longest side of the interface lies on the sheet's outline."""
    box = np.asarray(common.minimum_rotated_rectangle.exterior.coords)
    longest = np.linalg.norm(np.diff(box, axis=0), axis=1).max()
    rim = shapely.length(shapely.intersection(sheet.outline(basis).exterior.buffer(0.05), common.boundary))
    return bool(rim > 0.9 * longest)


def _bevelled(face: PlaneFace, up: np.ndarray) -> bool:
    return face.kind == "edge" and abs(float(face.normal @ up)) > 1e-3
