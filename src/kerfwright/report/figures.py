"""The numbers of a model that a person asks for first."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from kerfwright.model import Board, Model
from kerfwright.model.geometry import sample_loop

__all__ = ["board_size", "figures"]


def figures(model: Model) -> dict[str, Any]:
    """Counts, sizes and thicknesses; lengths in millimetres."""
    return {
        "boards": len(model.boards),
        "distinct_boards": len({board.same_as or board.name for board in model.boards}),
        "contacts": len(model.contacts),
        "contacts_by_type": {str(kind): n for kind, n in sorted(Counter(c.type for c in model.contacts).items())},
        "thicknesses_mm": sorted({round(board.thickness.value, 3) for board in model.boards}),
        "findings": {level: sum(f.severity == level for f in model.findings) for level in ("error", "warning", "info")},
        "scale": model.scale.model_dump(mode="json"),
        "parts": [_board_figures(board) for board in model.boards],
    }


def _board_figures(board: Board) -> dict[str, Any]:
    length, width = board_size(board)
    loops = (board.cut_path.outer, *board.cut_path.holes)
    return {
        "name": board.name, "length_mm": round(length, 2), "width_mm": round(width, 2),
        "thickness_mm": round(board.thickness.value, 3), "thickness_error_mm": board.thickness.standard_error,
        "thickness_origin": board.thickness.origin.value, "stock": board.stock,
        "edges": dict(sorted(Counter(edge.kind for loop in loops for edge in loop.edges).items())),
        "holes": len(board.cut_path.holes), "bevels": len(board.bevels), "outline_from": board.outline_origin,
        "points": board.points, "same_as": board.same_as, "mirrored": board.mirrored,
    }


def board_size(board: Board) -> tuple[float, float]:
    """Extent of the cut path along the board's x and y, mm."""
    points = sample_loop(board.cut_path.outer)
    length, width = np.ptp(points, axis=0)
    return float(length), float(width)
