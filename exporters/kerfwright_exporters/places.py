"""What nesting is asked for, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["NestOptions", "Place"]


@dataclass(frozen=True)
class NestOptions:
    """How boards are laid on sheets; lengths in mm."""

    length: float
    width: float
    spacing: float  # least distance of two boards
    turns: tuple[int, ...] = (0, 90, 180, 270)  # degrees that a board may be turned by
    layouts: int = 60  # orders tried at most for the first layout, on the coarse raster
    finalists: int = 3  # best orders laid again on the fine raster
    coarse: int = 200  # cells across the width: 6 mm on a sheet of 1220
    fine: int = 400
    moves: int = 3000  # of a board, on average, while the layout is tightened; 30 boards take some 10 seconds
    seed: int = 0


@dataclass(frozen=True)
class Place:
    """Where a board lies: x_in_sheet = turn(x_in_board) + shift; turn in degrees, shift in mm; sheets from 0."""

    sheet: int
    turn: int
    shift: tuple[float, float]
