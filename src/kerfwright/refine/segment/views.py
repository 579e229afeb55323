"""Which photographs to read for a board.

A sheet plane seen at a slant shows one sheet face whole, and round it, for every stretch of the cut path, either the
cut face (where the camera stands outside that stretch) or what lies behind the board. The photographs are therefore
picked together, so that each stretch of the boundary is a silhouette in some of them, and both faces are seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from kerfwright.capture.types import View
from kerfwright.identify.types import Sheet
from kerfwright.refine.segment.options import SegmentOptions
from kerfwright.refine.segment.scene import BOARD, CLEAR, OCCLUDED, Occluders

__all__ = ["BoardView", "choose_views", "ring_samples"]

BEYOND = 3.0  # mm outside the rough outline at which a stretch of boundary is looked at
WORD_OF = {CLEAR: 1.0, BOARD: 0.3, OCCLUDED: 0.0}  # what an edge against floor or wall, a board, is worth
INNER_SAMPLES = 200
RING_SAMPLES = 160


@dataclass(frozen=True, eq=False)
class BoardView:
    """A photograph of a board: the sheet plane it sees, the other one, and where it stands."""

    view: View
    view_idx: int
    near: float  # z of the sheet plane that faces the camera, board frame
    far: float
    eye: np.ndarray  # (3,) centre of projection, board frame
    density: float  # photo pixels a mm on the board, across the slant
    share: float  # of the rough region that it shows

    @property
    def side(self) -> int:
        """+1 when it sees the top, -1 the bottom."""
        return 1 if self.near > self.far else -1


def ring_samples(region: Polygon, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) points along all rings, `spacing` apart, and outward unit normals."""
    points, normals = [], []
    for ring, turn in [(region.exterior, 1), *((r, -1) for r in region.interiors)]:
        line = ring if ring.is_ccw == (turn == 1) else ring.reverse()
        at = np.arange(0, line.length, spacing)
        here, ahead = (np.array([line.interpolate(s % line.length).coords[0] for s in at + d]) for d in (-0.5, 0.5))
        tangent = (ahead - here) / np.maximum(np.linalg.norm(ahead - here, axis=1), 1e-9)[:, None]
        points.append((here + ahead) / 2)
        normals.append(np.column_stack([tangent[:, 1], -tangent[:, 0]]))
    return np.concatenate(points), np.concatenate(normals)


def choose_views(
    sheet: Sheet, board_idx: int, views: Sequence[View], occluders: Occluders, options: SegmentOptions
) -> list[BoardView]:
    """At most `max_views` photographs of a board, best first; empty when none shows it well."""
    inner = _inner_samples(sheet.region)
    ring, normals = ring_samples(sheet.region, max(2.0, sheet.region.length / RING_SAMPLES))
    found, gains = [], []
    for view_idx, view in enumerate(views):
        seen = _look(sheet, board_idx, view, view_idx, inner, occluders)
        if seen is None:
            continue
        board_view, shown = seen
        sight = board_view.eye - [*inner.mean(0), board_view.near]
        slant = abs(sight[2]) / np.linalg.norm(sight)
        if board_view.share < options.min_visible or slant < options.min_slant:
            continue
        edge = _edges_seen(sheet, board_idx, board_view, ring, normals, occluders)
        quality = np.sqrt(slant) * board_view.density
        faces = [shown, 0 * shown] if board_view.side > 0 else [0 * shown, shown]
        gains.append(quality * np.concatenate([*faces, edge]))
        found.append(board_view)
    return [found[k] for k in _greedy(np.array(gains), options.max_views)]


def _greedy(gains: np.ndarray, count: int) -> list[int]:
    """Rows of (views, samples) that together see most, a second look at a sample being worth less than the first."""
    if len(gains) == 0:
        return []
    gains = gains / np.median(gains[gains > 0])
    chosen: list[int] = []
    total = np.zeros(gains.shape[1])
    for _ in range(min(count, len(gains))):
        worth = np.sqrt(total + gains).sum(1)
        worth[chosen] = -np.inf
        chosen.append(int(worth.argmax()))
        total += gains[chosen[-1]]
    return chosen


def _inner_samples(region: Polygon) -> np.ndarray:
    """About INNER_SAMPLES points of a square lattice inside the region, (N, 2)."""
    import shapely

    low, high = np.array(region.bounds).reshape(2, 2)
    pitch = np.sqrt(max(region.area, 1.0) / INNER_SAMPLES)
    axes = [np.arange(a + pitch / 2, b, pitch) for a, b in zip(low, high, strict=True)]
    lattice = np.stack(np.meshgrid(*axes), -1).reshape(-1, 2)
    inside = lattice[shapely.contains_xy(region, lattice)]
    return inside if len(inside) else np.array([region.representative_point().coords[0]])


def _look(
    sheet: Sheet, board_idx: int, view: View, view_idx: int, inner: np.ndarray, occluders: Occluders
) -> tuple[BoardView, np.ndarray] | None:
    """The board as this photograph shows it, and which inner samples it shows; None from between the sheet planes."""
    thickness = sheet.thickness.value
    eye = sheet.to_board(view.centre[None])[0]
    if 0 <= eye[2] <= thickness:
        return None
    near, far = (thickness, 0.0) if eye[2] > thickness else (0.0, thickness)
    shown = _classes(sheet, board_idx, view, inner, near, occluders) != OCCLUDED
    depth = view.to_camera(sheet.to_world(np.array([[*inner.mean(0), near]])))[0, 2]
    if depth <= 0:
        return None
    density = view.camera.focal / depth
    return BoardView(view, view_idx, near, far, eye, float(density), float(shown.mean())), shown.astype(float)


def _classes(sheet: Sheet, board_idx: int, view: View, xy: np.ndarray, z: float, occluders: Occluders) -> np.ndarray:
    """CLEAR, BOARD or OCCLUDED at points of a plane; what lies outside the photograph is OCCLUDED."""
    x_in_world = sheet.to_world(np.column_stack([xy, np.full(len(xy), z)]))
    pixels, _ = view.project(x_in_world)
    with np.errstate(invalid="ignore"):
        inside = (pixels >= 1).all(1) & (pixels[:, 0] < view.camera.width - 1) & (pixels[:, 1] < view.camera.height - 1)
    return np.where(inside, occluders.classify(board_idx, view, x_in_world), OCCLUDED)


def _edges_seen(
    sheet: Sheet, board_idx: int, board_view: BoardView, ring: np.ndarray, normals: np.ndarray, occluders: Occluders
) -> np.ndarray:
    """What each boundary sample is worth in a view: as silhouette, on the sheet plane where it is one."""
    facing = ((board_view.eye[:2] - ring) * normals).sum(1) > 0
    worth = np.zeros(len(ring))
    for z, pick in ((board_view.near, ~facing), (board_view.far, facing)):
        if pick.any():
            seen = _classes(sheet, board_idx, board_view.view, (ring + BEYOND * normals)[pick], z, occluders)
            worth[pick] = np.vectorize(WORD_OF.get, otypes=[float])(seen)
    return worth
