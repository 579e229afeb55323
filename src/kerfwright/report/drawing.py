"""A board as a dimensioned drawing: SVG, one unit a millimetre, seen from its top side.

Everything is drawn with y up, as in the board's frame; labels are turned back upright.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import numpy as np

from kerfwright.model import Arc, Bevel, Bezier, Board, Circle, Edge, Line, Loop
from kerfwright.model.geometry import arc_circle, edge_end, edge_length, edge_points, edge_tangents, sample_loop

__all__ = ["board_svg", "loop_path"]

MOST_LABELS = 16  # lengths of edges are left out of a path with more edges: they would cover it
SMOOTH_DEGREES = 3.0  # tangents that differ by less meet smoothly, to the eye


def board_svg(board: Board) -> str:
    """Cut path with its nodes, lengths, radii, bevels and overall dimensions, as an `<svg>` element."""
    points = sample_loop(board.cut_path.outer)
    low, high = points.min(axis=0), points.max(axis=0)
    unit = float(max(high - low)) / 40  # height of a letter
    loops = (board.cut_path.outer, *board.cut_path.holes)
    inside = [
        f'<path class="wood" fill-rule="evenodd" d="{" ".join(loop_path(loop) for loop in loops)}"/>',
        *(_bevel(bevel, unit) for bevel in board.bevels),
        *(node for loop in loops for node in _nodes(loop, unit)),
        *(label for loop in loops for label in _labels(loop, unit)),
        *_dimensions(low, high, unit),
    ]
    x, y = low[0] - 5 * unit, -high[1] - 2 * unit
    width, height = high - low + np.array([8 * unit, 7 * unit])
    return (
        f'<svg viewBox="{_n(x)} {_n(y)} {_n(width)} {_n(height)}" role="img">'
        f"<title>{escape(board.name)}</title>"
        f'<g transform="scale(1,-1)" font-size="{_n(unit * 1.4)}">{"".join(inside)}</g></svg>'
    )


def _n(value: float) -> str:
    """A coordinate to a hundredth of a millimetre, without trailing zeros or a negative zero."""
    return f"{round(float(value), 2) + 0.0:g}" if abs(value) < 1e4 else f"{value:.2f}"


def loop_path(loop: Loop) -> str:
    """A loop as the data of an SVG path, y up."""
    first = loop.edges[0]
    if isinstance(first, Circle):
        return _circle_path(first)
    return f"M{_xy(first.start)}" + "".join(_segment(edge) for edge in loop.edges) + "Z"


def _segment(edge: Edge) -> str:
    if isinstance(edge, Bezier):
        return f"C{_xy(edge.control_1)} {_xy(edge.control_2)} {_xy(edge.end)}"
    if isinstance(edge, Arc):
        _, radius, sweep = arc_circle(edge)
        return f"A{_n(radius)} {_n(radius)} 0 {int(abs(sweep) > np.pi)} {int(sweep > 0)} {_xy(edge.end)}"
    return f"L{_xy(edge.end)}"


def _circle_path(circle: Circle) -> str:
    (x, y), r = circle.centre, circle.radius
    half = f"A{_n(r)} {_n(r)} 0 0 {int(not circle.clockwise)} "
    return f"M{_xy((x + r, y))}{half}{_xy((x - r, y))}{half}{_xy((x + r, y))}Z"


def _xy(point: tuple[float, float]) -> str:
    return f"{_n(point[0])} {_n(point[1])}"


def _bevel(bevel: Bevel, unit: float) -> str:
    """Red leans the face so that the top is the shorter side, green the other way."""
    lean = "top-shorter" if bevel.angle.value > 0 else "top-longer"
    edge = Line(start=bevel.start, end=bevel.end)
    line = f'<path class="bevel {lean}" d="M{_xy(bevel.start)}L{_xy(bevel.end)}"/>'
    label = _beside(edge, unit, along=0.25)  # the edge's length stands at its middle
    return line + _text(label, f"{abs(bevel.angle.value):.1f}°", f"bevel {lean}", unit, _reading_angle(edge))


def _nodes(loop: Loop, unit: float) -> Iterator[str]:
    """A square where the path turns sharply, a ring where it goes on smoothly."""
    if isinstance(loop.edges[0], Circle):
        return
    onward = (*loop.edges[1:], loop.edges[0])
    for edge, following in zip(loop.edges, onward, strict=True):
        x, y = edge_end(edge)
        out, into = edge_tangents(edge, np.array([1.0]))[0], edge_tangents(following, np.array([0.0]))[0]
        smooth = float(out @ into) > np.cos(np.radians(SMOOTH_DEGREES))
        title = f"<title>{x:.1f}, {y:.1f} mm, {'smooth' if smooth else 'sharp'}</title>"
        if smooth:
            yield f'<circle class="node" cx="{_n(x)}" cy="{_n(y)}" r="{_n(unit * 0.35)}">{title}</circle>'
        else:
            side, s = _n(unit * 0.6), unit * 0.3
            yield f'<rect class="node" x="{_n(x - s)}" y="{_n(y - s)}" width="{side}" height="{side}">{title}</rect>'


def _labels(loop: Loop, unit: float) -> Iterator[str]:
    """Lengths of straight edges, radii of arcs, diameters of holes, inside of the path."""
    for edge in loop.edges if len(loop.edges) <= MOST_LABELS else ():
        if isinstance(edge, Circle):
            yield _text(np.array(edge.centre), f"⌀{2 * edge.radius:.1f}", "size", unit)
        elif isinstance(edge, Arc):
            yield _text(_beside(edge, unit), f"R{arc_circle(edge)[1]:.1f}", "size", unit)
        elif isinstance(edge, Line) and edge_length(edge) > 5 * unit:
            yield _text(_beside(edge, unit), f"{edge_length(edge):.1f}", "size", unit, _reading_angle(edge))


def _beside(edge: Edge, unit: float, along: float = 0.5) -> np.ndarray:
    """A point on the material's side of an edge."""
    tangent = edge_tangents(edge, np.array([along]))[0]
    return edge_points(edge, np.array([along]))[0] + 1.4 * unit * np.array([-tangent[1], tangent[0]])


def _reading_angle(edge: Line) -> float:
    """Degrees by which a label along the edge is turned, so that it reads from below or from the right."""
    (x0, y0), (x1, y1) = edge.start, edge.end
    angle = np.degrees(np.arctan2(y1 - y0, x1 - x0))
    return float((angle + 89.9) % 180 - 89.9)


def _dimensions(low: np.ndarray, high: np.ndarray, unit: float) -> Iterator[str]:
    """Overall length below the board and width to the left of it."""
    y, x = low[1] - 2 * unit, low[0] - 2 * unit
    for (x0, y0), (x1, y1) in (((low[0], y), (high[0], y)), ((x, low[1]), (x, high[1]))):
        yield f'<path class="dimension" d="M{_n(x0)} {_n(y0)}L{_n(x1)} {_n(y1)}"/>'
    yield _text(np.array([(low[0] + high[0]) / 2, y - 1.6 * unit]), f"{high[0] - low[0]:.1f}", "overall", unit)
    yield _text(np.array([x - 1.2 * unit, (low[1] + high[1]) / 2]), f"{high[1] - low[1]:.1f}", "overall", unit, turn=90)


def _text(at: np.ndarray, words: str, kind: str, unit: float, turn: float = 0) -> str:
    place = f"translate({_n(at[0])},{_n(at[1])}) scale(1,-1)" + (f" rotate({_n(-turn)})" if turn else "")
    return f'<text class="{kind}" transform="{place}" dy="{_n(unit * 0.45)}">{escape(words)}</text>'
