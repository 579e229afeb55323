"""Normals: estimated where a cloud has none, and turned towards the cameras that see them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from kerfwright.capture.types import View

__all__ = ["estimated_normals", "normals_or_estimates"]

NEIGHBOURS = 16
CHUNK = 100_000  # points at a time, to bound memory
CELL = 3.0  # of the points' spacing: so wide a cell of a depth image is covered by whatever lies in front
DEPTH = 1.0  # of the cell's width: how far behind its cell's nearest point a point counts as seen; less than a board
MOST_VIEWS = 20  # that vote; more cost as much and tell less
SAMPLE_VIEWS = 8  # asked whether a file's normals point outwards
SAMPLE = 80_000  # of the points, that are asked
SPACED = 20_000  # points whose distance to their neighbours is measured
CLEAR = 0.5  # votes that decide alone: a view squarely in front, or two at a slant
MOST_INWARD = 0.05  # of the decided normals may face away; a hundredth does in good stereo clouds, about thin edges
MOST_MISSING = 0.1  # of a file's normals may be zero or NaN: more, and all are estimated
SPREAD_ROUNDS = 50  # of passing signs on to neighbours that no camera saw


def normals_or_estimates(
    points: np.ndarray, normals: np.ndarray | None, views: Sequence[View]
) -> tuple[np.ndarray, tuple[str, ...]]:
    """A file's normals, mended where needed, as outward unit vectors (N, 3), and notes on what was mended.

    Parameters
    ----------
    points : (N, 3)
    normals : (N, 3) of any length, zero and NaN included, or None
    views : decide which way is out
    """
    if normals is None:
        return estimated_normals(points, views), (
            "the cloud has no normals: they were estimated and turned to the cameras",
        )
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm(normals, axis=1)
        missing = ~(np.isfinite(length) & (length > 0))
    if missing.mean() > MOST_MISSING:
        note = f"{missing.sum()} of the cloud's {len(points)} normals are zero or NaN: all were estimated"
        return estimated_normals(points, views), (note,)
    unit = normals / np.where(missing, 1, length)[:, None]
    notes = ()
    if missing.any():
        unit[missing] = estimated_normals(points, views)[missing]
        notes = (f"{missing.sum()} normals of the cloud are zero or NaN: these were estimated",)
    thin = slice(None, None, max(1, len(points) // SAMPLE))
    share = _inward_share(points[thin], unit[thin], views)
    if share <= MOST_INWARD:
        return unit, notes
    note = (
        f"{100 * share:.0f} % of the cloud's normals faced away from the cameras that see them: such were turned round"
    )
    votes = facing_votes(points, unit, views, _spacing(points))
    return turned_outwards(unit, votes + CLEAR), (*notes, note)


def _inward_share(points: np.ndarray, normals: np.ndarray, views: Sequence[View]) -> float:
    """Share of the normals, of those that the views decide, that point into the material."""
    votes = facing_votes(points, normals, views, _spacing(points), SAMPLE_VIEWS)
    return float((votes < -CLEAR).sum() / max(1, (np.abs(votes) > CLEAR).sum()))


def _spacing(points: np.ndarray) -> float:
    """Median distance to the third nearest point."""
    some = points[:: max(1, len(points) // SPACED)]
    return float(np.median(cKDTree(points).query(some, k=min(4, len(points)))[0][:, -1]))


def estimated_normals(points: np.ndarray, views: Sequence[View]) -> np.ndarray:
    """Unit normals, (N, 3), for a cloud without: square to each point's neighbourhood, out of the material."""
    neighbour_idx = cKDTree(points).query(points, k=min(NEIGHBOURS, len(points)), workers=-1)[1]
    normals = _square_to_neighbours(points, neighbour_idx)
    votes = facing_votes(points, normals, views, _spacing(points))
    return turned_outwards(normals, _spread(votes, normals, neighbour_idx))


def turned_outwards(normals: np.ndarray, votes: np.ndarray) -> np.ndarray:
    """Normals with those turned round that have negative votes."""
    return np.where(votes[:, None] < 0, -normals, normals)


def _square_to_neighbours(points: np.ndarray, neighbour_idx: np.ndarray) -> np.ndarray:
    """Unit normals, (N, 3), of either sign: the direction of least spread of each neighbourhood."""
    normals = np.empty_like(points)
    for start in range(0, len(points), CHUNK):
        x = points[neighbour_idx[start : start + CHUNK]]
        x = x - x.mean(axis=1, keepdims=True)
        normals[start : start + CHUNK] = np.linalg.eigh(np.einsum("nki,nkj->nij", x, x))[1][:, :, 0]
    return normals


def facing_votes(
    points: np.ndarray, normals: np.ndarray, views: Sequence[View], spacing: float, most_views: int = MOST_VIEWS
) -> np.ndarray:
    """Sum over the views that see a point of the cosine between its normal and the way to the camera, (N,).

    Negative where a normal points into the material, zero where no view sees the point.
    """
    votes = np.zeros(len(points))
    for view in views[:: max(1, -(-len(views) // most_views))]:
        seen = _seen(points, view, spacing)
        to_camera = view.centre - points[seen]
        length = np.maximum(np.linalg.norm(to_camera, axis=1), np.finfo(float).tiny)
        votes[seen] += np.einsum("ni,ni->n", normals[seen], to_camera) / length
    return votes


def _seen(points: np.ndarray, view: View, spacing: float) -> np.ndarray:
    """Indices of the points that no other hides, by a depth image made of the points themselves."""
    pixels, depth = view.project(points)
    size = np.array([view.camera.width, view.camera.height])
    inside = np.flatnonzero((depth > 0) & (pixels >= 0).all(axis=1) & (pixels < size).all(axis=1))
    if not len(inside):
        return inside
    depth = depth[inside]
    width = CELL * spacing * view.camera.focal / float(np.median(depth))  # pixels
    column, row = (pixels[inside] / width).astype(int).T
    cell = row * (int(size[0] / width) + 1) + column
    nearest = np.full(int(cell.max()) + 1, np.inf)
    np.minimum.at(nearest, cell, depth)
    return inside[depth <= nearest[cell] + DEPTH * CELL * spacing]


def _spread(votes: np.ndarray, normals: np.ndarray, neighbour_idx: np.ndarray) -> np.ndarray:
    """Votes, with those of their neighbours for points that no camera saw."""
    votes = votes.copy()
    for _ in range(SPREAD_ROUNDS):
        unseen = np.flatnonzero(votes == 0)
        if not len(unseen):
            break
        alike = np.einsum("ni,nki->nk", normals[unseen], normals[neighbour_idx[unseen]])
        votes[unseen] = (alike * np.sign(votes[neighbour_idx[unseen]])).sum(axis=1)
    return votes
