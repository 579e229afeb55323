"""Cubic Beziers as arcs: what routers and most CAM programs want.

A biarc is a pair of arcs that starts and ends like the curve, in place and direction, and whose two halves share a
tangent (Bolton, Biarc curves, CAD 7(2), 1975). The longest biarc that stays within the tolerance is taken again and
again, so that a curve becomes few arcs and every joint stays smooth.
"""

from __future__ import annotations

import numpy as np

from kerfwright.model.cutpath import Arc, Bezier, CutPath, Line, Loop
from kerfwright.model.geometry import arc_circle, arc_from_bulge, edge_points, edge_tangents

__all__ = ["arc_loop", "arc_path", "bezier_arcs"]

FLAT = 1e-4  # mm of sagitta below which an arc is written as a line
_PROBES = np.linspace(0, 1, 19)[1:-1]
_SHORTEST = 1e-4  # of the curve's parameter; a span that short is a line to any tolerance


def arc_path(path: CutPath, tolerance: float) -> CutPath:
    """The cut path with every Bezier replaced by arcs within the tolerance (mm); all else as it is."""
    return CutPath(outer=arc_loop(path.outer, tolerance), holes=tuple(arc_loop(h, tolerance) for h in path.holes))


def arc_loop(loop: Loop, tolerance: float) -> Loop:
    """The loop with every Bezier replaced by arcs within the tolerance (mm)."""
    edges = (bezier_arcs(e, tolerance) if isinstance(e, Bezier) else (e,) for e in loop.edges)
    return Loop(edges=tuple(e for group in edges for e in group))


def bezier_arcs(bezier: Bezier, tolerance: float) -> tuple[Arc | Line, ...]:
    """Arcs, and lines where it is straight, that run along a Bezier within the tolerance (mm), tangent to tangent."""
    pieces: list[Arc | Line] = []
    begin = 0.0
    while begin < 1:
        end = _reach(bezier, begin, tolerance)
        pieces += _biarc(bezier, begin, end)
        begin = end
    return tuple(pieces)


def _reach(bezier: Bezier, begin: float, tolerance: float) -> float:
    """The parameter up to which one biarc from `begin` follows the curve within the tolerance."""

    def fits(end: float) -> bool:
        return _deviation(bezier, begin, end) <= tolerance

    if fits(1.0):
        return 1.0
    low, high = begin, 1.0
    while high - low > _SHORTEST / 4:
        middle = (low + high) / 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return min(1.0, max(low, begin + _SHORTEST))


def _biarc(bezier: Bezier, begin: float, end: float) -> list[Arc | Line]:
    """Two arcs with the curve's ends and end tangents whose control legs are equally long."""
    p, q = edge_points(bezier, np.array([begin, end]))
    u, v = edge_tangents(bezier, np.array([begin, end]))
    chord = q - p
    spread = 1 - u @ v
    if spread < 1e-12:
        leg = chord @ chord / (4 * chord @ v) if abs(chord @ v) > 1e-12 else 0.0
    else:
        along = chord @ (u + v)
        leg = (-along + np.sqrt(along**2 + 2 * spread * (chord @ chord))) / (2 * spread)
    joint = (p + q + leg * (u - v)) / 2
    return [_tangent_arc(p, u, joint), _reversed(_tangent_arc(q, -v, joint))]


def _tangent_arc(start: np.ndarray, tangent: np.ndarray, end: np.ndarray) -> Arc | Line:
    """The arc from start to end that leaves along the tangent."""
    chord = end - start
    length = float(np.hypot(*chord))
    half_sweep = np.arctan2(tangent[0] * chord[1] - tangent[1] * chord[0], tangent @ chord)
    bulge = float(np.tan(half_sweep / 2))
    if abs(bulge) * length / 2 < FLAT:
        return Line(start=tuple(start), end=tuple(end))
    return arc_from_bulge(tuple(start), tuple(end), bulge)


def _reversed(edge: Arc | Line) -> Arc | Line:
    return edge.model_copy(update={"start": edge.end, "end": edge.start})


def _deviation(bezier: Bezier, begin: float, end: float) -> float:
    """The largest distance of the curve to its biarc, mm; infinite where the biarc runs away from it."""
    biarc = _biarc(bezier, begin, end)
    points = edge_points(bezier, begin + (end - begin) * _PROBES)
    span = np.hypot(*np.ptp(points, axis=0)) + 1e-9
    if sum(_sagitta(edge) for edge in biarc) > 4 * span:
        return np.inf
    return float(np.min([_distances(edge, points) for edge in biarc], axis=0).max())


def _sagitta(edge: Arc | Line) -> float:
    return 0.0 if isinstance(edge, Line) else float(np.hypot(*(np.add(edge.start, edge.end) / 2 - edge.mid)))


def _distances(edge: Arc | Line, points: np.ndarray) -> np.ndarray:
    """Distances (N,) of points (N, 2) to a line's stretch or an arc."""
    start, end = np.array(edge.start), np.array(edge.end)
    to_ends = np.minimum(np.hypot(*(points - start).T), np.hypot(*(points - end).T))
    if isinstance(edge, Line):
        along = (end - start) / max(np.hypot(*(end - start)), 1e-12)
        s = (points - start) @ along
        within = (s > 0) & (s < np.hypot(*(end - start)))
        return np.where(within, np.abs((points - start) @ np.array([-along[1], along[0]])), to_ends)
    centre, radius, sweep = arc_circle(edge)
    first = np.arctan2(*(start - centre)[::-1])
    turn = (np.arctan2(*(points - centre).T[::-1]) - first) * np.sign(sweep) % (2 * np.pi)
    return np.where(turn <= abs(sweep), np.abs(np.hypot(*(points - centre).T) - radius), to_ends)
