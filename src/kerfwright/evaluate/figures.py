"""The figures of one model against the truth, each a small function of meshes."""

from __future__ import annotations

import numpy as np

from kerfwright.evaluate.surfaces import Body, Mesh, occupied_share, sample_surface, triangle_frames
from kerfwright.evaluate.truth import TrueBoard

__all__ = ["board_figures", "match_boards", "shown_boards", "surface_figures"]

SHEET = 0.9  # cosine with the board's normal that makes a face a sheet
HALF, GOOD = 0.5, 0.8  # overlap of a matched board, and of a good one
SAMPLES = 60_000  # of a whole surface
SEEN_MM = 4.0  # a true surface point is seen when a cloud point is this near
OWN_SHARE = 0.03  # of D: cloud points further from the truth are floor and room


def match_boards(true: list[Mesh], found: list[Mesh]) -> tuple[np.ndarray, dict[int, int]]:
    """Volume overlaps (T, F) and the one-to-one match {true: found} that makes the most of them, above 0.5."""
    from scipy.optimize import linear_sum_assignment

    overlap = np.zeros((len(true), len(found)))
    bodies = [Body(m) for m in true], [Body(m) for m in found]
    for i, a in enumerate(true):
        for j, b in enumerate(found):
            low = np.stack([m[0].min(axis=0) for m in (a, b)])
            high = np.stack([m[0].max(axis=0) for m in (a, b)])
            if (low.max(axis=0) < high.min(axis=0)).all():
                overlap[i, j] = occupied_share(bodies[0][i], bodies[1][j], low.min(axis=0), high.max(axis=0))
    pairs = zip(*linear_sum_assignment(-overlap), strict=True)
    return overlap, {int(i): int(j) for i, j in pairs if overlap[i, j] > HALF}


def surface_figures(true: list[Mesh], found: list[Mesh], cloud: np.ndarray | None) -> dict[str, float]:
    """Root mean square distances between surfaces and cloud, % of D, and the largest one in mm."""
    truth, model = Body(*true), Body(*found)
    on_truth, on_model = (_whole(meshes) for meshes in (true, found))
    largest = float(np.ptp(on_truth, axis=0).max())
    to_model, to_truth = model.distance(on_truth), truth.distance(on_model)
    out = {
        "rmse_pct_truth_to_model": _percent(to_model, largest),
        "rmse_pct_model_to_truth": _percent(to_truth, largest),
        "hausdorff_mm": float(max(to_model.max(), to_truth.max())),
    }
    return out if cloud is None else out | _cloud_figures(truth, model, on_truth, to_model, cloud, largest)


def _cloud_figures(truth: Body, model: Body, on_truth, to_model, cloud: np.ndarray, largest: float) -> dict[str, float]:
    """What the cloud shows of the truth to the model, and the paper's cloud to model beside cloud to truth."""
    from scipy.spatial import cKDTree

    cloud = cloud[truth.distance(cloud) < OWN_SHARE * largest]
    shown = np.isfinite(cKDTree(cloud).query(on_truth, distance_upper_bound=SEEN_MM)[0])
    some = cloud[:: max(1, len(cloud) // SAMPLES)]
    return {
        "rmse_pct_seen_to_model": _percent(to_model[shown], largest),
        "rmse_pct_cloud_to_model": _percent(model.distance(some), largest),
        "rmse_pct_cloud_to_truth": _percent(truth.distance(some), largest),
    }


def _whole(meshes: list[Mesh]) -> np.ndarray:
    """Points on all boards, equally many a board, as the scorer takes them."""
    each = max(200, SAMPLES // len(meshes))
    return np.concatenate([sample_surface(m, each).points for m in meshes])


def _percent(distance: np.ndarray, largest: float) -> float:
    return float(np.sqrt(np.mean(distance**2)) / largest * 100)


def shown_boards(true: tuple[TrueBoard, ...], cloud: np.ndarray) -> tuple[list[int], list[bool]]:
    """Per board: its cloud points, and whether they show its thickness.

    Shown is a thickness with 50 points within 1 mm of each sheet plane, or 200 on the cut faces between.
    """
    near = np.array([Body(b.mesh).distance(cloud) for b in true])
    near_all = near.min(axis=0)
    own = np.where(near_all < 2, near.argmin(axis=0), -1)
    counts, shown = [], []
    for k, board in enumerate(true):
        z = (cloud[own == k] - board.truth_from_board[:3, 3]) @ board.normal
        sheets = min((np.abs(z) < 1).sum(), (np.abs(z - board.thickness) < 1).sum())
        between = ((z > 1) & (z < board.thickness - 1)).sum()
        counts.append(len(z))
        shown.append(bool(sheets >= 50 or between >= 200))
    return counts, shown


def board_figures(true: TrueBoard, found: Mesh) -> dict[str, object]:
    """Distance of the true cut faces to the found board, thickness error, angle between the sheets."""
    samples = sample_surface(true.mesh, 8192, seed=2)
    cut = Body(found).distance(samples.points[np.abs(samples.normals @ true.normal) < SHEET])
    corners, normals, areas = triangle_frames(found)
    lean = normals @ true.normal
    sheets = [np.flatnonzero(lean * side > SHEET) for side in (1, -1)]
    out: dict[str, object] = {
        "cut_mm": [float(cut.mean()), float(np.percentile(cut, 95))] if len(cut) else None,
        "thickness_mm": None,
        "angle_deg": 90.0,
    }
    if not len(sheets[0]) and not len(sheets[1]):
        return out
    both = np.concatenate(sheets)
    mean = (normals[both] * np.sign(lean[both])[:, None] * areas[both][:, None]).sum(axis=0)
    mean /= np.linalg.norm(mean)
    out["angle_deg"] = float(np.degrees(np.arccos(np.clip(abs(mean @ true.normal), 0, 1))))
    if len(sheets[0]) and len(sheets[1]):
        heights = [np.average(corners[s, 0] @ mean, weights=areas[s]) for s in sheets]
        out["thickness_mm"] = float(heights[0] - heights[1] - true.thickness)
    return out
