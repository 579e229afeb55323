"""How far the cloud lies from the model: what the boards leave unexplained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kerfwright.report.meshes import BoardMesh

__all__ = ["Deviation", "deviation"]

# A point farther from every board than this share of the cloud's size is floor or clutter, not a badly fitted board.
CLUTTER = 0.03


@dataclass(frozen=True, eq=False)
class Deviation:
    """points : (N, 3) model frame, mm. distance : (N,) to the nearest board's surface, mm; negative inside a board."""

    points: np.ndarray
    distance: np.ndarray
    clutter: int  # points left out as not being of the object

    @property
    def rms(self) -> float:
        """Root mean square, mm: the paper's figure of merit; holds the cloud's own noise, too."""
        return float(np.sqrt(np.mean(self.distance**2))) if len(self.distance) else 0.0

    def percentile(self, share: float) -> float:
        """The distance that `share` percent of the points do not exceed, mm."""
        return float(np.percentile(np.abs(self.distance), share)) if len(self.distance) else 0.0


def deviation(meshes: Sequence[BoardMesh], points: np.ndarray, most: int = 60_000) -> Deviation:
    """Distances of at most `most` of the (N, 3) points, evenly picked, to the boards."""
    some = points[:: max(1, len(points) // most)]
    if not meshes or not len(some):
        return Deviation(some[:0], np.zeros(0), len(some))
    distance = _signed_distance(meshes, some)
    own = np.abs(distance) <= CLUTTER * np.ptp(points, axis=0).max()
    return Deviation(some[own], distance[own], int((~own).sum()))


def _signed_distance(meshes: Sequence[BoardMesh], points: np.ndarray) -> np.ndarray:
    """To the union of the boards: the smallest over the boards, each closed by itself."""
    import open3d as o3d

    query, nearest = o3d.core.Tensor(points.astype(np.float32)), np.full(len(points), np.inf)
    for mesh in meshes:
        scene = o3d.t.geometry.RaycastingScene()
        scene.add_triangles(
            o3d.core.Tensor(mesh.vertices.astype(np.float32)), o3d.core.Tensor(mesh.triangles.astype(np.uint32))
        )
        signed = scene.compute_signed_distance(query).numpy()
        nearest = np.where(np.abs(signed) < np.abs(nearest), signed, nearest)
    return nearest
