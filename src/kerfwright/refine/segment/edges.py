"""Where the boundary lies in the photographs, to a fraction of a pixel.

Each photograph shows each stretch of a square cut as a silhouette: a stretch that faces away from the camera on the
near sheet plane, one that faces it on the far sheet plane (beyond the near plane comes the cut face, wood beside
wood). Colour profiles are read along the boundary's normal on that plane, straight from the photographs. Mixing both
kinds cancels what an error of the plane would do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from kerfwright.identify.types import Sheet
from kerfwright.refine.segment.grid import Grid
from kerfwright.refine.segment.rectify import Photos, pixels_at, sample
from kerfwright.refine.segment.scene import BOARD, CLEAR, OCCLUDED, Occluders
from kerfwright.refine.segment.views import BoardView

__all__ = ["EdgeScan", "agreed_strength", "clearness", "scan_edges", "trace", "view_offsets"]

PITCH = 0.25  # mm between profile samples
WINDOW = 1.5  # mm on each side whose mean colours are compared
ALONG = 2  # neighbours on each side averaged along the boundary
BEYOND = 2.0  # mm outside the boundary where the background is looked up
AGAINST = {CLEAR: 1.0, BOARD: 0.35, OCCLUDED: 0.0}  # weight of an edge against floor or wall, or another board
CLEAR_STEP = 5.0  # steps stronger than this, in units of the wood's own, mark an edge
NEAR_PEAK = 1.0  # mm within which a view's own peak may differ from the traced boundary
BEND = 0.15  # cost of a change of offset by one pitch from point to point
AT_LINE = 0.75  # mm about a line within which an edge counts as on it
FAR = 0.4  # cost of an offset at the end of the search


@dataclass(frozen=True, eq=False)
class EdgeScan:
    """One view's profiles: strength (N, K) of the colour step at each offset, in units of the wood's own steps."""

    strength: np.ndarray
    weight: np.ndarray  # (N,), 0 where the view shows no edge
    offsets: np.ndarray  # (K,), mm, positive outward


def scan_edges(
    points: np.ndarray, normals: np.ndarray, starts: np.ndarray, sheet: Sheet, board_idx: int, board_view: BoardView,
    photos: Photos, occluders: Occluders, mask: np.ndarray, grid: Grid, shift: np.ndarray, reach: float,
) -> EdgeScan:
    """Profiles of one view along (N, 2) boundary points with outward normals; `starts` (N,) numbers their loops."""
    facing = ((board_view.eye[:2] - points) * normals).sum(1) > 0
    z = np.where(facing, board_view.far, board_view.near)
    offsets = np.arange(-reach - WINDOW, reach + WINDOW + PITCH / 2, PITCH)
    xy = points[:, None] + offsets[None, :, None] * normals[:, None]
    pixels = pixels_at(sheet, board_view.view, xy.reshape(-1, 2), np.repeat(z, len(offsets)), shift)
    colours, held = sample(photos, board_view.view, pixels.reshape(len(points), len(offsets), 2))
    step = _steps(_lab(colours), starts)
    half = round(WINDOW / PITCH)
    strength = step / _usual(step, facing)
    weight = _weights(points, normals, z, facing, sheet, board_idx, board_view, occluders, mask, grid)
    return EdgeScan(strength, weight * held.all(1), offsets[half:-half])


def _lab(colours: np.ndarray) -> np.ndarray:
    import cv2

    return cv2.cvtColor(colours.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)


def _steps(lab: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """(N, K, 3) profiles to (N, K - 2 half) lengths of the colour step, averaged along each loop first."""
    for loop in np.unique(starts):
        rows = np.flatnonzero(starts == loop)
        lab[rows] = sum(lab[np.roll(rows, s)] for s in range(-ALONG, ALONG + 1)) / (2 * ALONG + 1)
    half = round(WINDOW / PITCH)
    total = np.cumsum(np.pad(lab, ((0, 0), (1, 0), (0, 0))), axis=1)
    mean = (total[:, half:] - total[:, :-half]) / half  # mean[:, i] covers samples i .. i + half - 1
    return np.linalg.norm(mean[:, half + 1:] - mean[:, :-half - 1], axis=2)[:, : lab.shape[1] - 2 * half]


def _usual(step: np.ndarray, facing: np.ndarray) -> float:
    """The size of steps on the wood itself: inside the boundary, on stretches that show the sheet face."""
    rows = step[~facing] if (~facing).sum() > 10 else step
    return max(1.0, float(np.sqrt(np.mean(np.minimum(rows[:, : step.shape[1] // 4], 20) ** 2))))


def _weights(points, normals, z, facing, sheet, board_idx, board_view, occluders, mask, grid) -> np.ndarray:
    """What a view's edge is worth at each point: visible, as silhouette, and against what."""
    outer = np.column_stack([points + BEYOND * normals, z])
    inner = np.column_stack([points - BEYOND * normals, z])
    kinds = [occluders.classify(board_idx, board_view.view, sheet.to_world(p)) for p in (outer, inner)]
    worth = np.vectorize(AGAINST.get, otypes=[float])(kinds[0]) * (kinds[1] != OCCLUDED)
    pixels, _ = board_view.view.project(sheet.to_world(outer))
    camera = board_view.view.camera
    with np.errstate(invalid="ignore"):
        worth *= (pixels > 2).all(1) & (pixels[:, 0] < camera.width - 2) & (pixels[:, 1] < camera.height - 2)
    return worth * ~(facing & _behind_itself(outer, board_view, mask, grid))


def _behind_itself(x_in_board: np.ndarray, board_view: BoardView, mask: np.ndarray, grid: Grid) -> np.ndarray:
    """Whether the board's own near face hides points of its far plane."""
    eye = board_view.eye
    share = (board_view.near - eye[2]) / (x_in_board[:, 2] - eye[2])
    return grid.lookup(mask, (eye + share[:, None] * (x_in_board - eye))[:, :2], False)


def trace(scans: Sequence[EdgeScan], starts: np.ndarray) -> np.ndarray:
    """(N,) offset of the boundary that all views together like best, smooth along each loop."""
    score, total = _joint_score(scans)
    offsets = scans[0].offsets
    cost = -score / np.maximum(total, 1.0)[:, None] + FAR * (offsets / offsets[-1]) ** 2
    path = np.zeros(len(cost))
    for loop in np.unique(starts):
        rows = np.flatnonzero(starts == loop)
        path[rows] = offsets[_cheapest_loop(cost[rows])]
    return path


def agreed_strength(scans: Sequence[EdgeScan]) -> np.ndarray:
    """(N,) strength of the edge that all views together show on the line itself, NaN where none shows the place."""
    score, total = _joint_score(scans)
    on_line = abs(scans[0].offsets) <= AT_LINE
    return np.where(total > 0, score[:, on_line].max(1) / np.maximum(total, 1e-9), np.nan)


def clearness(scan: EdgeScan, path: np.ndarray) -> np.ndarray:
    """(N,) how clear one view's edge is at (N,) offsets, by its weight; 0 beyond the profiles."""
    column = np.round((path - scan.offsets[0]) / PITCH).astype(int)
    held = (column >= 0) & (column < len(scan.offsets))
    strength = scan.strength[np.arange(len(path)), column.clip(0, len(scan.offsets) - 1)]
    return np.log1p((strength / CLEAR_STEP) ** 2) * scan.weight * held


def _joint_score(scans: Sequence[EdgeScan]) -> tuple[np.ndarray, np.ndarray]:
    """(N, K) sum over the views of how clear an edge is at each offset, (N,) sum of their weights."""
    score = sum(np.log1p((s.strength / CLEAR_STEP) ** 2) * s.weight[:, None] for s in scans)
    return score, sum(s.weight for s in scans)


def _cheapest_loop(cost: np.ndarray) -> np.ndarray:
    """Viterbi round a closed chain: run half a turn longer at both ends, keep the middle."""
    n = len(cost)
    turn = np.arange(-(n // 2), n + n // 2) % n
    return _viterbi(np.ascontiguousarray(cost[turn]), BEND)[n // 2 : n // 2 + n]


@numba.njit(cache=True)
def _viterbi(cost, bend):
    """(M,) column of each row on the cheapest path; neighbours differ by at most two columns, at `bend` a column."""
    rows, columns = cost.shape
    best, back = cost[0].copy(), np.zeros((rows, columns), np.int32)
    for i in range(1, rows):
        last = best.copy()
        for k in range(columns):
            least, source = last[k], k
            for j in range(max(0, k - 2), min(columns, k + 3)):
                if last[j] + bend * abs(j - k) < least:
                    least, source = last[j] + bend * abs(j - k), j
            best[k], back[i, k] = least + cost[i, k], source
    chain = np.empty(rows, np.int64)
    chain[-1] = best.argmin()
    for i in range(rows - 1, 0, -1):
        chain[i - 1] = back[i, chain[i]]
    return chain


def view_offsets(scan: EdgeScan, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N,) offset of a view's own peak near the traced boundary, finer than the pitch; its weight (0: no peak)."""
    offsets, strength = scan.offsets, scan.strength
    near = abs(offsets[None] - path[:, None]) <= NEAR_PEAK
    k = np.where(near, strength, -1).argmax(1).clip(1, len(offsets) - 2)
    rows = np.arange(len(path))
    left, here, right = strength[rows, k - 1], strength[rows, k], strength[rows, k + 1]
    bend = left - 2 * here + right
    peak = (here >= left) & (here >= right) & (bend < 0) & (here > CLEAR_STEP / 2)
    vertex = np.where(peak, 0.5 * (left - right) / np.where(peak, bend, -1), 0)
    strong = np.minimum(here / CLEAR_STEP, 2.0)
    return offsets[k] + vertex.clip(-1, 1) * PITCH, np.where(peak, scan.weight * strong, 0)
