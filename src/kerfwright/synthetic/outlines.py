"""Cut paths as carpenters draw them: rectangles with what is sawn out of them, pens for the rest.

Board plane, millimetres; outer loops run counter-clockwise, holes clockwise.
"""

from __future__ import annotations

import numpy as np

from kerfwright.model import Arc, Bezier, Circle, CutPath, Edge, Line, Loop

__all__ = ["Pen", "arched", "circle_hole", "polygon", "rectangle", "rounded", "slot_hole"]

Point = tuple[float, float]


class Pen:
    """Draws a loop edge by edge.

    Examples
    --------
    >>> loop = Pen((0, 0)).line((100, 0)).arc((120, 20), (100, 40)).line((0, 40)).close()
    """

    def __init__(self, start: Point) -> None:
        self._edges: list[Edge] = []
        self._start = self._at = (float(start[0]), float(start[1]))

    def line(self, end: Point) -> Pen:
        """A straight cut; nothing where the pen is already there."""
        end = (float(end[0]), float(end[1]))
        if np.hypot(end[0] - self._at[0], end[1] - self._at[1]) > 1e-6:
            self._edges.append(Line(start=self._at, end=end))
            self._at = end
        return self

    def arc(self, mid: Point, end: Point) -> Pen:
        """A circular arc through `mid`."""
        end = (float(end[0]), float(end[1]))
        self._edges.append(Arc(start=self._at, mid=(float(mid[0]), float(mid[1])), end=end))
        self._at = end
        return self

    def bezier(self, control_1: Point, control_2: Point, end: Point) -> Pen:
        """A cubic Bezier curve."""
        c1, c2, end = (tuple(float(v) for v in p) for p in (control_1, control_2, end))
        self._edges.append(Bezier(start=self._at, control_1=c1, control_2=c2, end=end))
        self._at = end
        return self

    def close(self) -> Loop:
        """The loop, closed by a straight cut where it is open."""
        self.line(self._start)
        last = self._edges[-1]
        if last.end != self._start:  # equal but for rounding: loops join exactly
            self._edges[-1] = last.model_copy(update={"end": self._start})
        return Loop(edges=tuple(self._edges))


def polygon(points: list[Point] | np.ndarray) -> CutPath:
    """Straight cuts through points (N, 2), counter-clockwise."""
    pen = Pen(tuple(points[0]))
    for point in points[1:]:
        pen.line(tuple(point))
    return CutPath(outer=pen.close())


def rectangle(length: float, width: float, *holes: Loop) -> CutPath:
    """A board from (0, 0) to (length, width)."""
    return CutPath(outer=polygon([(0, 0), (length, 0), (length, width), (0, width)]).outer, holes=holes)


def rounded(length: float, width: float, radii: tuple[float, float, float, float], *holes: Loop) -> CutPath:
    """A rectangle whose corners, counter-clockwise from (0, 0), are rounded; radius 0 leaves a corner sharp."""
    corners = [((0, 0), (1, 0)), ((length, 0), (0, 1)), ((length, width), (-1, 0)), ((0, width), (0, -1))]
    steps = [_corner(np.array(at, float), np.array(out, float), r) for (at, out), r in zip(corners, radii, strict=True)]
    pen = Pen(tuple(steps[0][-1]))
    for step in (*steps[1:], steps[0]):
        pen.line(tuple(step[0]))
        if len(step) == 3:
            pen.arc(tuple(step[1]), tuple(step[2]))
    return CutPath(outer=pen.close(), holes=holes)


def _corner(at: np.ndarray, out: np.ndarray, radius: float) -> list[np.ndarray]:
    """The corner itself, or start, middle and end of the arc that rounds it; `out` is the side that leaves it."""
    if radius <= 0:
        return [at]
    back = np.array([-out[1], out[0]])  # a quarter turn left: where the side came from
    centre = at + radius * (out + back)
    return [at + radius * back, centre - radius * (out + back) / np.sqrt(2), at + radius * out]


def arched(length: float, width: float, foot: float, rise: float, *holes: Loop) -> CutPath:
    """A rectangle stood on two feet: a circular arc of the given rise is cut out of the side x = 0.

    The side x = 0 keeps `foot` mm at either end.
    """
    pen = Pen((0, 0)).line((length, 0)).line((length, width)).line((0, width)).line((0, width - foot))
    return CutPath(outer=pen.arc((rise, width / 2), (0, foot)).close(), holes=holes)


def circle_hole(centre: Point, radius: float) -> Loop:
    """A round hole."""
    return Loop(edges=(Circle(centre=(float(centre[0]), float(centre[1])), radius=float(radius), clockwise=True),))


def slot_hole(centre: Point, length: float, width: float) -> Loop:
    """A hand hold along x: two straight sides and two half circles."""
    (x, y), half, r = centre, (length - width) / 2, width / 2
    pen = Pen((x - half, y - r)).arc((x - half - r, y), (x - half, y + r)).line((x + half, y + r))
    return pen.arc((x + half + r, y), (x + half, y - r)).close()
