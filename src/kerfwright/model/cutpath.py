"""The closed paths along which a board is cut, in the board's own plane, millimetres.

The outer loop runs counter-clockwise, holes clockwise, so that the material is always on the left.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from kerfwright.model.quantity import Frozen, Origin

__all__ = ["Arc", "Bezier", "Circle", "CutPath", "Edge", "Line", "Loop", "Point2"]

Point2 = tuple[float, float]


class _EdgeBase(Frozen):
    standard_error: float | None = Field(default=None, ge=0)  # of the edge's position across itself, mm
    origin: Origin = Origin.MEASURED


class Line(_EdgeBase):
    """A straight cut."""

    kind: Literal["line"] = "line"
    start: Point2
    end: Point2


class Arc(_EdgeBase):
    """A circular arc through three points: no ambiguity of side or turn."""

    kind: Literal["arc"] = "arc"
    start: Point2
    mid: Point2
    end: Point2


class Bezier(_EdgeBase):
    """A cubic Bezier curve."""

    kind: Literal["bezier"] = "bezier"
    start: Point2
    control_1: Point2
    control_2: Point2
    end: Point2


class Circle(_EdgeBase):
    """A full circle: the only edge of its loop. `clockwise` is true for a hole."""

    kind: Literal["circle"] = "circle"
    centre: Point2
    radius: float = Field(gt=0)
    clockwise: bool = False


Edge = Annotated[Line | Arc | Bezier | Circle, Field(discriminator="kind")]


class Loop(Frozen):
    """A closed chain of edges: each starts exactly where the one before it ends, the first where the last ends."""

    edges: tuple[Edge, ...] = Field(min_length=1)


class CutPath(Frozen):
    """An outer loop, counter-clockwise, and the holes in it, clockwise."""

    outer: Loop
    holes: tuple[Loop, ...] = ()
