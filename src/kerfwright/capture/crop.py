"""Which points of a cloud are the object: without the floor, what stands elsewhere, and strays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from kerfwright.capture.floor import Floor
from kerfwright.capture.types import Cloud, View

__all__ = ["Cropped", "above_floor", "crop_to_object", "focus"]

LINK = 0.02  # of the cloud's size: points nearer than one to two of these belong together
FARTHEST = 100.0  # of the cloud's size: strays beyond are taken to be there, so that a grid can hold them
STRAY_SHARE = 0.002  # of the points: a group with fewer of them that touches nothing is not a board
PEER_SHARE = 0.2  # of the largest group: one with as many of the points may be the object
TOUCH = 0.1  # of the object's size: how far from its box a part of it may hang in the air, for want of points between


@dataclass(frozen=True, eq=False)
class Cropped:
    """Mask of the points kept, (N,), and what a person should know."""

    keep: np.ndarray
    notes: tuple[str, ...] = ()


def above_floor(cloud: Cloud, floor: Floor) -> np.ndarray:
    """Mask, (N,), of points that are not of the floor.

    The noise decides: four standard deviations above it, and twice that where the point looks up like the floor, whose
    points rise beside what stands on it.
    """
    heights = floor.heights(cloud.points)
    upward = np.abs(cloud.normals @ floor.normal) > np.cos(np.radians(45))
    return heights > np.where(upward, 8.0, 4.0) * floor.noise


def focus(views: Sequence[View]) -> np.ndarray | None:
    """Where the cameras look: the point nearest to all optical axes, (3,); None when these are parallel."""
    if not views:
        return None
    axes = np.array([view.camera_from_world[2, :3] for view in views])
    centres = np.array([view.centre for view in views])
    across = (
        np.eye(3) - axes[:, :, None] * axes[:, None, :]
    )  # a point's distance from an axis is |across @ (point - centre)|
    middle = centres.mean(axis=0)
    matrix, right = across.sum(axis=0), np.einsum("nij,nj->i", across, centres - middle)
    if np.linalg.cond(matrix) > 1e4:
        return None
    return middle + np.linalg.solve(matrix, right)


def crop_to_object(points: np.ndarray, looked_at: np.ndarray | None) -> Cropped:
    """Keep the group of points that the cameras look at, with what belongs to it.

    Parameters
    ----------
    points : (N, 3), any unit, without the floor
    looked_at : from `focus`; None takes the largest group
    """
    if not len(points):
        return Cropped(np.zeros(0, bool))
    low, high = np.percentile(points, (0.5, 99.5), axis=0)
    size = max(float((high - low).max()), np.finfo(float).tiny)
    near = np.clip(points, low - FARTHEST * size, high + FARTHEST * size)  # a stray at any distance is a stray
    group, count = _groups((near - near.min(axis=0)) / (LINK * size))
    boxes = _boxes(points, group, len(count))
    main = _main_group(count, boxes, looked_at)
    members = _members(main, count, boxes)
    return Cropped(members[group], _notes(count, members, main))


def _groups(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Groups connected on the grid of whole numbers: each point's group, (N,), and the points in each group."""
    cell = np.floor(points).astype(np.int64)
    _, side_y, side_z = cell.max(axis=0) + 3
    key = (cell[:, 0] * side_y + cell[:, 1]) * side_z + cell[:, 2]
    cells, of_point = np.unique(key, return_inverse=True)
    steps = [(i * side_y + j) * side_z + k for i in (0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)]
    label = _connected(cells, [s for s in steps if s > 0])
    return label[of_point], np.bincount(label[of_point])


def _connected(cells: np.ndarray, steps: list[int]) -> np.ndarray:
    """Group of each cell, (C,); cells are sorted keys, neighbours lie the given steps ahead."""
    ahead = [np.searchsorted(cells, cells + step) for step in steps]
    pairs = [
        (np.flatnonzero(hit), at[hit])
        for at, step in zip(ahead, steps, strict=True)
        for hit in [cells[np.minimum(at, len(cells) - 1)] == cells + step]
    ]
    row, column = (np.concatenate(ends) for ends in zip(*pairs, strict=True))
    graph = coo_matrix((np.ones(len(row), bool), (row, column)), shape=(len(cells), len(cells)))
    return connected_components(graph, directed=False)[1]


def _boxes(points: np.ndarray, group: np.ndarray, count: int) -> np.ndarray:
    """Bounding boxes, (G, 2, 3): lowest and highest corner of each group."""
    order = np.argsort(group, kind="stable")
    starts = np.searchsorted(group[order], np.arange(count))
    ordered = points[order]
    return np.stack([np.minimum.reduceat(ordered, starts), np.maximum.reduceat(ordered, starts)], axis=1)


def _gap(box: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Distances, (G,), between a box (2, 3) and others (G, 2, 3); zero where they overlap."""
    apart = np.maximum(boxes[:, 0] - box[1], box[0] - boxes[:, 1])
    return np.linalg.norm(np.maximum(apart, 0), axis=1)


def _main_group(count: np.ndarray, boxes: np.ndarray, looked_at: np.ndarray | None) -> int:
    """The group nearest to where the cameras look, among those of a size; the larger where two are as near."""
    large = np.flatnonzero(count >= PEER_SHARE * count.max())
    if looked_at is None:
        return int(count.argmax())
    size = np.linalg.norm(np.ptp(boxes[large], axis=1), axis=1)
    away = np.linalg.norm(boxes[large].mean(axis=1) - looked_at, axis=1) / np.maximum(size, np.finfo(float).tiny)
    return int(large[np.lexsort((-count[large], away.round(3)))[0]])


def _members(main: int, count: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Mask, (G,), of the groups that belong to the main one: boards that float near it, their joints unseen."""
    members = np.arange(len(count)) == main
    enough = count >= STRAY_SHARE * count[main]
    reach = TOUCH * float(np.ptp(boxes[main], axis=0).max())
    while True:
        box = np.stack([boxes[members, 0].min(axis=0), boxes[members, 1].max(axis=0)])
        more = members | (enough & (_gap(box, boxes) < reach))
        if (more == members).all():
            return members
        members = more


def _notes(count: np.ndarray, members: np.ndarray, main: int) -> tuple[str, ...]:
    left_out = np.flatnonzero(~members & (count >= PEER_SHARE * count[main]))
    strays = int(count[~members].sum() - count[left_out].sum())
    notes = [
        f"another object with {count[g]} points was left out: the cameras look at the one with {count[main]}"
        for g in left_out
    ]
    return (*notes, f"{strays} stray points away from the object were left out") if strays else tuple(notes)
