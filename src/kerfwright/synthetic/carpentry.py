"""Boards placed in space: the vocabulary that the families of objects are written in.

Model frame: millimetres, z up, floor at z = 0.
"""

from __future__ import annotations

import numpy as np

from kerfwright.model import Bevel, Board, CutPath, Origin, Quantity
from kerfwright.model.frames import invert, matrix, rows, transform_points, transform_vectors
from kerfwright.synthetic.outlines import rectangle

__all__ = ["STOCK", "HalfSpace", "board", "given", "slab", "trimmed"]

STOCK = (6, 8, 9, 10, 12, 15, 16, 18, 20, 22, 25, 28, 30)  # mm; what sheet and planed timber are sold in

HalfSpace = tuple[np.ndarray, np.ndarray]  # a point on its plane and the outward normal, both (3,), model frame


def given(value: float) -> Quantity:
    """A number that is known because we chose it."""
    return Quantity(value=float(value), standard_error=0.0, origin=Origin.GIVEN)


def board(name: str, origin, x_axis, y_axis, thickness: float, path: CutPath) -> Board:
    """A board whose cut path lies in the plane of two orthogonal axes; it is thick along x cross y."""
    x = np.asarray(x_axis, float) / np.linalg.norm(x_axis)
    y = np.asarray(y_axis, float) - x * (np.asarray(y_axis, float) @ x)
    y /= np.linalg.norm(y)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, y, np.cross(x, y)], axis=1)
    pose[:3, 3] = origin
    return Board(
        name=name, model_from_board=rows(pose), thickness=given(thickness), cut_path=path, pose_origin=Origin.GIVEN
    )


def slab(name: str, low, high, path=None) -> Board:
    """The board that fills an axis-aligned box: thin along its shortest side, x along its longest.

    Parameters
    ----------
    low, high : (3,)
        Opposite corners, mm.
    path : callable, optional
        Makes the cut path from (length, width); a rectangle by default. The path's (0, 0) lies at `low`.
    """
    low, high = np.asarray(low, float), np.asarray(high, float)
    size = high - low
    thin, middle, long = np.argsort(size, kind="stable")
    x, y = np.eye(3)[long], np.eye(3)[middle]
    mirrored = np.cross(x, y)[thin] < 0  # then the board's bottom is the box's far side
    origin = low + np.eye(3)[thin] * size[thin] * mirrored
    outline = (path or rectangle)(size[long], size[middle])
    return board(name, origin, x, y, size[thin], outline)


def trimmed(name: str, origin, x_axis, y_axis, thickness: float, width: float, cuts: list[HalfSpace]) -> Board:
    """A board of the given width whose two ends are sawn by planes; the planes contain the board's y axis.

    The cut path is the largest extent over the thickness; a cut that is not square becomes a bevel.

    Parameters
    ----------
    origin : (3,)
        A point of the board's corner line y = z = 0, between the ends.
    cuts : list of HalfSpace
        What lies beyond them is sawn off.
    """
    blank = board(name, origin, x_axis, y_axis, thickness, rectangle(1, width))
    board_from_model = invert(matrix(blank.model_from_board))
    planes = [(transform_points(board_from_model, p), transform_vectors(board_from_model, n)) for p, n in cuts]
    section = _section(planes, thickness)
    low, high = section[:, 0].min(), section[:, 0].max()
    pose = matrix(blank.model_from_board)
    pose[:3, 3] += pose[:3, 0] * low
    shifted = [(p - np.array([low, 0, 0]), n) for p, n in planes]
    bevels = [_bevel(p, n, high - low, width) for p, n in shifted if abs(n[2]) > 1e-9]
    return blank.model_copy(
        update={
            "model_from_board": rows(pose),
            "cut_path": rectangle(high - low, width),
            "bevels": tuple(bevels),
        }
    )


def _section(planes: list[HalfSpace], thickness: float) -> np.ndarray:
    """(N, 2) polygon, in x and z of the board, that the planes leave of an endless strip."""
    far = 1e5
    corners = np.array([(-far, 0.0), (far, 0.0), (far, thickness), (-far, thickness)])
    for point, normal in planes:
        corners = _clip(corners, point[[0, 2]], normal[[0, 2]])
    return corners


def _clip(corners: np.ndarray, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Keep what lies behind a line (Sutherland and Hodgman 1974)."""
    out, height = [], (corners - point) @ normal
    for a, b, ha, hb in zip(corners, np.roll(corners, -1, axis=0), height, np.roll(height, -1), strict=True):
        if ha <= 0:
            out.append(a)
        if (ha < 0 < hb) or (hb < 0 < ha):
            out.append(a + (b - a) * ha / (ha - hb))
    return np.array(out)


def _bevel(point: np.ndarray, normal: np.ndarray, length: float, width: float) -> Bevel:
    """The bevel of an end: x = 0 or x = length, whichever the normal points to."""
    far = normal[0] > 0
    start, end = ((length, 0.0), (length, width)) if far else ((0.0, width), (0.0, 0.0))
    angle = np.degrees(np.arctan2(normal[2], abs(normal[0])))
    return Bevel(
        start=start, end=end, point=tuple(map(float, point)), normal=tuple(map(float, normal)), angle=given(angle)
    )
