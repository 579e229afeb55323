"""Relations between edges as CasADi functions of their unknowns: values that vanish, and exact derivatives.

Each template is built once and evaluated on the unknowns of the edges at hand; lengths in mm, angles as sines, so
that values are small numbers in natural units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import casadi

__all__ = ["Relation", "evaluate"]


@dataclass(frozen=True, eq=False)
class Relation:
    """One relation: a template's name and the positions of its arguments among all unknowns."""

    kind: str
    columns: tuple[int, ...]
    label: str


def evaluate(relation: Relation, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (E,) and Jacobian (E, C) by the relation's own columns."""
    value, jacobian = _template(relation.kind)(unknowns[list(relation.columns)])
    return np.array(value).ravel(), np.array(jacobian)


@cache
def _template(kind: str) -> casadi.Function:
    import casadi

    size, expression = _EXPRESSIONS[kind]
    x = casadi.SX.sym("x", size)
    value = expression(x)
    return casadi.Function(kind.replace(" ", "_"), [x], [value, casadi.jacobian(value, x)])


def _two_lines(x: casadi.SX) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
    """Unit directions of lines (x0 x1)-(x2 x3) and (x4 x5)-(x6 x7), and the way from the first's middle to the
    second's.
    """
    import casadi

    u, v = x[2:4] - x[0:2], x[6:8] - x[4:6]
    return u / casadi.norm_2(u), v / casadi.norm_2(v), (x[4:6] + x[6:8] - x[0:2] - x[2:4]) / 2


def _cross(a: casadi.SX, b: casadi.SX) -> casadi.SX:
    return a[0] * b[1] - a[1] * b[0]


def _parallel(x: casadi.SX) -> casadi.SX:
    u, v, _ = _two_lines(x)
    return _cross(u, v)


def _perpendicular(x: casadi.SX) -> casadi.SX:
    u, v, _ = _two_lines(x)
    return u[0] * v[0] + u[1] * v[1]


def _collinear(x: casadi.SX) -> casadi.SX:
    import casadi

    u, v, gap = _two_lines(x)
    return casadi.vertcat(_cross(u, v), _cross(u, gap))


def _equal_length(x: casadi.SX) -> casadi.SX:
    import casadi

    return casadi.norm_2(x[2:4] - x[0:2]) - casadi.norm_2(x[6:8] - x[4:6])


def _circle(x: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
    """Centre and radius of the arc with nodes x0 x1, x2 x3 and bulge x4."""
    import casadi

    chord = x[2:4] - x[0:2]
    right = casadi.vertcat(chord[1], -chord[0])
    centre = (x[0:2] + x[2:4]) / 2 - (1 - x[4] ** 2) / (4 * x[4]) * right
    return centre, casadi.norm_2(chord) * (1 + x[4] ** 2) / (4 * casadi.fabs(x[4]))


def _equal_radius(x: casadi.SX) -> casadi.SX:
    return _circle(x[0:5])[1] - _circle(x[5:10])[1]


def _concentric(x: casadi.SX) -> casadi.SX:
    return _circle(x[0:5])[0] - _circle(x[5:10])[0]


def _mirrored(x: casadi.SX) -> casadi.SX:
    """Point x2 x3 is the mirror image of x4 x5 in the axis with normal angle x0 at distance x1 from the origin."""
    import casadi

    normal = casadi.vertcat(casadi.cos(x[0]), casadi.sin(x[0]))
    p, q = x[2:4], x[4:6]
    return p - q - 2 * (normal[0] * p[0] + normal[1] * p[1] - x[1]) * normal


def _on_axis(x: casadi.SX) -> casadi.SX:
    import casadi

    return casadi.cos(x[0]) * x[2] + casadi.sin(x[0]) * x[3] - x[1]


def _equal(x: casadi.SX) -> casadi.SX:
    return x[0] - x[1]


_EXPRESSIONS: dict[str, tuple[int, Callable]] = {
    "parallel": (8, _parallel),
    "perpendicular": (8, _perpendicular),
    "collinear": (8, _collinear),
    "equal length": (8, _equal_length),
    "equal radius": (10, _equal_radius),
    "concentric": (10, _concentric),
    "mirrored": (6, _mirrored),
    "on axis": (4, _on_axis),
    "equal": (2, _equal),
}
