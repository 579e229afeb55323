"""Photographs resampled onto a board's plane."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock

import numpy as np

from kerfwright.capture.photos import photograph
from kerfwright.capture.types import View
from kerfwright.identify.types import Sheet
from kerfwright.refine.segment._pixels import channel_medians, rectified
from kerfwright.refine.segment.grid import Grid
from kerfwright.refine.segment.views import BoardView

__all__ = ["Photos", "even_out", "pixels_at", "rectify", "sample"]

FINE = 1.5  # photo pixels a raster pixel above which the photo is shrunk first, or fine patterns would alias
MAX_REMAP = 32_000  # cv2.remap takes no longer rows
GAIN = 2.0  # largest exposure step between two photographs that is evened out


class Photos:
    """The photographs at the resolutions that were asked for; safe between threads."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._kept: dict[tuple[str, int], np.ndarray] = {}

    def get(self, view: View, shrink: int = 1) -> np.ndarray:
        """(height / shrink, width / shrink, 3) uint8 RGB."""
        if shrink == 1:
            return photograph(view)
        key = (str(view.path) or view.name, shrink)
        with self._lock:
            if key not in self._kept:
                self._kept[key] = _shrunk(photograph(view), shrink)
            return self._kept[key]


def _shrunk(image: np.ndarray, shrink: int) -> np.ndarray:
    import cv2

    size = (image.shape[1] // shrink, image.shape[0] // shrink)
    return cv2.resize(image[: size[1] * shrink, : size[0] * shrink], size, interpolation=cv2.INTER_AREA)


def pixels_at(
    sheet: Sheet, view: View, xy: np.ndarray, z: float | np.ndarray, shift: np.ndarray | None = None
) -> np.ndarray:
    """(N, 2) photo pixels of (N, 2) board points at height z; a disagreeing view is moved by `shift` (2,) mm."""
    at = xy if shift is None else xy + shift
    return view.project(sheet.to_world(np.column_stack([at, np.broadcast_to(z, len(at))])))[0]


def sample(photos: Photos, view: View, pixels: np.ndarray, shrink: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Colours (rows, cols, 3) uint8 at photo pixels (rows, cols, 2), and which of them the photograph holds."""
    import cv2

    image = photos.get(view, shrink)
    maps = (np.nan_to_num(pixels, nan=-1e6) / shrink - 0.5).astype(np.float32)  # COLMAP's pixel centres to OpenCV's
    colours = cv2.remap(image, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    x, y = maps[..., 0], maps[..., 1]  # one at a time: reductions over an axis of two are slow
    return colours, (x >= 0) & (y >= 0) & (x <= image.shape[1] - 1) & (y <= image.shape[0] - 1)


def rectify(
    photos: Photos, sheet: Sheet, board_view: BoardView, grid: Grid, shift: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A photograph on the raster of its near sheet plane: (rows, cols, 3) uint8 RGB and a mask of what it holds."""
    shrink = max(1, int(board_view.density * grid.pixel / FINE))
    view = board_view.view
    camera_from_board = view.camera_from_world @ sheet.world_from_board
    turn, move = camera_from_board[:3, :3], camera_from_board[:3, 3]
    camera_from_plane = np.column_stack([turn[:, :2], turn @ [*shift, board_view.near] + move])
    return rectified(
        photos.get(view, shrink), camera_from_plane, view.camera.lens, shrink, grid.origin, grid.pixel, *grid.shape
    )


def even_out(images: Sequence[np.ndarray], masks: Sequence[np.ndarray], sides: Sequence[int]) -> np.ndarray:
    """(V, rows, cols, 3) float32 LAB after each view's channels were scaled to the median of its side's views, inside
    `masks`.
    """
    medians = [channel_medians(i, m) for i, m in zip(images, masks, strict=True)]
    evened = np.empty((len(images), *images[0].shape), np.float32)
    for k, (image, median, side) in enumerate(zip(images, medians, sides, strict=True)):
        peers = [m for m, s in zip(medians, sides, strict=True) if s == side and np.isfinite(m).all()]
        gain = np.median(peers, axis=0) / np.maximum(median, 1) if np.isfinite(median).all() else np.ones(3)
        evened[k] = _to_lab(image, np.clip(gain, 1 / GAIN, GAIN))
    return evened


def _to_lab(image: np.ndarray, gain: np.ndarray) -> np.ndarray:
    import cv2

    levels = np.clip(np.arange(256)[None, :, None] * (gain / 255), 0, 1).astype(np.float32)
    return cv2.cvtColor(cv2.LUT(image, levels), cv2.COLOR_RGB2LAB)
