"""What refinement makes on the way to cut paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.types import Sheet
from kerfwright.model import CutPath

__all__ = ["BoundaryLoop", "Fitted", "Outline", "Twin"]


@dataclass(frozen=True, eq=False)
class BoundaryLoop:
    """A closed chain of boundary points of one board, board frame, mm, the last not repeating the first.

    Counter-clockwise for the outer loop, clockwise for a hole. `standard_error` is across the boundary, (N,), mm.
    """

    points: np.ndarray
    standard_error: np.ndarray
    is_hole: bool = False


@dataclass(frozen=True, eq=False)
class Outline:
    """The boundary of one connected piece of a board, before curves are fitted."""

    loops: tuple[BoundaryLoop, ...]  # the outer loop first
    origin: Literal["images", "cloud", "inferred"]
    views: int = 0


@dataclass(frozen=True, eq=False)
class Twin:
    """That a board is a repeat of another: x_in_first = first_from_own @ x_in_own in the planes of their sheets."""

    first: int  # index of the board that it repeats
    first_from_own: np.ndarray  # (2, 3)
    mirrored: bool


@dataclass(frozen=True, eq=False)
class Fitted:
    """A cut path in the frame of its sheet, and what it was fitted to."""

    sheet: Sheet
    segments: tuple[ConstraintSegment, ...]
    loops: tuple[BoundaryLoop, ...]
    path: CutPath
    origin: Literal["images", "cloud", "inferred"]
    notes: tuple[str, ...] = ()
    twin: Twin | None = None
