"""What refinement makes on the way to cut paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

__all__ = ["BoundaryLoop", "Outline"]


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
