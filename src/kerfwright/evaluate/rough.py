"""Boards counted as identification is judged: by sheet plane and region, before anything is cut to fit."""

from __future__ import annotations

import numpy as np
import shapely

from kerfwright.evaluate.truth import TrueBoard, Truth
from kerfwright.model import Board, Model
from kerfwright.model.geometry import path_polygon

__all__ = ["rough_figures"]

PLANE_MM, PLANE_DEGREES, REGION_SHARE = 2.0, 1.0, 0.7  # a board is found when all three hold


def rough_figures(truth: Truth, model: Model, truth_from_model: np.ndarray) -> dict[str, object]:
    """Boards with a sheet plane within 2 mm and 1 degree of the true one and regions that overlap by more than 0.7."""
    from scipy.optimize import linear_sum_assignment

    share = np.array([[_share(t, b, truth_from_model) for b in model.boards] for t in truth.boards])
    pairs = [(i, j) for i, j in zip(*linear_sum_assignment(-share), strict=True) if share[i, j] > REGION_SHARE]
    found, used = {i for i, _ in pairs}, {j for _, j in pairs}
    errors = {truth.boards[i].name: model.boards[j].thickness.value - truth.boards[i].thickness for i, j in pairs}
    return {
        "rough_found": len(pairs),
        "rough_missing": [b.name for i, b in enumerate(truth.boards) if i not in found],
        "rough_extra": [b.name for j, b in enumerate(model.boards) if j not in used],
        "rough_thickness_mm": {name: round(float(e), 3) for name, e in errors.items()},
    }


def _share(true: TrueBoard, found: Board, truth_from_model: np.ndarray) -> float:
    """Intersection over union of the regions in the true board's plane; 0 where the sheet planes are not the same."""
    board_from_found = np.linalg.inv(true.truth_from_board) @ truth_from_model @ np.array(found.model_from_board)
    scale = np.cbrt(np.linalg.det(board_from_found[:3, :3]))
    if abs(board_from_found[2, 2]) / scale < np.cos(np.radians(PLANE_DEGREES)):
        return 0.0
    region = path_polygon(found.cut_path, 0.1)
    flat = np.asarray(region.centroid.coords[0])
    heights = [(board_from_found @ [*flat, z, 1])[2] for z in (0.0, found.thickness.value)]
    if min(abs(h - own) for h in heights for own in (0.0, true.thickness)) > PLANE_MM:
        return 0.0
    m = board_from_found
    moved = shapely.transform(region, lambda p: p @ m[:2, :2].T + m[:2, 3])
    own = _region(true)
    return float(moved.intersection(own).area / moved.union(own).area)


def _region(true: TrueBoard) -> shapely.Geometry:
    """The true board's shadow on its plane."""
    pose = true.truth_from_board
    flat = ((true.vertices - pose[:3, 3]) @ pose[:3, :3])[:, :2][true.triangles]
    return shapely.union_all(shapely.buffer(shapely.polygons(flat), 1e-3))
