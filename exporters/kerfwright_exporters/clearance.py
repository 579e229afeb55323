"""Which boards of a program must be kept off each other when its dimensions change.

Boards that touch end on each other's faces and follow them. Boards that only come near each other do not: a change of
dimensions moves a sheet by its stock and an outline by the object's size, and the two may meet.
"""

from __future__ import annotations

from dataclasses import dataclass

from kerfwright.model import Model
from kerfwright.solid import assembly_solids
from kerfwright.solid.faces import shape_of
from kerfwright.solid.interference import near_pairs, separation

__all__ = ["ClosePair", "close_pairs"]

NEAR = 10.0  # mm; half the stock that most boards have, and far more than a tenth of it


@dataclass(frozen=True)
class ClosePair:
    """Two boards by number: which is cut back if they meet, and which stays."""

    gives_way: int
    stays: int


def close_pairs(model: Model) -> list[ClosePair]:
    """Pairs without a contact within NEAR of each other, in the model's order; the smaller board gives way."""
    shapes = [shape_of(name, solid) for name, solid in assembly_solids(model)]
    number = {shape.name: k for k, shape in enumerate(shapes)}
    joined = {frozenset((c.a, c.b)) for c in model.contacts}
    found = []
    for pair in near_pairs(shapes, NEAR):
        if frozenset(shape.name for shape in pair) not in joined and separation(*pair) <= NEAR:
            small, large = sorted(pair, key=lambda shape: shape.solid.volume)
            found.append(ClosePair(number[small.name], number[large.name]))
    return found
