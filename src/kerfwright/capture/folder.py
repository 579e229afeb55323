"""Open a folder of photographs, cameras and a cloud."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kerfwright.capture.bundler import find_bundler, read_bundler
from kerfwright.capture.colmap import find_colmap, read_colmap
from kerfwright.capture.frame import moved, up_rotation
from kerfwright.capture.images import ImageFinder, image_size
from kerfwright.capture.normals import normals_or_estimates
from kerfwright.capture.parsing import capture_error
from kerfwright.capture.ply import read_ply
from kerfwright.capture.posed import LARGEST_NUMBER, PosedImage
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.errors import OptionError
from kerfwright.model import Scale

__all__ = ["ASSUMED_MILLIMETRES_PER_UNIT", "open_capture"]

ASSUMED_MILLIMETRES_PER_UNIT = 1000.0
FEWEST_POINTS = 100  # three boards with a plane each need more
CLOUD_NAMES = ("cloud.ply", "fused.ply")


def open_capture(path: Path | str, *, up: str = "z", millimetres_per_unit: float | None = None) -> Capture:
    """Find and read what is in a capture's folder.

    Parameters
    ----------
    path : folder with images/, a COLMAP model or a Bundler file, and a cloud (PLY)
    up : the axis of the capture that points up: x, -x, y, -y, z, -z, or three numbers with commas between them
    millimetres_per_unit : scale; None assumes that a unit is a metre

    Returns
    -------
    The capture in its own unit, turned so that `up` is +z; photographs are found and measured, not decoded.

    Raises
    ------
    CaptureError
        If something is missing or cannot be used: one line.
    OptionError
        If `up` or the scale makes no sense.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise capture_error(folder, "capture", "no such folder", "give a folder with images, cameras and a cloud")
    scale = _scale(millimetres_per_unit)
    turn = up_rotation(up)
    views = _views(folder)
    cloud, notes = _cloud(_find_cloud(folder), views)
    return moved(Capture(folder.resolve().name, views, cloud, scale, notes=notes), turn)


def _scale(millimetres_per_unit: float | None) -> Scale:
    if millimetres_per_unit is None:
        return Scale(millimetres_per_unit=ASSUMED_MILLIMETRES_PER_UNIT, origin="assumed")
    if not (np.isfinite(millimetres_per_unit) and millimetres_per_unit > 0):
        raise OptionError(f"--scale: {millimetres_per_unit}: give millimetres a unit, more than 0")
    return Scale(millimetres_per_unit=millimetres_per_unit, origin="given")


def _views(folder: Path) -> tuple[View, ...]:
    finder = ImageFinder(folder)
    if model := find_colmap(folder):
        images, source, base = read_colmap(model), model, None
    elif bundle := find_bundler(folder):
        base, source = bundle.parent, bundle
        images = read_bundler(bundle, lambda name: finder.find(name, bundle, base))
    else:
        raise capture_error(
            folder, "cameras", "none", "put a COLMAP model into sparse/0 or a Bundler file into bundle/bundle.out"
        )
    return tuple(_view(image, finder.find(image.name, source, base)) for image in images)


def _view(image: PosedImage, path: Path) -> View:
    size = image_size(path)
    if size != (image.camera.width, image.camera.height):
        raise capture_error(
            path,
            "image size",
            "{}x{}".format(*size),
            f"its camera says {image.camera.width}x{image.camera.height}: use the images the cameras were computed for",
        )
    return View(image.name, path, image.camera, image.camera_from_capture)


def _find_cloud(folder: Path) -> Path:
    """cloud.ply, else fused.ply, else the largest *.ply."""
    files = sorted(
        (p for p in folder.iterdir() if p.suffix.lower() == ".ply" and p.is_file()),
        key=lambda p: (-p.stat().st_size, p.name),
    )
    if not files:
        raise capture_error(folder, "cloud", "none", "put the stereo cloud there as cloud.ply")
    return min(files, key=lambda p: CLOUD_NAMES.index(p.name) if p.name in CLOUD_NAMES else len(CLOUD_NAMES))


def _cloud(path: Path, views: tuple[View, ...]) -> tuple[Cloud, tuple[str, ...]]:
    read = read_ply(path)
    _check_points(read.points, path)
    normals, notes = normals_or_estimates(read.points, read.normals, views)
    return Cloud(read.points, normals, read.colours), notes


def _check_points(points: np.ndarray, path: Path) -> None:
    if len(points) < FEWEST_POINTS:
        raise capture_error(path, "points", len(points), f"at least {FEWEST_POINTS} are needed: export the dense cloud")
    bad = np.flatnonzero(~(np.abs(points) < LARGEST_NUMBER).all(axis=1))  # NaN is not either
    if len(bad):
        raise capture_error(
            path,
            f"vertex {bad[0]}",
            points[bad[0]],
            f"not a place ({len(bad)} such): remove these points, or export again",
        )
    if not np.ptp(points, axis=0).max() > 1e-9 * np.abs(points).max():
        raise capture_error(path, "points", points[0], "all are at one place: export the dense cloud")
