"""Boards and pieces of boards that lie in one plane, or in parallel ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.identify.types import Sheet

__all__ = ["PARALLEL", "in_one_plane", "moved_region", "united", "with_own_points"]

PARALLEL = 1 - 1e-6  # cosine between pieces of one board, once aligned


def in_one_plane(a: Sheet, b: Sheet, level: float) -> bool:
    """Whether both faces of b lie in those of a."""
    if abs(a.normal @ b.normal) < PARALLEL:
        return False
    middle = np.asarray(b.region.representative_point().coords[0])
    heights = a.to_board(b.to_world(np.array([[*middle, 0.0], [*middle, b.thickness.value]])))[:, 2]
    return bool(np.abs(np.sort(heights) - [0.0, a.thickness.value]).max() < level)


def moved_region(sheet: Sheet, to: Sheet) -> Polygon:
    """A board's region in the frame of a parallel one."""

    def ring(coords) -> np.ndarray:
        xy = np.asarray(coords)[:, :2]
        return to.to_board(sheet.to_world(np.c_[xy, np.zeros(len(xy))]))[:, :2]

    return Polygon(ring(sheet.region.exterior.coords), [ring(r.coords) for r in sheet.region.interiors]).buffer(0)


def united(a: Sheet, b: Sheet, region: Polygon) -> Sheet:
    """Two pieces of one board, in the frame of the first: a region, and the points of both."""
    top, bottom = (b.top_idx, b.bottom_idx) if a.normal @ b.normal > 0 else (b.bottom_idx, b.top_idx)
    return replace(a, region=region, top_idx=np.union1d(a.top_idx, top), bottom_idx=np.union1d(a.bottom_idx, bottom),
                   cut_idx=np.union1d(a.cut_idx, b.cut_idx))


def with_own_points(piece: Sheet, points: np.ndarray, slack: float) -> Sheet:
    """One of several pieces of a board, with those of the board's points that lie on it, or within `slack` mm of it.

    points: (N, 3) world, of the whole cloud.
    """
    around = piece.region.buffer(slack)

    def own(idx: np.ndarray) -> np.ndarray:
        xy = piece.to_board(points[idx])[:, :2]
        return idx[shapely.contains_xy(around, xy[:, 0], xy[:, 1])]

    return replace(piece, top_idx=own(piece.top_idx), bottom_idx=own(piece.bottom_idx), cut_idx=own(piece.cut_idx))
