"""The path of a tool's centre: a loop moved to its right by half the kerf, arcs kept as arcs.

The material is on the left of every loop, so that the tool is on its right, outside outlines and inside holes.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kerfwright.errors import ExportError
from kerfwright.model import Arc, Circle, Edge, Line, Loop
from kerfwright.model.geometry import arc_circle, arc_from_bulge, edge_end, edge_start, edge_tangents, sample_loop

__all__ = ["offset_loop"]

TOUCH = 1e-7  # mm, below which two ends are one point
PROBE_CHORD = 0.01  # mm, of the samples that prove the result


def offset_loop(loop: Loop, distance: float, name: str) -> Loop:
    """A loop of lines, arcs and circles moved to its right.

    Parameters
    ----------
    loop : without Beziers
    distance : mm, above 0
    name : of the board, for the error

    Raises
    ------
    ExportError
        If a tool of that radius does not fit into the loop.
    """
    first = loop.edges[0]
    if isinstance(first, Circle):
        return Loop(edges=(_circle(first, distance, name),))
    moved = [(edge, _moved(edge, distance, name)) for edge in loop.edges]
    edges = tuple(_joined(moved, distance, name))
    result = Loop(edges=edges)
    _prove(loop, result, distance, name)
    return result


def _refusal(name: str, distance: float, why: str) -> ExportError:
    return ExportError(f"board {name!r}: kerf: {2 * distance:g} mm: {why}: take a smaller tool")


def _circle(circle: Circle, distance: float, name: str) -> Circle:
    radius = circle.radius + (-distance if circle.clockwise else distance)
    if radius <= TOUCH:
        raise _refusal(name, distance, f"does not fit into the hole of radius {circle.radius:g} mm")
    return circle.model_copy(update={"radius": radius})


def _moved(edge: Edge, distance: float, name: str) -> Edge | None:
    """The edge moved aside; None for an inside arc of the tool's own radius, which becomes a point."""
    if isinstance(edge, Line):
        x, y = edge_tangents(edge, np.zeros(1))[0]
        shift = distance * np.array([y, -x])
        return edge.model_copy(update={f: tuple(np.array(getattr(edge, f)) + shift) for f in ("start", "end")})
    centre, radius, sweep = arc_circle(edge)
    grown = radius + distance * np.sign(sweep)
    if grown < -TOUCH:
        raise _refusal(name, distance, f"does not fit into the inside radius of {radius:g} mm")
    if grown <= TOUCH:
        return None
    points = {
        f: tuple(centre + (np.array(getattr(edge, f)) - centre) * grown / radius) for f in ("start", "mid", "end")
    }
    return edge.model_copy(update=points)


def _joined(moved: list[tuple[Edge, Edge | None]], distance: float, name: str) -> Iterator[Edge]:
    """Trim inside corners, round outside ones; arcs that became points leave two joints in a row."""
    starts: list[np.ndarray] = []
    joints: list[list[Edge]] = []
    count = len(moved)
    for k in range(count):
        trim, joint = _corner(moved[k], moved[(k + 1) % count], distance, name)
        starts.append(trim)
        joints.append(joint)
    for k, (_, edge) in enumerate(moved):
        if edge is not None:
            yield _between(edge, starts[k - 1][1], starts[k][0], distance, name)
        yield from joints[k]


def _corner(
    before: tuple[Edge, Edge | None], after: tuple[Edge, Edge | None], distance: float, name: str
) -> tuple[tuple[np.ndarray, np.ndarray], list[Edge]]:
    """Where the edge before the corner ends and the one after starts, and what joins the two."""
    vertex = np.array(edge_end(before[0]))
    u, v = edge_tangents(before[0], np.ones(1))[0], edge_tangents(after[0], np.zeros(1))[0]
    turn = float(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v))
    leave, enter = (vertex + distance * np.array([t[1], -t[0]]) for t in (u, v))
    if np.hypot(*(leave - enter)) <= TOUCH:
        return (leave, leave), []
    if turn > 0:
        return (leave, enter), [arc_from_bulge(tuple(leave), tuple(enter), float(np.tan(turn / 4)))]
    if before[1] is None or after[1] is None:
        raise _refusal(name, distance, f"does not fit into the corner at ({vertex[0]:.1f}, {vertex[1]:.1f})")
    met = _meeting(before[1], after[1], vertex)
    if met is None:
        raise _refusal(name, distance, f"does not fit into the corner at ({vertex[0]:.1f}, {vertex[1]:.1f})")
    return (met, met), []


def _between(edge: Edge, start: np.ndarray, end: np.ndarray, distance: float, name: str) -> Edge:
    """The moved edge from one point on it to another, onward."""
    if isinstance(edge, Line):
        along = np.subtract(edge.end, edge.start)
        if (end - start) @ along <= 0:
            raise _refusal(name, distance, f"does not fit between the corners at {_place(start)} and {_place(end)}")
        return edge.model_copy(update={"start": tuple(start), "end": tuple(end)})
    centre, _, sweep = arc_circle(edge)
    sense = np.sign(sweep)
    first, last = (np.arctan2(*(p - centre)[::-1]) for p in (start, end))
    rest = (last - first) * sense % (2 * np.pi) * sense
    if abs(rest) > abs(sweep) + 1e-6:
        raise _refusal(name, distance, f"does not fit between the corners at {_place(start)} and {_place(end)}")
    return arc_from_bulge(tuple(start), tuple(end), float(np.tan(rest / 4)))


def _place(point: np.ndarray) -> str:
    return f"({point[0]:.1f}, {point[1]:.1f})"


def _meeting(a: Edge, b: Edge, near: np.ndarray) -> np.ndarray | None:
    """The point on both edges' lines or circles that is nearest to the corner."""
    if isinstance(a, Line) and isinstance(b, Line):
        found = _line_line(a, b)
    elif isinstance(a, Line):
        found = _line_circle(a, b)
    elif isinstance(b, Line):
        found = _line_circle(b, a)
    else:
        found = _circle_circle(a, b)
    return min(found, key=lambda p: float(np.hypot(*(p - near))), default=None)


def _line_line(a: Line, b: Line) -> list[np.ndarray]:
    u, v = np.subtract(a.end, a.start), np.subtract(b.end, b.start)
    cross = u[0] * v[1] - u[1] * v[0]
    gap = np.subtract(b.start, a.start)
    return [np.array(a.start) + u * (gap[0] * v[1] - gap[1] * v[0]) / cross] if abs(cross) > 1e-12 else []


def _line_circle(line: Line, arc: Arc) -> list[np.ndarray]:
    centre, radius, _ = arc_circle(arc)
    along = np.subtract(line.end, line.start)
    along = along / np.hypot(*along)
    foot = np.array(line.start) + along * ((centre - line.start) @ along)
    half = radius**2 - (foot - centre) @ (foot - centre)
    return [foot + s * np.sqrt(half) * along for s in (1, -1)] if half >= 0 else []


def _circle_circle(a: Arc, b: Arc) -> list[np.ndarray]:
    (p, r, _), (q, s, _) = arc_circle(a), arc_circle(b)
    gap = q - p
    d = float(np.hypot(*gap))
    if d < TOUCH or d > r + s or d < abs(r - s):
        return []
    along = (d**2 + r**2 - s**2) / (2 * d)
    height = np.sqrt(max(0.0, r**2 - along**2))
    aside = np.array([-gap[1], gap[0]]) / d
    return [p + gap / d * along + t * height * aside for t in (1, -1)]


def _prove(loop: Loop, result: Loop, distance: float, name: str) -> None:
    """Every point of the result must be the distance away from the loop, else the tool would cut into the board."""
    import shapely

    onward = (*result.edges[1:], result.edges[0])
    if any(
        np.hypot(*np.subtract(edge_end(a), edge_start(b))) > 1e-6 for a, b in zip(result.edges, onward, strict=True)
    ):
        raise _refusal(name, distance, "does not run round in one path")
    original = shapely.linearrings(sample_loop(loop, PROBE_CHORD))
    nearest = shapely.distance(shapely.points(sample_loop(result, PROBE_CHORD)), original).min()
    if nearest < distance - 3 * PROBE_CHORD:
        raise _refusal(name, distance, f"would cut {distance - nearest:.2f} mm into the board")
