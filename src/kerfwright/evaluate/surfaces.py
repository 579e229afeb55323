"""Sampling and distances on triangle meshes; millimetres."""

from __future__ import annotations

import numpy as np

__all__ = ["Body", "Mesh", "Samples", "occupied_share", "sample_surface", "triangle_frames"]

Mesh = tuple[np.ndarray, np.ndarray]  # vertices (N, 3), triangles (M, 3)


class Samples:
    """Points on a surface, evenly spread, with their normals; each stands for `share` mm2."""

    def __init__(self, points: np.ndarray, normals: np.ndarray, share: float) -> None:
        self.points, self.normals, self.share = points, normals, share


class Body:
    """A mesh, or several together, that can be asked how far and whether inside."""

    def __init__(self, *meshes: Mesh) -> None:
        import open3d

        self._tensor = open3d.core.Tensor
        self._scene = open3d.t.geometry.RaycastingScene()
        for vertices, triangles in meshes:
            self._scene.add_triangles(
                self._tensor(np.ascontiguousarray(vertices, np.float32)),
                self._tensor(np.ascontiguousarray(triangles, np.uint32)),
            )

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Distances (N,) of points (N, 3) to the surface."""
        return self._scene.compute_distance(self._tensor(np.ascontiguousarray(points, np.float32))).numpy()

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points (N, 3) lie inside a closed mesh."""
        return self._scene.compute_occupancy(self._tensor(np.ascontiguousarray(points, np.float32))).numpy() > 0.5


def triangle_frames(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (M, 3, 3), unit normals (M, 3) and areas (M,)."""
    corners = mesh[0][mesh[1]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1)
    return corners, cross / np.maximum(length, 1e-12)[:, None], length / 2


def sample_surface(mesh: Mesh, count: int, seed: int = 0) -> Samples:
    """Points of a scrambled Sobol sequence on a mesh: even over its area, the same for the same seed."""
    from scipy.stats import qmc

    corners, normals, areas = triangle_frames(mesh)
    draws = qmc.Sobol(3, seed=seed).random_base2(int(np.ceil(np.log2(count))))[:count]
    t = np.searchsorted(np.cumsum(areas) / areas.sum(), draws[:, 0]).clip(max=len(areas) - 1)
    root = np.sqrt(draws[:, 1])
    weights = np.stack([1 - root, root * (1 - draws[:, 2]), root * draws[:, 2]], axis=1)
    return Samples(np.einsum("nk,nkd->nd", weights, corners[t]), normals[t], areas.sum() / count)


def occupied_share(a: Body, b: Body, low: np.ndarray, high: np.ndarray, count: int = 2**16) -> float:
    """Intersection over union of two bodies within a box that holds both."""
    from scipy.stats import qmc

    points = low + qmc.Sobol(3, seed=0).random(count) * (high - low)
    in_a, in_b = a.contains(points), b.contains(points)
    return float((in_a & in_b).sum() / max(1, (in_a | in_b).sum()))
