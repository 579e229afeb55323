"""Geometry of cut paths: points, tangents, lengths, areas, transforms.

Everything works on the edge types of `kerfwright.model.cutpath`, in the board's plane, millimetres and radians. An
edge's own parameter t runs from 0 to 1. Closed formulas are used where there are any (areas are exact for all four
kinds of edge).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kerfwright.model.cutpath import Arc, Bezier, Circle, CutPath, Edge, Line, Loop

if TYPE_CHECKING:
    from shapely.geometry import Polygon

__all__ = [
    "arc_bulge",
    "arc_circle",
    "arc_from_bulge",
    "edge_area",
    "edge_end",
    "edge_length",
    "edge_points",
    "edge_start",
    "edge_tangents",
    "loop_distance",
    "loop_length",
    "mirror_path",
    "path_area",
    "path_polygon",
    "reverse_edge",
    "reverse_loop",
    "sample_edge",
    "sample_loop",
    "signed_area",
    "transform_edge",
    "transform_loop",
    "transform_path",
]

CHORD_TOLERANCE = 0.01  # mm; a hundredth is below what any saw or router holds
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


def arc_circle(arc: Arc | Circle) -> tuple[np.ndarray, float, float]:
    """Centre (2,), radius and signed sweep (radians, positive counter-clockwise) of an arc or a full circle.

    Raises
    ------
    ValueError
        If the three points of the arc are collinear.
    """
    if isinstance(arc, Circle):
        return np.array(arc.centre), arc.radius, -2 * np.pi if arc.clockwise else 2 * np.pi
    start, mid, end = (np.array(p) for p in (arc.start, arc.mid, arc.end))
    a, b = mid - start, end - start
    cross = a[0] * b[1] - a[1] * b[0]
    if abs(cross) <= 1e-12 * max(a @ a, b @ b):
        raise ValueError(f"arc {arc.start} {arc.mid} {arc.end}: its three points are collinear: make it a line")
    offset = np.array([b[1] * (a @ a) - a[1] * (b @ b), a[0] * (b @ b) - b[0] * (a @ a)]) / (2 * cross)
    centre = start + offset
    sweep = _turn(start - centre, mid - centre, cross > 0) + _turn(mid - centre, end - centre, cross > 0)
    return centre, float(np.hypot(*offset)), sweep


def _turn(u: np.ndarray, v: np.ndarray, counter_clockwise: bool) -> float:
    """Angle from u to v, going the given way round."""
    angle = float(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v))
    if counter_clockwise:
        return angle if angle >= 0 else angle + 2 * np.pi
    return angle if angle <= 0 else angle - 2 * np.pi


def arc_bulge(arc: Arc) -> float:
    """Tangent of a quarter of the signed sweep, as DXF polylines want it."""
    return float(np.tan(arc_circle(arc)[2] / 4))


def arc_from_bulge(start: tuple[float, float], end: tuple[float, float], bulge: float) -> Arc:
    """The arc from start to end whose signed sweep is four times the arctangent of the bulge."""
    a, b = np.array(start, float), np.array(end, float)
    chord = b - a
    mid = (a + b) / 2 + bulge / 2 * np.array([chord[1], -chord[0]])
    return Arc(start=tuple(a), mid=tuple(mid), end=tuple(b))


def edge_start(edge: Edge) -> tuple[float, float]:
    """First point; of a circle, the one at angle 0."""
    return (edge.centre[0] + edge.radius, edge.centre[1]) if isinstance(edge, Circle) else edge.start


def edge_end(edge: Edge) -> tuple[float, float]:
    """Last point; of a circle, the one at angle 0."""
    return edge_start(edge) if isinstance(edge, Circle) else edge.end


def edge_points(edge: Edge, t: np.ndarray) -> np.ndarray:
    """Points (N, 2) at parameters t (N,) from 0 to 1."""
    t = np.asarray(t, float)[:, None]
    if isinstance(edge, Line):
        return np.array(edge.start) * (1 - t) + np.array(edge.end) * t
    if isinstance(edge, Bezier):
        p0, p1, p2, p3 = _controls(edge)
        return (1 - t) ** 3 * p0 + 3 * (1 - t) ** 2 * t * p1 + 3 * (1 - t) * t**2 * p2 + t**3 * p3
    centre, radius, sweep = arc_circle(edge)
    angle = _start_angle(edge, centre) + sweep * t
    return centre + radius * np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def edge_tangents(edge: Edge, t: np.ndarray) -> np.ndarray:
    """Unit tangents (N, 2) at parameters t (N,), pointing along the edge."""
    t = np.asarray(t, float)[:, None]
    if isinstance(edge, Bezier):
        direction = _bezier_derivative(edge, t)
    elif isinstance(edge, Line):
        direction = np.repeat(np.array([edge.end]) - np.array([edge.start]), len(t), axis=0)
    else:
        centre, _, sweep = arc_circle(edge)
        angle = _start_angle(edge, centre) + sweep * t
        direction = np.sign(sweep) * np.concatenate([-np.sin(angle), np.cos(angle)], axis=1)
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def _controls(edge: Bezier) -> np.ndarray:
    return np.array([edge.start, edge.control_1, edge.control_2, edge.end])


def _start_angle(edge: Arc | Circle, centre: np.ndarray) -> float:
    x, y = np.array(edge_start(edge)) - centre
    return float(np.arctan2(y, x))


def _bezier_derivative(edge: Bezier, t: np.ndarray) -> np.ndarray:
    """Derivative (N, 2) by the parameter; where a control point falls on an end, its limit's direction."""
    p0, p1, p2, p3 = _controls(edge)
    first = 3 * ((1 - t) ** 2 * (p1 - p0) + 2 * (1 - t) * t * (p2 - p1) + t**2 * (p3 - p2))
    vanishing = np.linalg.norm(first, axis=1) < 1e-9 * max(1e-9, float(np.ptp(_controls(edge))))
    inward = np.where(t < 0.5, 1e-4, -1e-4)
    s = t + inward
    near = 3 * ((1 - s) ** 2 * (p1 - p0) + 2 * (1 - s) * s * (p2 - p1) + s**2 * (p3 - p2))
    return np.where(vanishing[:, None], near, first)


def edge_length(edge: Edge) -> float:
    """Length in mm; of a Bezier by Gauss-Legendre quadrature of its speed."""
    if isinstance(edge, Line):
        return float(np.hypot(edge.end[0] - edge.start[0], edge.end[1] - edge.start[1]))
    if isinstance(edge, Bezier):
        pieces = np.linspace(0, 1, 9)
        t = (pieces[:-1, None] + (1 + _GAUSS_NODES) / 16).reshape(-1, 1)
        speed = np.linalg.norm(_bezier_derivative(edge, t), axis=1)
        return float(speed @ np.tile(_GAUSS_WEIGHTS, 8) / 16)
    _, radius, sweep = arc_circle(edge)
    return radius * abs(sweep)


def loop_length(loop: Loop) -> float:
    """Perimeter in mm."""
    return sum(edge_length(e) for e in loop.edges)


def sample_edge(edge: Edge, chord_tolerance: float = CHORD_TOLERANCE) -> np.ndarray:
    """Points (N, 2) from start to end, both included, whose chords stay within the tolerance (mm) of the edge."""
    return edge_points(edge, np.linspace(0, 1, _segments(edge, chord_tolerance) + 1))


def _segments(edge: Edge, chord_tolerance: float) -> int:
    """How many equal steps of the parameter keep every chord within the tolerance."""
    if isinstance(edge, Line):
        return 1
    if isinstance(edge, Bezier):  # chord error of a curve: a step squared, times its second derivative, over eight
        p = _controls(edge)
        bend = 6 * np.linalg.norm(np.diff(p, 2, axis=0), axis=1).max()
        return max(1, int(np.ceil(np.sqrt(bend / (8 * chord_tolerance)))))
    _, radius, sweep = arc_circle(edge)
    step = 2 * np.arccos(max(0.0, 1 - chord_tolerance / radius))
    return max(8 if isinstance(edge, Circle) else 2, int(np.ceil(abs(sweep) / step)))


def sample_loop(loop: Loop, chord_tolerance: float = CHORD_TOLERANCE) -> np.ndarray:
    """Points (N, 2) round the loop within the chord tolerance (mm); the last does not repeat the first."""
    return np.concatenate([sample_edge(e, chord_tolerance)[:-1] for e in loop.edges])


def edge_area(edge: Edge) -> float:
    """The edge's share of its loop's signed area: half the integral of x dy - y dx, exact."""
    (x0, y0), (x1, y1) = edge_start(edge), edge_end(edge)
    chord = (x0 * y1 - x1 * y0) / 2
    if isinstance(edge, Line):
        return chord
    if isinstance(edge, Bezier):
        t = ((1 + _GAUSS_NODES) / 2)[:, None]  # the integrand is of degree 5: 12 nodes integrate it exactly
        p, d = edge_points(edge, t[:, 0]), 3 * _bezier_hodograph(edge, t)
        return float((p[:, 0] * d[:, 1] - p[:, 1] * d[:, 0]) @ _GAUSS_WEIGHTS / 4)
    _, radius, sweep = arc_circle(edge)
    return chord + radius**2 * (sweep - np.sin(sweep)) / 2


def _bezier_hodograph(edge: Bezier, t: np.ndarray) -> np.ndarray:
    d0, d1, d2 = np.diff(_controls(edge), axis=0)
    return (1 - t) ** 2 * d0 + 2 * (1 - t) * t * d1 + t**2 * d2


def signed_area(loop: Loop) -> float:
    """Area in mm2, positive for a counter-clockwise loop; exact but for rounding."""
    x, y = edge_start(loop.edges[0])  # about a point of the loop: keeps the digits of a small loop far from the origin
    return float(sum(edge_area(_moved(e, -x, -y)) for e in loop.edges))


def _moved(edge: Edge, dx: float, dy: float) -> Edge:
    return transform_edge(edge, np.array([[1, 0, dx], [0, 1, dy]], float))


def path_area(path: CutPath) -> float:
    """Area of the board in mm2, holes taken off."""
    return signed_area(path.outer) + sum(signed_area(hole) for hole in path.holes)


def path_polygon(path: CutPath, chord_tolerance: float = CHORD_TOLERANCE) -> Polygon:
    """The board's outline as a shapely polygon, curves within the chord tolerance (mm)."""
    from shapely.geometry import Polygon

    holes = [sample_loop(hole, chord_tolerance) for hole in path.holes]
    return Polygon(sample_loop(path.outer, chord_tolerance), holes)


def loop_distance(loop: Loop, points: np.ndarray, chord_tolerance: float = CHORD_TOLERANCE) -> np.ndarray:
    """Distances (N,) in mm of points (N, 2) to the loop, within the chord tolerance."""
    import shapely

    ring = shapely.linearrings(sample_loop(loop, chord_tolerance))
    return shapely.distance(shapely.points(np.asarray(points, float)), ring)


def reverse_edge(edge: Edge) -> Edge:
    """The same edge run the other way."""
    if isinstance(edge, Circle):
        return edge.model_copy(update={"clockwise": not edge.clockwise})
    swapped = {"start": edge.end, "end": edge.start}
    if isinstance(edge, Bezier):
        swapped |= {"control_1": edge.control_2, "control_2": edge.control_1}
    return edge.model_copy(update=swapped)


def reverse_loop(loop: Loop) -> Loop:
    """The same loop run the other way."""
    return loop.model_copy(update={"edges": tuple(reverse_edge(e) for e in reversed(loop.edges))})


def transform_edge(edge: Edge, target_from_source: np.ndarray) -> Edge:
    """Move, turn, mirror or scale an edge.

    Parameters
    ----------
    edge : Edge
    target_from_source : (2, 3) array
        A similarity: arcs stay arcs. A mirroring one turns a circle's sense round, as it does every loop's.

    Raises
    ------
    ValueError
        If the matrix is not a similarity.
    """
    m = np.asarray(target_from_source, float)
    scale = np.sqrt(abs(np.linalg.det(m[:, :2])))
    if not np.allclose(m[:, :2].T @ m[:, :2], scale**2 * np.eye(2), atol=1e-9 * scale**2) or scale == 0:
        raise ValueError(f"target_from_source: {m.tolist()}: not a similarity: turn, mirror, move, scale evenly")
    fields = ("start", "mid", "control_1", "control_2", "end", "centre")
    moved = {f: _apply(m, getattr(edge, f)) for f in fields if hasattr(edge, f)}
    if isinstance(edge, Circle):
        mirrored = bool(np.linalg.det(m[:, :2]) < 0)
        moved |= {"radius": float(edge.radius * scale), "clockwise": edge.clockwise != mirrored}
    return edge.model_copy(update=moved)


def _apply(m: np.ndarray, point: tuple[float, float]) -> tuple[float, float]:
    x, y = m[:, :2] @ np.array(point) + m[:, 2]
    return float(x), float(y)


def transform_loop(loop: Loop, target_from_source: np.ndarray) -> Loop:
    """Every edge of the loop by `transform_edge`; a mirroring matrix turns the loop's sense round."""
    return loop.model_copy(update={"edges": tuple(transform_edge(e, target_from_source) for e in loop.edges)})


def transform_path(path: CutPath, target_from_source: np.ndarray) -> CutPath:
    """Transform a cut path and keep its sense: outer loop counter-clockwise, holes clockwise.

    Examples
    --------
    >>> import numpy as np
    >>> turned = transform_path(path, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]))  # a quarter turn
    """
    loops = [transform_loop(loop, target_from_source) for loop in (path.outer, *path.holes)]
    if np.linalg.det(np.asarray(target_from_source, float)[:, :2]) < 0:
        loops = [reverse_loop(loop) for loop in loops]
    return CutPath(outer=loops[0], holes=tuple(loops[1:]))


def mirror_path(path: CutPath) -> CutPath:
    """The path seen from the board's other side: x turned round, senses kept."""
    return transform_path(path, np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
