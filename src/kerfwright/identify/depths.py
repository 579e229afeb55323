"""Thicknesses measured again once outlines and planes are known: from both faces, and from the edges of cut faces.

Edges are eased: what the photographs show as the edge of a cut face lies inside the board, by as much on either side.
How much is seen where a face's own plane is known; the boards of one object are eased alike. Where the far edge shows
both ends of its easing, the board ends between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from kerfwright.capture.types import Cloud
from kerfwright.identify.faces import Faces, measured_faces, moved, robust_mean, with_thickness
from kerfwright.identify.photo_edges import Photos, refine_peak, sweep_edge
from kerfwright.identify.thickness import looking_at
from kerfwright.identify.types import Sheet
from kerfwright.parallel import each

__all__ = ["remeasured"]

PLACES = 250
STEP, SMOOTHING = 1 / 5000, 1 / 1100  # of D, of the sweep down the cut faces
BEYOND = 1 / 125  # of D, that it begins above and ends below the board
TOP_REACH = 1 / 450  # of D: how far the near edge may lie from the plane
FAR_REACH = 1 / 200  # of D: ... and the far one from where it is thought
EASING = 1 / 300  # of D between the two ends of an easing
STRONG, ALIKE = 2.5, 0.5  # strength of an edge over the usual, and of the weaker end of an easing over the stronger
EDGE_ERROR = 1 / 3000  # of D: least standard error of a far edge
ROUGH_ERROR = 1 / 1500  # of D: what a thickness of identification is known no better than
ALONE_ERROR = 1 / 750  # ... where nothing is found that confirms it


@dataclass(frozen=True)
class _Edges:
    """Heights of a board's near and far edges over its top plane; the far one's ends lie on both sides of it if
    `both`.
    """

    near: float | None
    far: float
    error: float
    both: bool


def remeasured(
    sheets: tuple[Sheet, ...], cloud: Cloud, photos: Photos, noise: float
) -> tuple[Sheet, ...]:
    """The sheets on the planes, and of the thicknesses, that the photographs give them."""
    if len(photos.views) < 2:
        return sheets
    faces = measured_faces(sheets, cloud, photos, noise)
    edges = each(lambda sheet: _edges(sheet, photos, cloud.diameter), sheets)
    easing = _easing(faces, edges)
    return tuple(
        _settled(sheet, faces.offset[k], faces.error[k], edges[k], easing, cloud.diameter)
        for k, sheet in enumerate(sheets)
    )


def _easing(faces: Faces, edges: Sequence[_Edges | None]) -> float:
    """By how much edges show inside their boards, in the middle of those whose own face was measured; never below 0."""
    found = [
        faces.offset[k, 0] - e.near for k, e in enumerate(edges)
        if e is not None and e.near is not None and np.isfinite(faces.error[k, 0])
    ]  # fmt: skip
    return max(0.0, float(np.median(found))) if found else 0.0


def _settled(
    sheet: Sheet, offset: np.ndarray, error: np.ndarray, edges: _Edges | None, easing: float, size: float
) -> Sheet:
    """One sheet on its measured planes."""
    old = sheet.thickness
    if not sheet.thickness_seen:
        return moved(sheet, offset[0])  # an edge near a mere guess would be chance
    told = [(old.value, float(np.hypot(old.standard_error or 0.0, ROUGH_ERROR * size)))]
    if np.isfinite(error).all():
        told.append((old.value + offset.sum(), float(np.hypot(*error))))
    if edges is not None:
        told.append(_between(edges, offset[0] if np.isfinite(error[0]) else None, easing, size))
    if len(told) == 1:
        told = [(old.value, float(np.hypot(old.standard_error or 0.0, ALONE_ERROR * size)))]
    value, spread = robust_mean(*np.array(told).T)
    out = with_thickness(sheet, old.model_copy(update={"value": value, "standard_error": spread}))
    if not np.isfinite(error).any():
        return out
    # the top plane by both faces: the lower one is a thickness away
    ways, errors = np.array([offset[0], value - old.value - offset[1]]), np.hypot(error, [0.0, spread])
    return moved(out, float(np.average(ways, weights=errors**-2.0)))


def _between(edges: _Edges, top: float | None, easing: float, size: float) -> tuple[float, float]:
    """Thickness and standard error from a board's top plane, where it is known, to its far edge.

    Where the near edge is not as far below the top plane as others' are, this board is eased otherwise, and its far
    edge is the less sure for it.
    """
    if top is None:
        top = edges.near + easing if edges.near is not None else 0.0
    other = ROUGH_ERROR * size if edges.near is None else abs(top - edges.near - easing)
    far = edges.far if edges.both else edges.far - easing
    return top - far, float(np.linalg.norm([edges.error, easing / 2, other]))


def _edges(sheet: Sheet, photos: Photos, size: float) -> _Edges | None:
    """Near and far edges of the cut faces, in the sweep from above the top plane to below the bottom one."""
    places, outward = _rim(sheet.region)
    world = sheet.to_world(np.c_[places, np.full(len(places), sheet.thickness.value)])
    outward = np.c_[outward, np.zeros(len(places))] @ sheet.world_from_board[:3, :3].T
    offsets = np.arange(-BEYOND * size, sheet.thickness.value + BEYOND * size, STEP * size)
    visible = looking_at(photos, world, outward, sheet.normal, 10)
    sweep = sweep_edge(photos, world, -sheet.normal, offsets, visible, smoothing=SMOOTHING * size / 2)
    if sweep is None:
        return None
    strength = sweep.strength / np.median(sweep.strength)
    peaks = _peaks(strength, offsets)
    near = [p for p in peaks if abs(p[0]) < TOP_REACH * size]
    far = [p for p in peaks if abs(p[0] - sheet.thickness.value) < FAR_REACH * size]
    if not far:
        return None
    depth, both = _far_edge(far, size)
    top = max(near, key=lambda p: p[1])[0] if near else None
    return _Edges(None if top is None else -top, -depth, float(np.hypot(sweep.standard_error, EDGE_ERROR * size)), both)


def _rim(region: Polygon) -> tuple[np.ndarray, np.ndarray]:
    """Places (N, 2) along the outline and the directions outward of it."""
    ring = orient(region).exterior
    at = np.arange(PLACES) * ring.length / PLACES
    reach = 0.4 * ring.length / PLACES
    on, ahead, behind = (
        shapely.get_coordinates(shapely.line_interpolate_point(ring, (at + step) % ring.length))
        for step in (0.0, reach, -reach)
    )
    along = ahead - behind
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    return on, np.column_stack([along[:, 1], -along[:, 0]])


def _peaks(strength: np.ndarray, offsets: np.ndarray) -> list[tuple[float, float]]:
    """Offsets and strengths of the edges that stand out."""
    inner = strength[1:-1]
    at = np.flatnonzero((inner >= strength[:-2]) & (inner > strength[2:]) & (inner > STRONG)) + 1
    step = offsets[1] - offsets[0]
    return [(float(offsets[k] + refine_peak(strength[k - 1 : k + 2]) * step), float(strength[k])) for k in at]


def _far_edge(peaks: list[tuple[float, float]], size: float) -> tuple[float, bool]:
    """The strongest edge, or the middle between it and one as strong beside it: both ends of an easing."""
    best = max(peaks, key=lambda p: p[1])
    beside = [p for p in peaks if 0 < abs(p[0] - best[0]) < EASING * size and p[1] > ALIKE * best[1]]
    if not beside:
        return best[0], False
    other = max(beside, key=lambda p: p[1])
    return (best[0] + other[0]) / 2, True
