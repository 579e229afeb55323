"""The boards as triangles, for whatever is drawn of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.model import Model

__all__ = ["BoardMesh", "board_meshes"]

CHORD_MM = 0.2  # finer than a pixel of any photograph or screen shows
CHORD_RADIANS = 0.2


@dataclass(frozen=True, eq=False)
class BoardMesh:
    """A board's surface: vertices (N, 3) in the model frame, mm; triangles (M, 3), counter-clockwise from outside."""

    name: str
    vertices: np.ndarray
    triangles: np.ndarray


def board_meshes(model: Model) -> list[BoardMesh]:
    """Triangulate every board of the model, in its order."""
    from kerfwright.solid import assembly_solids

    return [_mesh(name, solid) for name, solid in assembly_solids(model)]


def _mesh(name: str, solid) -> BoardMesh:
    vertices, triangles = solid.tessellate(CHORD_MM, CHORD_RADIANS)
    return BoardMesh(name, np.array([tuple(v) for v in vertices], float), np.array(triangles, int))
