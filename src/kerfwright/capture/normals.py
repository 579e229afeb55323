"""Normals for clouds that come without: from each point's neighbourhood, turned towards the cameras that see it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from kerfwright.capture.types import View

__all__ = ["estimate_normals", "orient_normals"]

NEIGHBOURS = 16
CHUNK = 100_000  # points at a time, to bound memory


def estimate_normals(points: np.ndarray, neighbour_idx: np.ndarray) -> np.ndarray:
    """Unit normals, (N, 3), of either sign: the direction of least spread of each neighbourhood."""
    normals = np.empty_like(points)
    for start in range(0, len(points), CHUNK):
        x = points[neighbour_idx[start : start + CHUNK]]
        x = x - x.mean(axis=1, keepdims=True)
        normals[start : start + CHUNK] = np.linalg.eigh(np.einsum("nki,nkj->nij", x, x))[1][:, :, 0]
    return normals


def orient_normals(points: np.ndarray, views: Sequence[View]) -> np.ndarray:
    """Estimated unit normals, (N, 3), that point outwards: to the cameras."""
    neighbour_idx = cKDTree(points).query(points, k=NEIGHBOURS, workers=-1)[1]
    normals = estimate_normals(points, neighbour_idx)
    votes = np.zeros(len(points))
    for view in views:
        to_camera = view.centre - points
        votes += np.einsum("ni,ni->n", normals, to_camera) / np.linalg.norm(to_camera, axis=1)
    return np.where(votes[:, None] < 0, -normals, normals)
