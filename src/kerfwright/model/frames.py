"""Rigid transforms between the board's frame and the model's."""

from __future__ import annotations

import numpy as np

from kerfwright.model.types import Board, Matrix4

__all__ = ["board_from_model", "invert", "matrix", "model_from_board", "rows", "transform_points", "transform_vectors"]


def matrix(value: Matrix4) -> np.ndarray:
    """The (4, 4) array of a transform as the model stores it."""
    return np.array(value, float)


def rows(transform: np.ndarray) -> Matrix4:
    """A (4, 4) array as the model stores it."""
    return tuple(tuple(float(x) for x in row) for row in np.asarray(transform))


def invert(target_from_source: np.ndarray) -> np.ndarray:
    """source_from_target of a rigid (4, 4) transform."""
    turn = target_from_source[:3, :3].T
    inverse = np.eye(4)
    inverse[:3, :3], inverse[:3, 3] = turn, -turn @ target_from_source[:3, 3]
    return inverse


def model_from_board(board: Board) -> np.ndarray:
    """(4, 4): x_in_model = model_from_board @ x_in_board."""
    return matrix(board.model_from_board)


def board_from_model(board: Board) -> np.ndarray:
    """(4, 4): x_in_board = board_from_model @ x_in_model."""
    return invert(model_from_board(board))


def transform_points(target_from_source: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (N, 3) or (3,) taken from the source frame to the target frame."""
    return np.asarray(points, float) @ target_from_source[:3, :3].T + target_from_source[:3, 3]


def transform_vectors(target_from_source: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Directions (N, 3) or (3,) taken from the source frame to the target frame."""
    return np.asarray(vectors, float) @ target_from_source[:3, :3].T
