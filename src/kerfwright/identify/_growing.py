"""Compiled region growing over the neighbour graph of a cloud."""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["grow_planes"]


@njit(cache=True)
def _fit(total, scatter, count):
    """Unit normal and mean of `count` points from their sums about an origin."""
    mean = total / count
    covariance = scatter / count - np.outer(mean, mean)
    return np.linalg.eigh(covariance)[1][:, 0], mean


@njit(cache=True)
def _grow_one(seed, number, points, normals, neighbours, labels, queue, inlier, cos_angle):
    """Grow one plane from a seed; returns how many points it took (queue[:taken])."""
    origin = points[seed].copy()
    normal = normals[seed].copy()
    offset = 0.0
    total = np.zeros(3)
    scatter = np.zeros((3, 3))
    labels[seed] = number
    queue[0] = seed
    head, tail, next_fit = 0, 1, 12
    while head < tail:
        here = queue[head]
        head += 1
        x = points[here] - origin
        total += x
        scatter += np.outer(x, x)
        if head == next_fit:
            fitted, mean = _fit(total, scatter, head)
            if fitted @ normal < 0:
                fitted = -fitted
            normal = fitted.copy()
            offset = normal @ mean
            next_fit = int(next_fit * 1.5) + 1
        for other in neighbours[here]:
            if labels[other] >= 0 or normals[other] @ normal <= cos_angle:
                continue
            if abs(normal @ (points[other] - origin) - offset) < inlier:
                labels[other] = number
                queue[tail] = other
                tail += 1
    return tail


@njit(cache=True)
def grow_planes(points, normals, neighbours, seeds, inlier, cos_angle, min_points):
    """Label points by the plane they were reached by; -1 where no plane of `min_points` was.

    points, normals (N, 3) float64; neighbours (N, K) int; seeds (N,) int, best first.
    Returns labels (N,) int64 and the number of planes.
    """
    labels = np.full(len(points), -1, np.int64)
    tried = np.zeros(len(points), np.bool_)
    queue = np.empty(len(points), np.int64)
    number = 0
    for seed in seeds:
        if labels[seed] >= 0 or tried[seed]:
            continue
        taken = _grow_one(seed, number, points, normals, neighbours, labels, queue, inlier, cos_angle)
        if taken >= min_points:
            number += 1
            continue
        for k in range(taken):
            labels[queue[k]] = -1
            tried[queue[k]] = True
    return labels, number
