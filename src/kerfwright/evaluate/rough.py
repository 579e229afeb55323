"""Boards counted as identification is judged: by sheet plane and region, before anything is cut to fit."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import shapely

from kerfwright.evaluate.truth import TrueBoard, Truth
from kerfwright.model import Board, Model
from kerfwright.model.geometry import path_polygon

__all__ = ["rough_figures"]

PLANE_MM, PLANE_DEGREES, REGION_SHARE = 2.0, 1.0, 0.7  # a board is found when all three hold
GLUED_MM = 0.3  # between the planes, and the outlines, of boards glued edge to edge


def rough_figures(truth: Truth, model: Model, truth_from_model: np.ndarray) -> dict[str, object]:
    """Boards with a sheet plane within 2 mm and 1 degree of the true one and regions that overlap by more than 0.7.

    Thickness errors are found minus true, mm. `rough_as_one` names true boards glued edge to edge that one board of the
    model stands for; they count as missing besides.
    """
    from scipy.optimize import linear_sum_assignment

    share = np.array([[_share((t,), b, truth_from_model) for b in model.boards] for t in truth.boards])
    pairs = {int(i): int(j) for i, j in zip(*linear_sum_assignment(-share), strict=True) if share[i, j] > REGION_SHARE}
    unit = np.cbrt(np.linalg.det(truth_from_model[:3, :3]))
    errors = {
        truth.boards[i].name: unit * model.boards[j].thickness.value - truth.boards[i].thickness
        for i, j in pairs.items()
    }
    groups = [_as_one(truth, pairs, j, board, truth_from_model) for j, board in enumerate(model.boards)]
    stood_for = {j for j, group in enumerate(groups) if group}
    return {
        "rough_found": len(pairs),
        "rough_missing": [b.name for i, b in enumerate(truth.boards) if i not in pairs],
        "rough_extra": [
            b.name for j, b in enumerate(model.boards) if j not in pairs.values() and j not in stood_for
        ],
        "rough_as_one": [names for names in groups if names],
        "rough_pairs": {truth.boards[i].name: model.boards[j].name for i, j in pairs.items()},
        "rough_thickness_mm": {name: round(float(e), 3) for name, e in errors.items()},
    }  # fmt: skip


def _as_one(truth: Truth, pairs: dict[int, int], j: int, found: Board, truth_from_model: np.ndarray) -> list[str]:
    """Names of the true boards, one of them missing, that lie edge to edge and that the model has as its board j."""
    own = next((i for i, at in pairs.items() if at == j), None)
    free = [i for i in range(len(truth.boards)) if i not in pairs]
    for first in [own] if own is not None else free:
        boards = [truth.boards[first]]
        rest = [truth.boards[i] for i in free if i != first]
        while more := [a for a in rest if a not in boards and any(_glued(a, b) for b in boards)]:
            boards += more
        if len(boards) > 1 and _share(boards, found, truth_from_model) > REGION_SHARE:
            return sorted(b.name for b in boards)
    return []


def _glued(a: TrueBoard, b: TrueBoard) -> bool:
    """Whether two true boards share both sheet planes and touch."""
    board_from_other = np.linalg.inv(a.truth_from_board) @ b.truth_from_board
    heights = sorted((board_from_other @ [0, 0, z, 1])[2] for z in (0.0, b.thickness))
    level = abs(board_from_other[2, 2]) > np.cos(np.radians(0.1))
    return level and np.allclose(heights, [0, a.thickness], atol=GLUED_MM) and _gap(a, b) < GLUED_MM


def _gap(a: TrueBoard, b: TrueBoard) -> float:
    return shapely.distance(*(_region(board, a.truth_from_board) for board in (a, b)))


def _share(true: Sequence[TrueBoard], found: Board, truth_from_model: np.ndarray) -> float:
    """Intersection over union of the regions in the first true board's plane; 0 where the sheet planes are not the
    same.
    """
    pose, thickness = true[0].truth_from_board, true[0].thickness
    board_from_found = np.linalg.inv(pose) @ truth_from_model @ np.array(found.model_from_board)
    scale = np.cbrt(np.linalg.det(board_from_found[:3, :3]))
    if abs(board_from_found[2, 2]) / scale < np.cos(np.radians(PLANE_DEGREES)):
        return 0.0
    region = path_polygon(found.cut_path, 0.1)
    flat = np.asarray(region.centroid.coords[0])
    heights = [(board_from_found @ [*flat, z, 1])[2] for z in (0.0, found.thickness.value)]
    if min(abs(h - own) for h in heights for own in (0.0, thickness)) > PLANE_MM:
        return 0.0
    m = board_from_found
    moved = shapely.transform(region, lambda p: p @ m[:2, :2].T + m[:2, 3])
    own = shapely.union_all([_region(board, pose) for board in true])
    return float(moved.intersection(own).area / moved.union(own).area)


def _region(true: TrueBoard, pose: np.ndarray) -> shapely.Geometry:
    """The true board's shadow on its plane, in the frame of a board on the same plane."""
    if pose is true.truth_from_board:
        return _shadow(true)
    m = np.linalg.inv(pose) @ true.truth_from_board
    return shapely.transform(_shadow(true), lambda p: p @ m[:2, :2].T + m[:2, 3])


@lru_cache(maxsize=256)
def _shadow(true: TrueBoard) -> shapely.Geometry:
    pose = true.truth_from_board
    flat = ((true.vertices - pose[:3, 3]) @ pose[:3, :3])[:, :2][true.triangles]
    return shapely.union_all(shapely.buffer(shapely.polygons(flat), 1e-3))
