"""Where photographs tell a boundary less surely than its noise says: beside the ends of contacts.

There another board begins, its shadow, its own edge, or its colour: what was traced runs on along it for some
millimetres, in all views alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from kerfwright.assemble.types import Assembly
from kerfwright.identify.outlines import on_segments
from kerfwright.refine.types import BoundaryLoop

__all__ = ["less_sure_at_contacts"]

REACH = 1 / 40  # of D, from the end of a contact
ERROR = 1 / 250  # of D, right at it


def less_sure_at_contacts(
    loops: tuple[BoundaryLoop, ...], number: int, assembly: Assembly, diameter: float
) -> tuple[BoundaryLoop, ...]:
    """The loops of a board with larger standard errors near ends of its contacts, but on constraint segments."""
    ends = _ends(number, assembly)
    if not len(ends):
        return loops
    tree, out = cKDTree(ends), []
    for loop in loops:
        near = 1 - tree.query(loop.points)[0] / (REACH * diameter)
        more = np.where(on_segments(loop.points, assembly.constraints[number]), 0.0, np.maximum(near, 0.0))
        out.append(replace(loop, standard_error=np.hypot(loop.standard_error, ERROR * diameter * more)))
    return tuple(out)


def _ends(number: int, assembly: Assembly) -> np.ndarray:
    """(N, 2) ends of constraint segments and corners of interfaces, in the plane of the board."""
    sheet = assembly.sheets[number]
    found = [np.array([s.start, s.end]) for s in assembly.constraints[number]]
    for contact in assembly.contacts:
        if sheet.name in (contact.a, contact.b):
            found += [sheet.to_board(np.array(ring))[:, :2] for ring in contact.interface]
    return np.concatenate(found) if found else np.zeros((0, 2))
