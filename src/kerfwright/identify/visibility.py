"""Which photographs show a place on a board, given the other boards as obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.capture.types import View
from kerfwright.identify.types import Sheet

__all__ = ["Obstacles"]


class Obstacles:
    """All boards as slabs, their outlines drawn in by `shrink` mm: rough outlines must not hide what they touch."""

    def __init__(self, sheets: Sequence[Sheet], shrink: float):
        import open3d as o3d

        self._scene = o3d.t.geometry.RaycastingScene()
        for sheet in sheets:
            depth = min(shrink, 0.4 * sheet.thickness.value)
            for piece in _parts(sheet.region.buffer(-shrink, join_style="mitre").simplify(shrink / 10)):
                corners = _slab(piece, depth, sheet.thickness.value - depth)
                triangles = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
                self._scene.add_triangles(
                    o3d.core.Tensor(sheet.to_world(corners).astype(np.float32)), o3d.core.Tensor(triangles)
                )

    def visible(
        self, views: Sequence[View], places: np.ndarray, outward: np.ndarray, grazing: float = 0.2
    ) -> np.ndarray:
        """(V, N) bool: views from which (N, 3) places are seen at all and from their outer side.

        outward (3,) or (N, 3): the surface normal there; grazing: least cosine between it and the line of sight.
        """
        import open3d as o3d

        seen = np.zeros((len(views), len(places)), bool)
        for k, view in enumerate(views):
            ray = view.centre - places
            distance = np.linalg.norm(ray, axis=1)
            ray = ray / distance[:, None]
            facing = (ray * outward).sum(axis=1) > grazing
            start = places + 0.5 * ray
            rays = np.concatenate([start, ray], axis=1).astype(np.float32)
            hidden = self._scene.test_occlusions(o3d.core.Tensor(rays), tnear=0.0).numpy()
            seen[k] = facing & ~hidden
        return seen


def _parts(shape) -> list[Polygon]:
    return [p for p in getattr(shape, "geoms", [shape]) if p.area > 0]


def _slab(piece: Polygon, low: float, high: float) -> np.ndarray:
    """Corners of a slab's triangles, (3M, 3)."""
    caps = [np.asarray(t.exterior.coords)[:3, :2] for t in shapely.constrained_delaunay_triangles(piece).geoms]
    corners = [np.c_[c, np.full(3, z)] for c in caps for z in (low, high)]
    for ring in (piece.exterior, *piece.interiors):
        xy = np.asarray(ring.coords)[:, :2]
        for a, b in pairwise(xy):
            quad = np.array([[*a, low], [*b, low], [*b, high], [*a, high]])
            corners += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    return np.concatenate(corners)
