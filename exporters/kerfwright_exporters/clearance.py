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
GAP = 0.1  # mm left between boards that do not touch; ten times what counts as touching


@dataclass(frozen=True)
class ClosePair:
    """Two boards by number: which is cut back if they meet, which stays, and what is left between them, mm."""

    gives_way: int
    stays: int
    gap: float


def close_pairs(model: Model) -> list[ClosePair]:
    """Pairs within NEAR of each other, in the model's order; of two that do not touch, the smaller board gives way."""
    shapes = [shape_of(name, solid) for name, solid in assembly_solids(model)]
    number = {shape.name: k for k, shape in enumerate(shapes)}
    ending = {frozenset((c.a, c.b)): c.b for c in model.contacts}
    found = []
    for pair in near_pairs(shapes, NEAR):
        if separation(*pair) > NEAR:
            continue
        names = [shape.name for shape in pair]
        smaller = min(pair, key=lambda shape: shape.solid.volume).name
        first = ending.get(frozenset(names), smaller)
        (other,) = (name for name in names if name != first)
        found.append(ClosePair(number[first], number[other], 0.0 if frozenset(names) in ending else GAP))
    return found
