"""From fitted chains to the edges of a cut path, and a check that it does not cross itself."""

from __future__ import annotations

import numpy as np

from kerfwright.errors import StageError
from kerfwright.model import Arc, Bezier, Circle, CutPath, Edge, Line, Loop, Origin
from kerfwright.model.geometry import path_polygon
from kerfwright.refine.curves.ranges import ARC, CUBIC
from kerfwright.refine.curves.shape import Shape

__all__ = ["check_path", "loop_of_shape"]


def loop_of_shape(shape: Shape, errors: list[float], origin: np.ndarray) -> Loop:
    """Edges that share their end points to the last bit; `errors` are their standard errors, `origin` moves them
    back.
    """
    nodes = [_point(shape.node(k) + origin) for k in range(shape.count)]
    edges = [_edge(shape, k, nodes[k], nodes[(k + 1) % shape.count], errors[k], origin) for k in range(shape.count)]
    return Loop(edges=tuple(edges))


def _point(p: np.ndarray) -> tuple[float, float]:
    return float(p[0]), float(p[1])


def _edge(
    shape: Shape, k: int, start: tuple[float, float], end: tuple[float, float], error: float, origin: np.ndarray
) -> Edge:
    source = Origin.IMPLIED if shape.lines[k] >= 0 else Origin.MEASURED
    if shape.kinds[k] == ARC:
        centre, radius, first, sweep = shape.arc(k)
        middle = centre + radius * np.array([np.cos(first + sweep / 2), np.sin(first + sweep / 2)])
        return Arc(start=start, mid=_point(middle + origin), end=end, standard_error=error, origin=source)
    if shape.kinds[k] == CUBIC:
        c1, c2 = (_point(c + origin) for c in shape.controls(k)[1:3])
        return Bezier(start=start, control_1=c1, control_2=c2, end=end, standard_error=error, origin=source)
    return Line(start=start, end=end, standard_error=error, origin=source)


def check_path(path: CutPath) -> None:
    """Refuse a path that crosses itself, whose holes leave the outer loop, or of which an arc is a point.

    Raises
    ------
    StageError
        With the place of the first fault.
    """
    from shapely import is_valid_reason

    try:
        polygon = path_polygon(path, 0.05)
    except ValueError as error:  # an edge shrunk to a point, by relations between edges
        raise StageError(f"cut path: {error}") from error
    if not polygon.is_valid or polygon.area <= 0:
        raise StageError(
            f"cut path: loops: {is_valid_reason(polygon)}: the boundary is too rough or crosses itself there"
        )


def full_circle(centre: np.ndarray, radius: float, clockwise: bool, error: float) -> Loop:
    """A loop that is one circle."""
    circle = Circle(centre=_point(centre), radius=float(radius), clockwise=clockwise, standard_error=error)
    return Loop(edges=(circle,))
