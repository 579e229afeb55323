"""Edges that are rounded over: photographs show where the flat face ends, which is inside of where the board does.

Stereo points on the cut faces, half way between the sheet planes, lie where the board ends. They carry the cloud's own
bias, which the points of the sheet planes show: planes were measured without them. Where cut-face points say clearly
that a board goes on beyond its traced boundary, the boundary is moved outward to them; where a board was eased all
round, so it is where no points are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_closing, binary_opening, uniform_filter1d

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.capture.types import Cloud
from kerfwright.identify.outlines import on_segments
from kerfwright.identify.types import Sheet
from kerfwright.refine.congruence import Contour, contour_of
from kerfwright.refine.types import BoundaryLoop

__all__ = ["Stereo", "moved_to_cut_faces", "stereo_of"]

LEAST_POINTS = 100  # of a face that tells the cloud's bias
WELL_SEEN = 0.25  # share of the faces whose points scatter by no more than noise does; the others are dim
MIDDLE = (0.25, 0.75)  # shares of the thickness between which no easing reaches
FACING = 0.85  # cosine of points' normals with the boundary's
NEAR = 1 / 80  # of D: points further from the boundary are not its own
WINDOW = 1 / 125  # of D, along the boundary to both sides, whose points speak for a place
LEAST_IN_WINDOW = 12
SIGMAS = 3.0  # times the cloud's noise by which a board must lie inside, in the median of its places
LEAST_SHARE = 0.08  # of a boundary that must have points to tell of the rest
BITE_SIGMAS = 4.0  # by which a place must lie inside that was traced wrongly, its board being sharp-edged
LASTING = 1 / 50  # of D: shortest stretch of such places
LARGEST = 1 / 8  # of the thickness; arrises are not rounded over by more
UNSEEN_ERROR = 0.3  # of the easing, where no points tell


@dataclass(frozen=True, eq=False)
class Stereo:
    """How far the cloud's points lie outside the faces that they were seen on, and how they scatter; mm."""

    bias: float
    noise: float
    on_faces: np.ndarray  # indices of the points on sheet planes: a thin board on an edge has its face where that ends


def stereo_of(sheets: Sequence[Sheet], cloud: Cloud) -> Stereo:
    """What the points of the sheet planes say of the cloud."""
    faces, on_faces = [], np.unique(np.concatenate([np.r_[s.top_idx, s.bottom_idx] for s in sheets]))
    for sheet in sheets:
        for idx, base, sign in ((sheet.top_idx, sheet.thickness.value, 1), (sheet.bottom_idx, 0.0, -1)):
            if len(idx) >= LEAST_POINTS:
                outside = sign * (sheet.to_board(cloud.points[idx])[:, 2] - base)
                middle = np.median(outside)
                faces.append((middle, 1.4826 * np.median(np.abs(outside - middle))))
    if not faces:
        return Stereo(0.0, np.inf, on_faces)
    bias, noise = np.array(faces).T
    return Stereo(float(np.median(bias)), float(np.quantile(noise, WELL_SEEN)), on_faces)


def moved_to_cut_faces(
    loops: tuple[BoundaryLoop, ...], sheet: Sheet, segments: Sequence[ConstraintSegment], cloud: Cloud, stereo: Stereo
) -> tuple[BoundaryLoop, ...]:
    """The loops of a board, moved outward where cut-face points lie clearly beyond them; none on constraint segments.
    """
    contour = contour_of(loops)
    across, vertex = _cut_points(contour, sheet, cloud, stereo.on_faces)
    told, told_error = _told(contour, across - stereo.bias, vertex, stereo.noise, cloud.diameter)
    free = ~on_segments(contour.points, segments)
    bitten = _lasting(free & (told > BITE_SIGMAS * told_error), contour, cloud.diameter)
    most = LARGEST * sheet.thickness.value
    offset, error = _offsets(told, np.hypot(told_error, contour.error), free, stereo.noise, most, bitten)
    offset, error = np.where(free, offset, 0.0), np.where(free, np.hypot(error, contour.error), contour.error)
    return _moved(loops, contour, offset, error, cloud.diameter) if offset.any() else loops


def _offsets(
    told: np.ndarray, error: np.ndarray, free: np.ndarray, noise: float, most: float,
    bitten: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """(N,) by how much each vertex is to move outward, and the error that this adds. A board that lies inside by more
    than `most` is not eased but was traced wrongly, which says nothing of places without points; nor do bites.
    """
    known = free & np.isfinite(error)
    easing = float(np.median(told[known])) if known.mean() > LEAST_SHARE else 0.0
    if not SIGMAS * noise < easing < most:
        return np.where(bitten, np.maximum(told, 0.0), 0.0), np.where(bitten, np.minimum(error, told), 0.0)
    clear = known & (error < easing)
    return np.where(clear, np.maximum(told, 0.0), easing), np.where(clear, error / 2, UNSEEN_ERROR * easing)


def _lasting(flags: np.ndarray, contour: Contour, diameter: float) -> np.ndarray:
    """Stretches of flags at least LASTING long, their gaps closed."""
    out = np.zeros(len(flags), bool)
    for number in np.unique(contour.loop):
        mine = np.flatnonzero(contour.loop == number)
        width = max(3, round(LASTING * diameter / _spacing(contour.points[mine])))
        wide = np.pad(flags[mine], 2 * width, mode="wrap")
        out[mine] = binary_opening(binary_closing(wide, np.ones(width)), np.ones(width))[2 * width : -2 * width]
    return out


def _spacing(points: np.ndarray) -> float:
    return max(float(np.median(np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1))), 1e-9)


def _cut_points(
    contour: Contour, sheet: Sheet, cloud: Cloud, on_faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Signed distances outside the boundary of points on the board's cut faces, and the vertex that each is nearest to.
    """
    x = sheet.to_board(cloud.points)
    low, high = np.array(MIDDLE) * sheet.thickness.value
    at = np.setdiff1d(np.flatnonzero((x[:, 2] > low) & (x[:, 2] < high)), on_faces, assume_unique=True)
    across, normal, vertex = contour.across(x[at, :2])
    facing = np.einsum("ij,ij->i", (cloud.normals[at] @ sheet.world_from_board[:3, :3])[:, :2], normal)
    true = np.linalg.norm(contour.points[vertex] - x[at, :2], axis=1)
    kept = (facing > FACING) & (true < NEAR * cloud.diameter)
    return across[kept], vertex[kept]


def _told(
    contour: Contour, across: np.ndarray, vertex: np.ndarray, noise: float, diameter: float
) -> tuple[np.ndarray, np.ndarray]:
    """(N,) how far the points about each vertex lie outside, and what that is good for: their spread, for stereo drifts
    over a whole face. Infinite errors where there are few.
    """
    value, error = np.zeros(len(contour.points)), np.full(len(contour.points), np.inf)
    order = np.argsort(vertex, kind="stable")
    across, vertex = across[order], vertex[order]
    for number in np.unique(contour.loop):
        mine = np.flatnonzero(contour.loop == number)
        reach = max(1, round(WINDOW * diameter / _spacing(contour.points[mine])))
        for i in mine:
            window = mine[0] + (i - mine[0] + np.arange(-reach, reach + 1)) % len(mine)
            near = _values(across, vertex, window)
            if len(near) >= LEAST_IN_WINDOW:
                value[i] = np.median(near)
                error[i] = max(noise, 1.4826 * np.median(np.abs(near - value[i])))
    return value, error


def _values(across: np.ndarray, vertex: np.ndarray, window: np.ndarray) -> np.ndarray:
    """What belongs to the vertices of a window; `vertex` is in order."""
    first, last = np.searchsorted(vertex, window, "left"), np.searchsorted(vertex, window, "right")
    return np.concatenate([across[a:b] for a, b in zip(first, last, strict=True)])


def _moved(
    loops: tuple[BoundaryLoop, ...], contour: Contour, offset: np.ndarray, error: np.ndarray, diameter: float
) -> tuple[BoundaryLoop, ...]:
    """Loops with vertices moved outward, by amounts that change no faster than their windows do."""
    out = []
    for number, loop in enumerate(loops):
        mine = contour.loop == number
        tangent = loop.points[(np.arange(len(loop.points)) + 1) % len(loop.points)] - np.roll(loop.points, 1, axis=0)
        tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
        width = 2 * max(1, round(WINDOW * diameter / 2 / _spacing(loop.points))) + 1
        by = np.where(offset[mine] > 0, uniform_filter1d(offset[mine], width, mode="wrap"), 0.0)
        points = loop.points + by[:, None] * np.column_stack([tangent[:, 1], -tangent[:, 0]])
        out.append(replace(loop, points=points, standard_error=error[mine]))
    return tuple(out)
