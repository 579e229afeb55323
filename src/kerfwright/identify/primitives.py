"""Planes in an oriented cloud, by region growing over its neighbour graph and robust refits.

The paper uses Efficient RANSAC (Primitive Detection and Adjacency). Growing from the flattest neighbourhoods finds the
same connected plane patches in one deterministic pass: see docs/method.md.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from kerfwright.capture.types import Cloud
from kerfwright.errors import StageError
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.types import Neighbourhood, Primitive

__all__ = ["find_planes", "look_around", "plane_fit"]

CHUNK = 100_000  # points whose neighbourhoods are in memory at once


def look_around(cloud: Cloud, options: IdentifyOptions) -> Neighbourhood:
    """Neighbour graph, smoothed normals and the noise across the surface."""
    if len(cloud) < 4 * options.neighbours:
        raise StageError(
            f"cloud: points: {len(cloud)}: at least {4 * options.neighbours} are needed: check the crop of the cloud"
        )
    idx, third, normals = _neighbours(cloud, options.neighbours)
    residual = _local_residual(cloud.points, idx)
    return Neighbourhood(idx, normals, residual, float(np.median(residual)), float(np.median(third)))


def _neighbours(cloud: Cloud, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Indices of the nearest points (N, K) int32, distances to the third (N,), normals averaged over all (N, 3)."""
    tree, size = cKDTree(cloud.points), len(cloud)
    idx, third, normals = np.empty((size, count), np.int32), np.empty(size), np.empty((size, 3))
    for start in range(0, size, CHUNK):
        part = slice(start, start + CHUNK)
        distance, nearest = tree.query(cloud.points[part], k=count, workers=-1)
        idx[part], third[part] = nearest, distance[:, 3]
        normals[part] = _unit(cloud.normals[nearest].sum(axis=1))
    return idx, third, normals


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def _local_residual(points: np.ndarray, idx: np.ndarray) -> np.ndarray:
    """Standard deviation of each neighbourhood across its own plane, (N,) mm."""
    out = np.empty(len(points))
    for start in range(0, len(points), CHUNK):
        x = points[idx[start : start + CHUNK]]
        x = x - x.mean(axis=1, keepdims=True)
        scatter = np.einsum("nki,nkj->nij", x, x) / x.shape[1]
        out[start : start + CHUNK] = np.sqrt(np.maximum(np.linalg.eigvalsh(scatter)[:, 0], 0))
    return out


def plane_fit(points: np.ndarray, outward: np.ndarray, rounds: int = 5) -> tuple[np.ndarray, float, np.ndarray, float]:
    """Robust least squares plane (Tukey's biweight).

    points (N, 3); outward (3,) turns the normal. Returns normal (3,), offset, weighted centroid (3,), robust sigma.
    """
    weight = np.ones(len(points))
    for _ in range(rounds):
        centre = weight @ points / weight.sum()
        x = points - centre
        normal = np.linalg.eigh((x * weight[:, None]).T @ x)[1][:, 0]
        residual = x @ normal
        sigma = max(1.4826 * float(np.median(np.abs(residual))), 1e-9)
        weight = np.maximum(1 - (residual / (4.685 * sigma)) ** 2, 0) ** 2
    normal = normal if normal @ outward >= 0 else -normal
    return normal, float(normal @ centre), centre, sigma


def find_planes(cloud: Cloud, around: Neighbourhood, options: IdentifyOptions) -> list[Primitive]:
    """Connected plane patches, largest first.

    Raises StageError when the cloud shows no plane at all.
    """
    from kerfwright.identify._growing import grow_planes

    inlier = max(options.inlier_sigmas * around.noise, options.inlier_floor * cloud.diameter)
    seeds = np.argsort(around.residual, kind="stable")
    labels, count = grow_planes(
        cloud.points, around.normals, around.neighbour_idx, seeds, inlier, np.cos(np.radians(options.normal_degrees)),
        options.min_points,
    )
    if not count:
        raise StageError("cloud: no plane found: kerfwright needs flat boards; check that the cloud shows the object")
    order = np.argsort(labels, kind="stable")
    groups = np.split(order, np.searchsorted(labels[order], np.arange(count)))[1:]
    planes = [_primitive(cloud, around, np.sort(group)) for group in groups]
    return sorted(planes, key=lambda p: (-len(p.point_idx), p.point_idx[0]))


def _primitive(cloud: Cloud, around: Neighbourhood, idx: np.ndarray) -> Primitive:
    normal, offset, centre, sigma = plane_fit(cloud.points[idx], around.normals[idx].mean(axis=0))
    return Primitive(normal, offset, idx, centre, sigma)
