"""Pieces of edges: the same curve between two of its parameters."""

from __future__ import annotations

import numpy as np

from kerfwright.model.cutpath import Arc, Bezier, Circle, Edge
from kerfwright.model.geometry import edge_points

__all__ = ["edge_piece", "polar_form"]


def edge_piece(edge: Edge, low: float, high: float) -> Edge:
    """The edge from parameter `low` to `high`; ends at 0 and 1 stay as they are, to the last digit.

    Raises
    ------
    ValueError
        If the edge is a circle: a part of it is an arc.
    """
    if isinstance(edge, Circle):
        raise ValueError("a circle has no ends: take an arc of it")
    if (low, high) == (0.0, 1.0):
        return edge
    points = edge_points(edge, np.array([low, (low + high) / 2, high]))
    found = {"start": points[0], "end": points[2]}
    if isinstance(edge, Arc):
        found["mid"] = points[1]
    if isinstance(edge, Bezier):
        controls = np.array([edge.start, edge.control_1, edge.control_2, edge.end])
        found["control_1"] = polar_form(controls, low, low, high)
        found["control_2"] = polar_form(controls, low, high, high)
    kept = {"start": low == 0.0, "end": high == 1.0}
    return edge.model_copy(update={k: tuple(map(float, p)) for k, p in found.items() if not kept.get(k)})


def polar_form(controls: np.ndarray, *parameters: float) -> np.ndarray:
    """The polar form of a Bezier of controls (N + 1, 2) at N parameters: de Casteljau's steps, each with its own."""
    points = controls
    for t in parameters:
        points = (1 - t) * points[:-1] + t * points[1:]
    return points[0]
