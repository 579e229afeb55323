"""Neighbours made flush: boards side by side whose sheet planes differ by less than can be measured share one plane.

Boards glued edge to edge are planed together. Left on planes of their own, a board that ends on several of them would
run hundredths of a millimetre into one and stand off another.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapely.geometry import Polygon

from kerfwright.assemble.options import AssembleOptions
from kerfwright.identify.types import Sheet

__all__ = ["flush_neighbours"]

SAME_DIRECTION = 1 - 1e-9  # cosine between normals of one class of parallel boards


def flush_neighbours(sheets: tuple[Sheet, ...], diameter: float, options: AssembleOptions) -> tuple[Sheet, ...]:
    """The sheets, neighbours of one thickness moved onto their common plane (mean by area)."""
    groups = {k: {k} for k in range(len(sheets))}
    for a in range(len(sheets)):
        for b in range(a + 1, len(sheets)):
            if groups[a] is not groups[b] and _are_flush(sheets[a], sheets[b], diameter, options):
                groups[a] |= groups[b]
                for k in groups[b]:
                    groups[k] = groups[a]
    return tuple(_moved(sheet, [sheets[j] for j in sorted(groups[k])]) for k, sheet in enumerate(sheets))


def _are_flush(a: Sheet, b: Sheet, diameter: float, options: AssembleOptions) -> bool:
    if a.normal @ b.normal < SAME_DIRECTION or abs(a.thickness.value - b.thickness.value) > 1e-9:
        return False
    if abs(_height(a) - _height(b)) > options.flush * diameter:
        return False
    ring = np.asarray(b.region.exterior.coords)
    moved = a.to_board(b.to_world(np.c_[ring, np.zeros(len(ring))]))[:, :2]
    return a.region.distance(Polygon(moved).buffer(0)) < options.reach * diameter


def _height(sheet: Sheet) -> float:
    return float(sheet.normal @ sheet.world_from_board[:3, 3])


def _moved(sheet: Sheet, group: list[Sheet]) -> Sheet:
    if len(group) == 1:
        return sheet
    mean = float(np.average([_height(s) for s in group], weights=[s.region.area for s in group]))
    board = sheet.world_from_board.copy()
    board[:3, 3] += (mean - _height(sheet)) * sheet.normal
    return replace(sheet, world_from_board=board)
