"""Thinner and thicker versions of a capture: fewer or more points, fewer photographs, fewer pixels."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from kerfwright.capture import Capture, Cloud, View, open_capture, write_colmap_text, write_ply

__all__ = ["with_images", "with_pixels", "with_points"]


def with_points(source: Path, folder: Path, count: int) -> Path:
    """The capture with so many points: a random choice, or copies beside their originals where there are too few."""
    capture, rng = open_capture(source), np.random.default_rng(0)
    cloud, total = capture.cloud, len(capture.cloud)
    if count <= total:
        return _written(capture, capture.views, cloud.select(np.sort(rng.choice(total, count, replace=False))), folder)
    idx = np.concatenate([np.arange(total), rng.integers(0, total, count - total)])
    more = cloud.select(idx)
    aside = np.cross(more.normals, rng.normal(size=more.normals.shape))  # along the surface: as noisy, only denser
    aside *= 0.002 * cloud.diameter / np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-9)
    aside[:total] = 0
    return _written(capture, capture.views, Cloud(more.points + aside, more.normals, more.colours), folder)


def with_images(source: Path, folder: Path, count: int) -> Path:
    """The capture with so many photographs: evenly chosen ones, or copies under other names where there are too few.

    A copy shows what its original shows, from the same place: it is work, and nothing new.
    """
    capture = open_capture(source)
    total = len(capture.views)
    if count <= total:
        views = [capture.views[k] for k in np.linspace(0, total - 1, count).round().astype(int)]
    else:
        views = [_numbered(capture.views[k % total], k // total) for k in range(count)]
    return _written(capture, views, capture.cloud, folder)


def with_pixels(source: Path, folder: Path, factor: float) -> Path:
    """The capture with its photographs shrunk along each side."""
    capture = open_capture(source)
    return _written(capture, capture.views, capture.cloud, folder, factor)


def _numbered(view: View, number: int) -> View:
    """The view under another name, but for number 0."""
    name = Path(view.name)
    return replace(view, name=str(name.with_stem(f"{name.stem}_copy_{number}"))) if number else view


def _written(capture: Capture, views, cloud: Cloud, folder: Path, factor: float = 1.0) -> Path:
    """A capture folder; kept if it is there already."""
    if (folder / "cloud.ply").exists():
        return folder
    (folder / "images").mkdir(parents=True, exist_ok=True)
    write_colmap_text(folder / "sparse" / "0", [_copied(view, folder / "images" / view.name, factor) for view in views])
    write_ply(folder / "cloud.ply", cloud)
    return folder


def _copied(view: View, path: Path, factor: float) -> View:
    if factor == 1.0:
        path.unlink(missing_ok=True)
        path.symlink_to(view.path.resolve())
        return view
    import cv2

    camera = view.camera.scaled(factor)
    small = cv2.resize(view.image(), (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(path), small[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])
    return replace(view, camera=camera, path=path)
