"""Polygons as few convex parts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from shapely.geometry import Polygon

__all__ = ["convex_parts"]

FLAT = 1e-6  # share of its area by which a part may differ from its hull


def convex_parts(polygon: Polygon) -> list[np.ndarray]:
    """Convex polygons (N, 2), counter-clockwise, that together are the polygon: triangles, merged largest first."""
    import shapely

    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    parts = [shapely.orient_polygons(t) for t in triangles]
    beside = {(a, b) for b in range(len(parts)) for a in range(b) if _share_an_edge(parts[a], parts[b])}
    while found := max(_merged(parts, beside), key=lambda entry: entry[0], default=None):
        _, (a, b), whole = found
        parts[a], parts[b] = shapely.orient_polygons(whole), None
        beside = {tuple(sorted(a if k == b else k for k in pair)) for pair in beside} - {(a, a)}
    return [shapely.get_coordinates(p.exterior)[:-1] for p in parts if p is not None]


def _share_an_edge(a: Polygon, b: Polygon) -> bool:
    return a.touches(b) and a.intersection(b).length > 0


def _merged(parts: list, beside: set[tuple[int, int]]):
    """Area, pair and hull of every two neighbours that are convex together."""
    import shapely

    for a, b in sorted(beside):
        whole = shapely.union(parts[a], parts[b]).convex_hull
        if whole.area - parts[a].area - parts[b].area < FLAT * whole.area:
            yield whole.area, (a, b), whole
