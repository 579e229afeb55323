"""Loops without slits and fins that no tool cuts: places where an outline doubles back on itself."""

from __future__ import annotations

import numpy as np

from kerfwright.model.cutpath import Circle, Edge, Line, Loop
from kerfwright.model.geometry import edge_points, edge_tangents
from kerfwright.model.pieces import edge_piece

__all__ = ["without_idle_nodes", "without_slits"]

BACK = np.radians(175)  # turn from which an outline doubles back: no board has a corner of five degrees
_PROBES = np.linspace(0, 1, 513)


def without_slits(loop: Loop, width: float) -> Loop:
    """The loop, bridged where two edges double back on each other, at the place where they are `width` apart.

    Parameters
    ----------
    loop : of any edges
    width : mm; a slit that is nowhere as wide is left as it is
    """
    edges = list(loop.edges)
    for k in range(len(edges)):
        after = (k + 1) % len(edges)
        if len(edges) < 3 or not _doubles_back(edges[k], edges[after]):
            continue
        if bridged := _bridged(edges[k], edges[after], width):
            before, bridge, behind = bridged
            edges[k], edges[after] = before, behind
            edges.insert(k + 1, bridge)
            return without_slits(Loop(edges=tuple(edges)), width)
    return loop


def without_idle_nodes(loop: Loop, within: float) -> Loop:
    """The loop with lines that are one to `within` mm as one, with the longer one's provenance."""
    edges = list(loop.edges)
    k = 0
    while k < len(edges) and len(edges) > 3:
        joined = _one_line(edges[k - 1], edges[k], within)
        if joined is None:
            k += 1
        else:
            edges[k - 1] = joined
            del edges[k]
            k = max(k - 1, 0)
    return Loop(edges=tuple(edges)) if len(edges) < len(loop.edges) else loop


def _one_line(edge: Edge, after: Edge, within: float) -> Line | None:
    """Both lines as one; None where the node between them is a corner, or either is none."""
    if not (isinstance(edge, Line) and isinstance(after, Line)):
        return None
    a, node, b = (np.array(p) for p in (edge.start, edge.end, after.end))
    length = float(np.linalg.norm(b - a))
    longer = max((edge, after), key=lambda e: np.linalg.norm(np.subtract(e.end, e.start)))
    if length < float(np.linalg.norm(np.subtract(longer.end, longer.start))) - within:
        return None  # it turns back
    off = abs((b - a)[0] * (node - a)[1] - (b - a)[1] * (node - a)[0]) / max(length, within)
    return longer.model_copy(update={"start": edge.start, "end": after.end}) if off < within else None


def _doubles_back(edge: Edge, after: Edge) -> bool:
    if isinstance(edge, Circle) or isinstance(after, Circle):
        return False
    u, v = edge_tangents(edge, np.ones(1))[0], edge_tangents(after, np.zeros(1))[0]
    return bool(u @ v < np.cos(BACK))


def _bridged(edge: Edge, after: Edge, width: float) -> tuple[Edge, Edge, Edge] | None:
    """The rest of both edges, and the line between them; None where they are nowhere that far apart."""
    own, other = edge_points(edge, _PROBES), edge_points(after, _PROBES)
    distances = np.hypot(*(other[:, None] - own[None]).transpose(2, 0, 1))
    wide = np.flatnonzero(distances.min(axis=1) >= width)
    if not len(wide) or wide[0] == len(_PROBES) - 1:
        return None
    nearest = int(distances[wide[0]].argmin())
    if nearest == 0:
        return None
    before, behind = edge_piece(edge, 0.0, _PROBES[nearest]), edge_piece(after, _PROBES[wide[0]], 1.0)
    return before, Line(start=before.end, end=behind.start), behind
