"""Relief cuts in inside corners, so that a square neighbour goes in although the tool is round.

A dogbone is a round of the tool's radius through the corner, centred on its bisector; a T-bone lies beside the longer
of the two edges and runs past the corner along it.
"""

from __future__ import annotations

import numpy as np

from kerfwright.errors import ExportError
from kerfwright.model import Arc, CutPath, Edge, Line, Loop
from kerfwright.model.geometry import edge_length, edge_tangents

__all__ = ["relieved_path"]

SHARP = np.radians(3)  # of turn to the right, from which a corner counts as one


def relieved_path(path: CutPath, kind: str, tool_diameter: float, name: str) -> CutPath:
    """The cut path with a relief in every sharp inside corner between two straight edges.

    Raises
    ------
    ExportError
        If an edge is too short for its reliefs.
    """
    loops = [_relieved(loop, kind, tool_diameter / 2, name) for loop in (path.outer, *path.holes)]
    return CutPath(outer=loops[0], holes=tuple(loops[1:]))


def _relieved(loop: Loop, kind: str, radius: float, name: str) -> Loop:
    count = len(loop.edges)
    arcs = [_relief(loop.edges[k], loop.edges[(k + 1) % count], kind, radius) for k in range(count)]
    edges: list[Edge] = []
    for k, edge in enumerate(loop.edges):
        edges.append(_shortened(edge, arcs[k - 1], arcs[k], name))
        if arcs[k] is not None:
            edges.append(arcs[k])
    return Loop(edges=tuple(edges))


def _relief(before: Edge, after: Edge, kind: str, radius: float) -> Arc | None:
    """The round that takes the place of the corner between two edges; None where there is nothing to relieve."""
    if not (isinstance(before, Line) and isinstance(after, Line)) or before is after:
        return None
    u, v = edge_tangents(before, np.zeros(1))[0], edge_tangents(after, np.zeros(1))[0]
    turn = np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v)
    if turn > -SHARP:
        return None
    corner = np.array(before.end)
    centre = corner + radius * (_bisector(u, v) if kind == "dogbone" else _beside_longer(before, after, u, v))
    start, end = (corner + 2 * ((centre - corner) @ t) * t for t in (u, v))
    middle = _middle(centre, radius, start, end, corner)
    return Arc(start=tuple(start), mid=tuple(middle), end=tuple(end))


def _bisector(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """From the corner into the void, halfway between the edges."""
    inward = v - u
    return inward / np.hypot(*inward)


def _beside_longer(before: Line, after: Line, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Square to the longer edge, into the void: the round touches that edge in the corner."""
    t = u if edge_length(before) >= edge_length(after) else v
    return np.array([t[1], -t[0]])


def _middle(centre: np.ndarray, radius: float, start: np.ndarray, end: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """A point of the round between start and end on the side of the material."""
    chord = end - start
    aside = np.array([-chord[1], chord[0]]) / np.hypot(*chord)  # left of the way on: the material
    return centre + radius * aside


def _shortened(edge: Edge, before: Arc | None, after: Arc | None, name: str) -> Edge:
    """The edge from the end of one relief to the start of the next."""
    if before is None and after is None:  # round holes have no ends
        return edge
    start = edge.start if before is None else before.end
    end = edge.end if after is None else after.start
    if np.subtract(end, start) @ np.subtract(edge.end, edge.start) <= 0:
        raise ExportError(
            f"board {name!r}: relief: the edge at ({edge.start[0]:.1f}, {edge.start[1]:.1f}) is only "
            f"{edge_length(edge):.1f} mm long: take a smaller tool"
        )
    return edge.model_copy(update={"start": start, "end": end})
