"""What a workshop asks of a single board: tool, web, sheet, saw."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kerfwright.model import Bevel, Bezier, Board, Edge, Line, Loop
from kerfwright.model.geometry import arc_circle, edge_end, edge_points, edge_tangents, path_polygon

__all__ = ["bevel_angle", "fits_rectangle", "inside_radius", "narrowest_web"]

SHARP = np.radians(3)  # of turn to the right, from which a corner counts as one
_WEB_CHORD = 0.05  # mm; webs matter to tenths of a millimetre


def inside_radius(board: Board) -> tuple[float, tuple[float, float]]:
    """The least radius of the board's inside corners and curves (mm), 0 for a sharp corner, and where it is.

    The material is on the left of every loop: what turns right has its tool inside. Infinite when nothing does.
    """
    loops = (board.cut_path.outer, *board.cut_path.holes)
    found = [r for loop in loops for r in (*_corner_radii(loop), *_curve_radii(loop))]
    return min(found, default=(np.inf, (0.0, 0.0)))


def _corner_radii(loop: Loop) -> Iterator[tuple[float, tuple[float, float]]]:
    if len(loop.edges) == 1:
        return
    for edge, after in zip(loop.edges, (*loop.edges[1:], loop.edges[0]), strict=True):
        u, v = edge_tangents(edge, np.ones(1))[0], edge_tangents(after, np.zeros(1))[0]
        if np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v) < -SHARP:
            yield 0.0, edge_end(edge)


def _curve_radii(loop: Loop) -> Iterator[tuple[float, tuple[float, float]]]:
    for edge in loop.edges:
        if isinstance(edge, Bezier):
            yield from _bezier_radius(edge)
        elif not isinstance(edge, Line):
            _, radius, sweep = arc_circle(edge)
            if sweep < 0:
                yield radius, tuple(float(x) for x in edge_points(edge, np.array([0.5]))[0])


def _bezier_radius(edge: Edge) -> Iterator[tuple[float, tuple[float, float]]]:
    """The least radius where the curve turns right, from its tangents at close steps."""
    t = np.linspace(0, 1, 257)
    points, tangents = edge_points(edge, t), edge_tangents(edge, t)
    turn = tangents[:-1, 0] * tangents[1:, 1] - tangents[:-1, 1] * tangents[1:, 0]
    step = np.hypot(*np.diff(points, axis=0).T)
    right = turn < -1e-9
    if right.any():
        radius = np.where(right, step / np.maximum(-turn, 1e-12), np.inf)
        k = int(radius.argmin())
        yield float(radius[k]), (float(points[k, 0]), float(points[k, 1]))


def narrowest_web(board: Board, limit: float) -> float | None:
    """The width of the board's narrowest web or finger, mm, to a tenth of the limit; None when none is below it."""
    polygon = path_polygon(board.cut_path, _WEB_CHORD)
    if not _breaks(polygon, limit):
        return None
    widths = np.linspace(limit / 10, limit, 10)
    return float(next(w for w in widths if _breaks(polygon, w)))


def _breaks(polygon: object, width: float) -> bool:
    """Whether taking half the width off all round parts the board, or takes a finger off it."""
    core = polygon.buffer(-width / 2)
    if core.is_empty or core.geom_type != "Polygon":
        return True
    if len(core.interiors) < len(polygon.interiors):
        return True
    lost = polygon.difference(core.buffer(width / 2 * 1.001))
    # the tip that a corner of 30 degrees loses is below this; a finger as long as it is wide is not
    return any(part.area > width**2 for part in getattr(lost, "geoms", [lost]))


def fits_rectangle(board: Board, length: float, width: float) -> bool:
    """Whether the board, at any turn, fits a rectangle (mm)."""
    import shapely

    hull = shapely.get_coordinates(path_polygon(board.cut_path, _WEB_CHORD).convex_hull)
    sides = np.diff(hull, axis=0)
    turns = np.concatenate([np.arctan2(sides[:, 1], sides[:, 0]), np.radians(np.arange(0, 90, 1.0))])
    c, s = np.cos(turns), np.sin(turns)
    spans = np.stack([np.ptp(np.outer(hull[:, 0], c) + np.outer(hull[:, 1], s), axis=0),
                      np.ptp(np.outer(hull[:, 1], c) - np.outer(hull[:, 0], s), axis=0)])  # fmt: skip
    low, high = min(length, width), max(length, width)
    return bool(((spans.min(axis=0) <= low + 1e-6) & (spans.max(axis=0) <= high + 1e-6)).any())


def bevel_angle(bevel: Bevel) -> float:
    """Degrees between the cut face and a square cut, from its normal; positive when the top is the shorter side."""
    normal = np.array(bevel.normal) / np.linalg.norm(bevel.normal)
    return float(np.degrees(np.arcsin(np.clip(normal[2], -1, 1))))
