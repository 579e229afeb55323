"""Bundler files (Snavely, Bundler v0.3 user's manual): cameras look along -z, y up, principal point in mid-image."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from kerfwright.capture.images import Locate, image_size
from kerfwright.capture.parsing import capture_error, finite_float, read_lines, whole_number
from kerfwright.capture.posed import LARGEST_NUMBER, PosedImage, checked_camera

__all__ = ["find_bundler", "read_bundler"]

CAMERA_FROM_BUNDLER = np.diag([1.0, -1.0, -1.0])
LINES_A_CAMERA = 5
TURN_TOLERANCE = 1e-3  # of a rotation matrix printed with few digits from an orthonormal one
LIST_LINE = re.compile(
    r"(?P<name>.*?\S)(?:\s+\d+\s+[0-9.eE+-]+)?\s*"
)  # Bundler adds a zero and the focal length of the EXIF


def find_bundler(folder: Path) -> Path | None:
    """The Bundler file, or None: `bundle/bundle.out` or `bundle.out`."""
    return next((p for p in (folder / "bundle" / "bundle.out", folder / "bundle.out") if p.is_file()), None)


def read_bundler(path: Path, locate: Locate) -> list[PosedImage]:
    """Images with cameras and poses in the order of the list; left out are those that are not there, or not registered
    (focal length 0).

    Parameters
    ----------
    path : bundle.out, with list.txt beside it
    locate : gives the file of an image name; its header holds the size that Bundler leaves out

    Raises
    ------
    CaptureError
        If one of the two files is missing or damaged, or their numbers of images differ.
    """
    lines = [
        line.split() for line in read_lines(path) if line.strip() and not line.lstrip().startswith("#")
    ]
    count = whole_number(lines[0][0] if lines else "", path, "number of cameras", least=1)
    names = _names(path.with_name("list.txt"), count)
    if len(lines) - 1 < LINES_A_CAMERA * count:
        raise capture_error(
            path,
            "lines",
            len(lines),
            f"{count} cameras need {LINES_A_CAMERA} each: the file is cut short, export it again",
        )
    cameras = (lines[i : i + LINES_A_CAMERA] for i in range(1, 1 + LINES_A_CAMERA * count, LINES_A_CAMERA))
    images = [
        _image(name, rows, path, f"camera {i}", locate)
        for i, (name, rows) in enumerate(zip(names, cameras, strict=True))
    ]
    return [image for image in images if image]


def _names(path: Path, count: int) -> list[str]:
    if not path.is_file():
        raise capture_error(path, "file", "missing", "Bundler's list of images belongs beside bundle.out")
    lines = [line for line in read_lines(path) if line.strip()]
    if len(lines) != count:
        raise capture_error(path, "images", len(lines), f"bundle.out has {count} cameras: export both files together")
    return [LIST_LINE.fullmatch(line.strip()).group("name") for line in lines]


def _image(name: str, rows: list[list[str]], path: Path, field: str, locate: Locate) -> PosedImage | None:
    if [len(row) for row in rows] != [3] * LINES_A_CAMERA:
        raise capture_error(
            path, field, " ".join(rows[0]), "expected five lines of three numbers: export the file again"
        )
    numbers = np.array([[finite_float(word, path, field) for word in row] for row in rows])
    focal, k1, k2 = map(float, numbers[0])
    file = locate(name) if focal else None
    if file is None:
        return None
    width, height = image_size(file)
    camera = checked_camera("RADIAL", width, height, (focal, width / 2, height / 2, k1, k2), path, field)
    return PosedImage(name, camera, _pose(numbers[1:4], numbers[4], path, field))


def _pose(turn: np.ndarray, translation: np.ndarray, path: Path, field: str) -> np.ndarray:
    square = np.abs(turn).max() < 2 and np.allclose(turn @ turn.T, np.eye(3), atol=TURN_TOLERANCE)
    if not square or np.linalg.det(turn) < 0:
        raise capture_error(path, f"{field} rotation", turn.tolist(), "not a rotation: export the file again")
    if not (np.abs(translation) < LARGEST_NUMBER).all():
        raise capture_error(path, f"{field} translation", translation.tolist(), "not a pose: export the file again")
    u, _, vt = np.linalg.svd(turn)
    pose = np.eye(4)
    pose[:3, :3] = CAMERA_FROM_BUNDLER @ u @ vt
    pose[:3, 3] = CAMERA_FROM_BUNDLER @ translation
    return pose
