"""The same numbers in the same order, whatever order the files have and however the capture lies in them.

Later stages take every n-th point, break ties by order, and decide by thresholds: a difference in the last bit of one
number can move an outline by millimetres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kerfwright.capture.types import Capture, Cloud, View

__all__ = ["on_grid", "ordered_views", "point_order", "snapped"]

# Powers of two, far below what a cloud or a pose tells and far above rounding; places as a share of the object's size.
PLACE = 2.0**-19
CAMERA_PLACE = 2.0**-25
DIRECTION = 2.0**-20
TURN = 2.0**-32


def point_order(points: np.ndarray, *more: np.ndarray | None) -> np.ndarray:
    """Indices, (N,), that sort points (N, 3) by their distance from their middle.

    Turning, moving, scaling and mirroring the points keeps this order, to rounding. `more` are rows (N, k) that tell
    points at one place apart.
    """
    distance = np.linalg.norm(points - _middle(points), axis=1)
    order = np.argsort(distance, kind="stable")
    if np.diff(distance[order]).all():
        return order
    rest = [np.asarray(rows).T for rows in more if rows is not None]
    return np.lexsort([*np.concatenate([points.T, *rest])[::-1], distance])


def _middle(points: np.ndarray) -> np.ndarray:
    """Mean, (3,), to the last bit the same in any order of the points."""
    return np.sort(points, axis=0).mean(axis=0)


def ordered_views(views: Sequence[View]) -> tuple[View, ...]:
    """The views by their photographs' files, of which no two have the same."""
    return tuple(sorted(views, key=lambda view: view.path))


def on_grid(values: np.ndarray | float, step: float) -> np.ndarray:
    """The values at the nearest multiples of a step: rounding that came before seldom shows."""
    return np.round(np.asarray(values) / step) * step


def snapped(capture: Capture, size: float) -> Capture:
    """The capture, of an object `size` units large, with places and directions on a grid.

    A capture that was turned, moved or scaled and prepared again then has the same bits, not only the same numbers to
    rounding: one in a million of them may still fall on the other side.
    """
    cloud = capture.cloud
    points, normals = on_grid(cloud.points, PLACE * size), on_grid(cloud.normals, DIRECTION)
    order = point_order(points, normals, cloud.colours)  # rounding may have exchanged neighbours
    return replace(
        capture,
        cloud=Cloud(points, normals, cloud.colours).select(order),
        views=tuple(_snapped_view(view, CAMERA_PLACE * size) for view in capture.views),
    )


def _snapped_view(view: View, step: float) -> View:
    pose = view.camera_from_world.copy()
    pose[:3, :3], pose[:3, 3] = on_grid(pose[:3, :3], TURN), on_grid(pose[:3, 3], step)
    return replace(view, camera_from_world=pose)
