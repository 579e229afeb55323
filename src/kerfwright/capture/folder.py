"""Open a folder of photographs, cameras and a cloud."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kerfwright.capture.frame import moved, up_rotation
from kerfwright.capture.images import ImageFinder, check_photograph, image_size
from kerfwright.capture.normals import normals_or_estimates
from kerfwright.capture.parsing import capture_error, shown
from kerfwright.capture.posed import LARGEST_NUMBER, PosedImage
from kerfwright.capture.readers import find_cameras, find_cloud, read_cloud
from kerfwright.capture.steady import ordered_views, point_order
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.errors import OptionError
from kerfwright.model import Scale

__all__ = ["ASSUMED_MILLIMETRES_PER_UNIT", "open_capture"]

ASSUMED_MILLIMETRES_PER_UNIT = 1000.0
FEWEST_POINTS = 100  # three boards with a plane each need more
MOST_MISSING = 0.5  # of the photographs that cameras name: more, and it is the wrong folder
LEAST_SEEN = 0.01  # of the points that some camera sees
SAMPLE = 2000  # points that are looked for in the photographs


def open_capture(path: Path | str, *, up: str = "z", millimetres_per_unit: float | None = None) -> Capture:
    """Find and read what is in a capture's folder.

    Parameters
    ----------
    path : folder with images/, cameras and a cloud, of any of the formats in docs/formats.md
    up : the axis of the capture that points up: x, -x, y, -y, z, -z, or three numbers with commas between them
    millimetres_per_unit : scale; None takes the unit of the file, or assumes a metre

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
    _check_scale(millimetres_per_unit)
    turn = up_rotation(up)
    views, missing = _views(folder)
    cloud, metres, notes = _cloud(find_cloud(folder), views)
    scale = _scale(millimetres_per_unit, metres)
    return moved(Capture(folder.resolve().name, views, cloud, scale, notes=(*missing, *notes)), turn)


def _scale(millimetres_per_unit: float | None, metres: bool) -> Scale:
    if millimetres_per_unit is None and metres:
        return Scale(millimetres_per_unit=1000.0, origin="file", note="The cloud's format has metres.")
    if millimetres_per_unit is None:
        return Scale(millimetres_per_unit=ASSUMED_MILLIMETRES_PER_UNIT, origin="assumed")
    return Scale(millimetres_per_unit=millimetres_per_unit, origin="given")


def _check_scale(millimetres_per_unit: float | None) -> None:
    if millimetres_per_unit is not None and not 0 < millimetres_per_unit < np.inf:
        raise OptionError(f"--scale: {millimetres_per_unit}: give millimetres a unit, more than 0")


def _views(folder: Path) -> tuple[tuple[View, ...], tuple[str, ...]]:
    """Views whose photographs are there, by file, and a note of those that are not."""
    finder = ImageFinder(folder)
    cameras = find_cameras(folder)
    images = cameras.read(lambda name: finder.find(name, cameras.path, cameras.base))
    files = [finder.find(image.name, cameras.path, cameras.base) for image in images]
    views = tuple(_view(image, file) for image, file in zip(images, files, strict=True) if file)
    missing = sorted(set(finder.missing))
    if len(missing) > MOST_MISSING * (len(views) + len(missing)):
        remedy = f"no such file in {finder.folders[0]}, nor {len(missing) - 1} more: put the photographs there"
        raise capture_error(cameras.path, "image", missing[0], remedy)
    if not views:
        raise capture_error(cameras.path, "images", 0, "no image has a pose: export a model with registered images")
    _check_different(views, cameras.path)
    return ordered_views(views), _missing_note(missing, len(views))


def _missing_note(missing: list[str], there: int) -> tuple[str, ...]:
    if not missing:
        return ()
    some = ", ".join(shown(name) for name in missing[:3]) + (" and others" if len(missing) > 3 else "")
    share = f"{len(missing)} of {len(missing) + there} photographs with cameras"
    return (f"{share} are not there and were left out: {some}",)


def _check_different(views: tuple[View, ...], source: Path) -> None:
    """Two cameras of one photograph: listed twice, or names were matched by their ends and folders are missing."""
    seen: dict[Path, str] = {}
    for view in views:
        if view.path in seen:
            if seen[view.path] == view.name:
                raise capture_error(source, "images", view.name, "two cameras have this photograph: drop one of them")
            found = f"{seen[view.path]} and {view.name}"
            raise capture_error(source, "images", found, f"both are {view.path}: keep the folders that the names have")
        seen[view.path] = view.name


def _view(image: PosedImage, path: Path) -> View:
    size = image_size(path)
    if size != (image.camera.width, image.camera.height):
        raise capture_error(
            path,
            "image size",
            "{}x{}".format(*size),
            f"its camera says {image.camera.width}x{image.camera.height}: use the images the cameras were computed for",
        )
    check_photograph(path, size)
    return View(image.name, path, image.camera, image.camera_from_capture)


def _cloud(path: Path, views: tuple[View, ...]) -> tuple[Cloud, bool, tuple[str, ...]]:
    """The cloud, whether its unit is a metre by its format, and notes."""
    read = read_cloud(path)
    _check_points(read.points, path)
    _check_seen(read.points, views, path)
    rows = (read.points, read.normals, read.colours)
    order = point_order(*rows)
    points, normals, colours = (None if row is None else row[order] for row in rows)
    normals, notes = normals_or_estimates(points, normals, views)
    return Cloud(points, normals, colours), read.metres, notes


def _check_seen(points: np.ndarray, views: tuple[View, ...], path: Path) -> None:
    """Cameras and cloud of different frames are the commonest mistake in putting a capture together."""
    some = points[:: max(1, len(points) // SAMPLE)]
    seen = np.zeros(len(some), bool)
    for view in views:
        pixels, _ = view.project(some)
        with np.errstate(invalid="ignore"):
            seen |= ((pixels >= 0) & (pixels <= [view.camera.width, view.camera.height])).all(axis=1)
    if seen.mean() < LEAST_SEEN:
        remedy = "cameras and cloud lie in different coordinates: export both from the same project, neither moved"
        raise capture_error(path, "points in view of a camera", f"{100 * seen.mean():.1f} %", remedy)


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
