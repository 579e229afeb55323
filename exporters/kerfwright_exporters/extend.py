"""Curves drawn on past their ends, along themselves."""

from __future__ import annotations

import numpy as np

from kerfwright.model import Arc, Bezier
from kerfwright.model.geometry import arc_circle
from kerfwright.model.pieces import polar_form

__all__ = ["extended_edge"]

MOST = 0.25  # share of its own length that a curve is drawn on at most: Beziers run wild further out


def extended_edge(edge: Arc | Bezier, length: float, at_end: bool) -> Arc | Bezier:
    """The edge with about so many millimetres more at its end, or else at its start."""
    if isinstance(edge, Bezier):
        return _longer_bezier(edge, length, at_end)
    centre, radius, sweep = arc_circle(edge)
    more = np.sign(sweep) * min(length / radius, MOST * abs(sweep), (2 * np.pi - abs(sweep)) / 3)
    low, high = (0.0, sweep + more) if at_end else (-more, sweep)
    spoke = np.array(edge.start) - centre
    points = [centre + _turned(spoke, angle) for angle in (low, (low + high) / 2, high)]
    named = dict(zip(("start", "mid", "end"), points, strict=True))
    del named["start" if at_end else "end"]  # the other end stays as it is, to the last digit
    return edge.model_copy(update={k: tuple(map(float, p)) for k, p in named.items()})


def _turned(vector: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]) @ vector


def _longer_bezier(edge: Bezier, length: float, at_end: bool) -> Bezier:
    """The same cubic over a longer stretch of its parameter, by its polar form."""
    controls = np.array([edge.start, edge.control_1, edge.control_2, edge.end])
    speed = 3 * np.hypot(*(controls[3] - controls[2] if at_end else controls[1] - controls[0]))
    more = min(length / max(speed, 1e-9), MOST)
    low, high = (0.0, 1 + more) if at_end else (-more, 1.0)
    points = [polar_form(controls, *arguments) for arguments in
              ((low, low, low), (low, low, high), (low, high, high), (high, high, high))]  # fmt: skip
    points[0 if at_end else 3] = np.array(edge.start if at_end else edge.end)
    names = ("start", "control_1", "control_2", "end")
    return edge.model_copy(update={k: tuple(map(float, p)) for k, p in zip(names, points, strict=True)})
