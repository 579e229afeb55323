"""COLMAP models, text and binary: cameras and poses, not the sparse points (https://colmap.github.io/format.html)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kerfwright.capture.camera import COLMAP_MODELS, Camera
from kerfwright.capture.parsing import capture_error, finite_float, read_bytes, read_lines, whole_number
from kerfwright.capture.posed import PosedImage, checked_camera, pose_matrix
from kerfwright.errors import CaptureError

__all__ = ["find_colmap", "read_colmap"]

# COLMAP's numbers of its camera models, those that kerfwright does not know included, so that an error can name them.
MODEL_NAMES = (
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "OPENCV_FISHEYE",
    "FULL_OPENCV",
    "FOV",
    "SIMPLE_RADIAL_FISHEYE",
    "RADIAL_FISHEYE",
    "THIN_PRISM_FISHEYE",
)
POINT_BYTES = 24  # of a 2-D point in images.bin: x, y, 3-D point id


def find_colmap(folder: Path) -> Path | None:
    """The folder that holds the model, or None: `sparse/0`, `sparse`, or the capture itself."""
    for candidate in (folder / "sparse" / "0", folder / "sparse", folder):
        if any((candidate / f"{stem}{end}").is_file() for stem in ("cameras", "images") for end in (".bin", ".txt")):
            return candidate
    return None


def read_colmap(folder: Path) -> list[PosedImage]:
    """Images with cameras and poses, in the order of the file; binary files come before text, as in COLMAP.

    Raises
    ------
    CaptureError
        If a file is missing, damaged or uses a camera model that kerfwright does not know.
    """
    binary = (folder / "cameras.bin").is_file() and (folder / "images.bin").is_file()
    end, cameras_of, images_of = (
        (".bin", _binary_cameras, _binary_images) if binary else (".txt", _text_cameras, _text_images)
    )
    for path in (folder / f"cameras{end}", folder / f"images{end}"):
        if not path.is_file():
            raise capture_error(
                path, "file", "missing", "a COLMAP model has cameras and images, both .txt or both .bin"
            )
    return list(images_of(folder / f"images{end}", cameras_of(folder / f"cameras{end}")))


def _text_cameras(path: Path) -> dict[int, Camera]:
    return dict(_text_camera(tokens, path, f"line {number}") for number, tokens in _rows(path))


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Line number and words of each line that is neither empty nor a comment."""
    for number, line in enumerate(read_lines(path), 1):
        if (words := line.split()) and not words[0].startswith("#"):
            yield number, words


def _text_camera(words: list[str], path: Path, field: str) -> tuple[int, Camera]:
    if len(words) < 5:
        raise capture_error(
            path, field, " ".join(words), "expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS: export the file again"
        )
    width, height = (
        whole_number(w, path, f"{field} {n}") for w, n in zip(words[2:4], ("width", "height"), strict=True)
    )
    params = tuple(finite_float(w, path, f"{field} parameter {i}") for i, w in enumerate(words[4:], 1))
    return whole_number(words[0], path, f"{field} camera id"), checked_camera(
        words[1], width, height, params, path, field
    )


def _text_images(path: Path, cameras: dict[int, Camera]) -> Iterator[PosedImage]:
    """A line with the pose, then a line with 2-D points that may be empty; some writers leave the empty one out."""
    points_next = False
    for number, line in enumerate(read_lines(path), 1):
        words = line.split()
        if words and words[0].startswith("#"):
            continue
        if not words or (points_next and _is_points(words)):
            points_next = False
            continue
        yield _text_image(line, path, f"line {number}", cameras)
        points_next = True


def _is_points(words: list[str]) -> bool:
    """Whether a line lists 2-D points: X Y POINT3D_ID, repeated."""
    return len(words) % 3 == 0 and words[-1].lstrip("-").isdigit() and words[2].lstrip("-").isdigit()


def _text_image(line: str, path: Path, field: str, cameras: dict[int, Camera]) -> PosedImage:
    words = line.strip().split(maxsplit=9)  # the name may hold spaces
    if len(words) < 10:
        raise capture_error(
            path, field, line.strip(), "expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME: export the file again"
        )
    names = ("QW", "QX", "QY", "QZ", "TX", "TY", "TZ")
    numbers = np.array([finite_float(w, path, f"{field} {n}") for w, n in zip(words[1:8], names, strict=True)])
    camera = _camera_of(whole_number(words[8], path, f"{field} camera id"), cameras, path, field)
    return PosedImage(words[9], camera, pose_matrix(numbers[:4], numbers[4:], path, field))


def _camera_of(camera_id: int, cameras: dict[int, Camera], path: Path, field: str) -> Camera:
    if camera_id not in cameras:
        raise capture_error(
            path, f"{field} camera id", camera_id, "no such camera in the cameras file: export both files together"
        )
    return cameras[camera_id]


class _Bytes:
    """A binary file read from front to back; reading past its end is an error that names the place."""

    def __init__(self, path: Path) -> None:
        self.path, self.data, self.at = path, read_bytes(path), 0

    def skip(self, count: int) -> None:
        if count > len(self.data) - self.at:
            raise self.too_short(count)
        self.at += count

    def too_short(self, count: int) -> CaptureError:
        left = len(self.data) - self.at
        return capture_error(
            self.path,
            f"byte {self.at}",
            f"{left} bytes left of {count}",
            "the file is cut short: copy or export it again",
        )

    def take(self, layout: str) -> tuple:
        start = self.at
        self.skip(struct.calcsize("<" + layout))
        return struct.unpack_from("<" + layout, self.data, start)

    def take_name(self) -> str:
        end = self.data.find(b"\0", self.at)
        if end < 0:
            raise self.too_short(len(self.data) - self.at + 1)
        name = self.data[self.at : end]
        try:
            text = name.decode("utf-8")
        except UnicodeDecodeError:
            raise capture_error(
                self.path, f"byte {self.at} name", name, "image names must be UTF-8: rename the image"
            ) from None
        self.at = end + 1
        return text


def _binary_cameras(path: Path) -> dict[int, Camera]:
    data = _Bytes(path)
    return dict(_binary_camera(data, i) for i in range(data.take("Q")[0]))


def _binary_camera(data: _Bytes, index: int) -> tuple[int, Camera]:
    camera_id, model_id, width, height = data.take("IiQQ")
    field = f"camera {index}"
    model = MODEL_NAMES[model_id] if 0 <= model_id < len(MODEL_NAMES) else f"number {model_id}"
    params = data.take("d" * len(COLMAP_MODELS[model])) if model in COLMAP_MODELS else ()
    return camera_id, checked_camera(model, width, height, params, data.path, field)


def _binary_images(path: Path, cameras: dict[int, Camera]) -> Iterator[PosedImage]:
    data = _Bytes(path)
    for i in range(data.take("Q")[0]):
        _, *pose, camera_id = data.take("I7dI")
        name, field = data.take_name(), f"image {i}"
        data.skip(POINT_BYTES * data.take("Q")[0])
        matrix = pose_matrix(np.array(pose[:4]), np.array(pose[4:]), path, field)
        yield PosedImage(name, _camera_of(camera_id, cameras, path, field), matrix)
