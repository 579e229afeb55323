"""Whether boards run into each other.

Most pairs are told apart by the direction of a flat face of one: along it, all of the other lies ahead. Only the rest
is intersected by OCCT, whose boolean takes 15 to 45 ms a pair, and far more where solids nearly coincide.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.errors import ModelError
from kerfwright.solid.faces import Shape

if TYPE_CHECKING:
    import build123d

__all__ = ["common_solid", "common_volume", "near_pairs", "penetration", "separation"]


def near_pairs(shapes: list[Shape], reach: float) -> Iterator[tuple[Shape, Shape]]:
    """Pairs whose boxes come within reach (mm) of each other."""
    for a, b in combinations(shapes, 2):
        if (a.box[0] <= b.box[1] + reach).all() and (b.box[0] <= a.box[1] + reach).all():
            yield a, b


def penetration(a: Shape, b: Shape) -> float:
    """How deep the boards reach into each other at most, mm: the least over all flat faces; 0 if one parts them."""
    return max(0.0, min(_depth(a, b), _depth(b, a)))


def separation(a: Shape, b: Shape) -> float:
    """How far apart the boards are at least, mm: the most that a flat face's plane tells; 0 if none parts them."""
    return max(0.0, -min(_depth(a, b), _depth(b, a)))


def _depth(a: Shape, b: Shape) -> float:
    """The least, over the directions of a's faces, of how far b reaches back behind the foremost of a."""
    normals = np.array([face.normal for face in a.faces]).T
    return float(((a.points @ normals).max(axis=0) - (b.points @ normals).min(axis=0)).min())


def common_volume(a: Shape, b: Shape) -> float:
    """Volume that two solids share, mm3.

    Raises
    ------
    ModelError
        If OCCT cannot intersect them.
    """
    return max(0.0, common_solid(a, b).volume)


def common_solid(a: Shape, b: Shape) -> build123d.Compound:
    """What two solids share: any number of solids.

    Raises
    ------
    ModelError
        If OCCT cannot intersect them.
    """
    from build123d import Compound
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
    from OCP.TopTools import TopTools_ListOfShape

    arguments, tools = TopTools_ListOfShape(), TopTools_ListOfShape()
    arguments.Append(a.solid.wrapped)
    tools.Append(b.solid.wrapped)
    operation = BRepAlgoAPI_Common()
    operation.SetArguments(arguments)
    operation.SetTools(tools)
    operation.SetNonDestructive(True)
    operation.SetUseOBB(True)
    operation.Build()
    if not operation.IsDone():
        raise ModelError(f"boards {a.name!r} and {b.name!r}: OCCT cannot intersect them: look at both for tiny edges")
    return Compound(operation.Shape())
