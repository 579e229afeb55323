"""What a photograph sees at a point of a board's plane: ray casting against the other boards and the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely import constrained_delaunay_triangles
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from kerfwright.capture.types import View
from kerfwright.identify.types import Sheet

__all__ = ["BOARD", "CLEAR", "OCCLUDED", "Occluders", "slab_mesh"]

CLEAR, BOARD, OCCLUDED = 0, 1, 2  # what a ray meets behind the plane (ground or nothing; a board), or a board before it
GROUND_SIDE = 1e5  # mm; the floor reaches further than any photograph shows
FINE = 0.4  # mm that an occluder's outline may be off: they are known no better, and masks have thousands of corners
TOUCHING = 1e-3  # relative distance within which a hit counts as on the plane


def slab_mesh(region: Polygon, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (N, 3) and triangles (M, 3) of a region between z = 0 and z = thickness; caps and walls, not welded."""
    caps = [np.asarray(t.exterior.coords)[:3] for t in constrained_delaunay_triangles(region).geoms]
    corners = [np.column_stack([c, np.full(3, z)]) for c in caps for z in (0.0, thickness)]
    for ring in (region.exterior, *region.interiors):
        xy = np.asarray(ring.coords)[:, :2]
        a, b = xy[:-1], xy[1:]
        heights = [(p, np.full(len(p), z)) for z in (0.0, thickness) for p in (a, b)]
        low_a, low_b, high_a, high_b = (np.column_stack(h) for h in heights)
        corners += list(np.stack([low_a, low_b, high_b], 1)) + list(np.stack([low_a, high_b, high_a], 1))
    vertices = np.concatenate(corners)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


class Occluders:
    """The boards as slabs and the floor z = 0; one ray casting scene a board, without that board itself."""

    def __init__(self, sheets: Sequence[Sheet], regions: Sequence[Sequence[Polygon]]) -> None:
        """`regions[i]` holds the pieces of board i, board frame."""
        meshes = [[_placed(sheet, piece) for piece in pieces] for sheet, pieces in zip(sheets, regions, strict=True)]
        self._scenes = [_scene([m for j, ms in enumerate(meshes) if j != i for m in ms]) for i in range(len(sheets))]

    def classify(self, board_idx: int, view: View, x_in_world: np.ndarray) -> np.ndarray:
        """(N,) CLEAR, BOARD or OCCLUDED for points on the board's plane in a view, the board itself taken away."""
        import open3d as o3d

        scene, ground_id = self._scenes[board_idx]
        centre = np.broadcast_to(view.centre, x_in_world.shape)
        rays = np.concatenate([centre, x_in_world - view.centre], axis=1).astype(np.float32)
        hit = scene.cast_rays(o3d.core.Tensor(rays))
        distance, mesh_id = hit["t_hit"].numpy(), hit["geometry_ids"].numpy()
        seen = np.where(np.isfinite(distance) & (mesh_id != ground_id), BOARD, CLEAR)
        return np.where(distance < 1 - TOUCHING, OCCLUDED, seen).astype(np.uint8)


def _placed(sheet: Sheet, piece: Polygon) -> tuple[np.ndarray, np.ndarray]:
    vertices, triangles = slab_mesh(orient(piece.simplify(FINE)), sheet.thickness.value)
    return sheet.to_world(vertices), triangles


def _scene(meshes: list[tuple[np.ndarray, np.ndarray]]):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    for vertices, triangles in meshes:
        scene.add_triangles(o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(triangles.astype(np.uint32)))
    side = GROUND_SIDE
    floor = np.array([[-side, -side, 0], [side, -side, 0], [side, side, 0], [-side, side, 0]], np.float32)
    ground_id = scene.add_triangles(
        o3d.core.Tensor(floor), o3d.core.Tensor(np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    )
    return scene, ground_id
