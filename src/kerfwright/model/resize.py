"""A model in another unit or another frame."""

from __future__ import annotations

import numpy as np

from kerfwright.model.cutpath import CutPath, Loop
from kerfwright.model.frames import matrix, rows
from kerfwright.model.geometry import transform_path
from kerfwright.model.quantity import Quantity
from kerfwright.model.types import Bevel, Board, Contact

__all__ = ["resized_board", "resized_contact"]


def resized_board(board: Board, new_from_model: np.ndarray) -> Board:
    """A board after the similarity x_in_new = new_from_model @ x_in_model (4x4); its own frame keeps its axes."""
    scale, rigid = _split(new_from_model)
    pose = rigid @ matrix(board.model_from_board)
    pose[:3, 3] = (new_from_model @ np.array([*matrix(board.model_from_board)[:3, 3], 1.0]))[:3]
    return board.model_copy(update={
        "model_from_board": rows(pose), "thickness": _quantity(board.thickness, scale),
        "cut_path": _path(board.cut_path, scale), "bevels": tuple(_bevel(b, scale) for b in board.bevels),
    })


def resized_contact(contact: Contact, new_from_model: np.ndarray) -> Contact:
    """A contact after the same similarity."""
    scale, rigid = _split(new_from_model)

    def move(p) -> tuple[float, float, float]:
        return tuple(float(x) for x in (new_from_model @ np.array([*p, 1.0]))[:3])

    return contact.model_copy(update={
        "point": move(contact.point), "normal": tuple(float(x) for x in rigid[:3, :3] @ np.asarray(contact.normal)),
        "interface": tuple(tuple(move(p) for p in polygon) for polygon in contact.interface),
        "area": contact.area * scale**2,
    })


def _split(similarity: np.ndarray) -> tuple[float, np.ndarray]:
    scale = float(np.cbrt(np.linalg.det(similarity[:3, :3])))
    rigid = np.eye(4)
    rigid[:3, :3] = similarity[:3, :3] / scale
    return scale, rigid


def _error(value: float | None, scale: float) -> float | None:
    return None if value is None else value * scale


def _quantity(q: Quantity, scale: float) -> Quantity:
    return q.model_copy(update={"value": q.value * scale, "standard_error": _error(q.standard_error, scale)})


def _path(path: CutPath, scale: float) -> CutPath:
    moved = transform_path(path, np.array([[scale, 0.0, 0.0], [0.0, scale, 0.0]]))
    loops = [
        Loop(edges=tuple(e.model_copy(update={"standard_error": _error(e.standard_error, scale)}) for e in loop.edges))
        for loop in (moved.outer, *moved.holes)
    ]
    return CutPath(outer=loops[0], holes=tuple(loops[1:]))


def _bevel(bevel: Bevel, scale: float) -> Bevel:
    return bevel.model_copy(
        update={k: tuple(float(x) * scale for x in getattr(bevel, k)) for k in ("start", "end", "point")}
    )
