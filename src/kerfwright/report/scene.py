"""What the report's 3-D view is given: triangles, crisp edges, colours, and the cloud with its distances."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from kerfwright.report.deviation import Deviation
from kerfwright.report.meshes import BoardMesh

__all__ = ["crisp_edges", "scene"]

CREASE_DEGREES = 13.0  # facets of a curve turn by less (report.meshes)
CLOUD_POINTS = 15_000  # enough to see a pattern, few enough for a small file


def scene(
    meshes: Sequence[BoardMesh], colours: Sequence[tuple[float, float, float]], cloud: Deviation, full_scale: float
) -> dict[str, Any]:
    """JSON for assets/viewer.js; distances reach full colour at `full_scale`, mm."""
    corners = np.concatenate([mesh.vertices for mesh in meshes]) if meshes else np.zeros((1, 3))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return {
        "centre": _rounded((low + high) / 2), "radius": round(float(np.linalg.norm(high - low) / 2), 2) or 1.0,
        "boards": [_board(mesh, colour) for mesh, colour in zip(meshes, colours, strict=False)],
        "cloud": _cloud(cloud, full_scale),
    }


def _board(mesh: BoardMesh, colour: tuple[float, float, float]) -> dict[str, Any]:
    vertices, triangles = _merged(mesh)
    return {
        "name": mesh.name, "colour": _rounded(colour),
        "centre": _rounded((vertices.min(axis=0) + vertices.max(axis=0)) / 2),
        "positions": _base64(vertices, "<f4"), "triangles": _base64(triangles, "<u4"),
        "edges": _base64(crisp_edges(vertices, triangles), "<u4"),
    }


def _cloud(cloud: Deviation, full_scale: float) -> dict[str, str] | None:
    if not len(cloud.points):
        return None
    step = max(1, len(cloud.points) // CLOUD_POINTS)
    values = np.clip(cloud.distance[::step] / full_scale, -1, 1)
    points = np.round(cloud.points[::step], 2)
    return {"positions": _base64(points, "<f4"), "values": _base64(np.round(values, 2), "<f4")}


def _merged(mesh: BoardMesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertices that OCCT repeats on every face, made one: within a micrometre they are the same."""
    vertices, inverse = np.unique(np.round(mesh.vertices, 3), axis=0, return_inverse=True)
    triangles = inverse.reshape(-1)[mesh.triangles]
    a, b, c = triangles.T
    return vertices, triangles[(a != b) & (b != c) & (c != a)]


def crisp_edges(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Edges (M, 2) between faces that turn, or at a rim; vertices (N, 3) are shared by the triangles (K, 3)."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, owner, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    total = np.zeros((len(unique), 3))
    np.add.at(total, owner.reshape(-1), np.repeat(normals, 3, axis=0))
    # Two unit normals that turn by an angle add up to twice the cosine of its half.
    flat = (count == 2) & (np.linalg.norm(total, axis=1) > 2 * np.cos(np.radians(CREASE_DEGREES / 2)))
    return unique[~flat]


def _base64(values: np.ndarray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(float(v), 3) for v in values]
