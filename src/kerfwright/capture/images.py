"""Where the photographs of a capture lie, and how large they are, without decoding them."""

from __future__ import annotations

import os
import re
import struct
from pathlib import Path
from typing import BinaryIO

from kerfwright.capture.parsing import capture_error

__all__ = ["ImageFinder", "image_size"]

SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff"})
JPEG_SIZE_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # start of frame; ITU-T T.81, table B.1
TIFF_WIDTH, TIFF_HEIGHT, TIFF_SHORT, TIFF_LONG = 256, 257, 3, 4  # TIFF 6.0, section 8


class ImageFinder:
    """Finds the files that camera files name. No name may lead out of the capture's folder."""

    def __init__(self, capture: Path) -> None:
        self.capture = capture
        self.folders = tuple(f for f in (capture / "images", capture) if f.is_dir())
        if not any(p.suffix.lower() in SUFFIXES for f in self.folders for p in f.rglob("*")):
            raise capture_error(
                capture, "images", "none", "put the JPEG, PNG or TIFF photographs into its folder images/"
            )

    def find(self, name: str, source: Path, base: Path | None = None) -> Path:
        """The file of a name that `source` gives; names are relative to images/, the capture, or `base`.

        Raises
        ------
        CaptureError
            If the name leads out of the capture's folder, or there is no such file.
        """
        folders = (*self.folders, *((base,) if base else ()))
        for text in dict.fromkeys((name, name.replace("\\", "/"))):
            for folder in folders:
                path = self._inside(folder, text, name, source)
                if os.path.isfile(path):  # unlike Path.is_file, false for names that no file can have
                    return path
        raise capture_error(
            source, "image", name, f"no such file in {self.folders[0]}: put it there, or export cameras without it"
        )

    def _inside(self, folder: Path, text: str, name: str, source: Path) -> Path:
        """Judged by the name alone: a user's link to a folder elsewhere is the user's will, a file's `../` is not."""
        path = Path(os.path.abspath(folder / text)) if "\0" not in text else None
        if path is None or re.match(r"[A-Za-z]:[\\/]", text) or not path.is_relative_to(os.path.abspath(self.capture)):
            raise capture_error(
                source, "image", name, f"outside of {self.capture}: use names relative to its folder images/"
            )
        return path


def image_size(path: Path) -> tuple[int, int]:
    """Width and height in pixels as stored, from the header of a JPEG, PNG or TIFF file.

    Raises
    ------
    CaptureError
        If the file is none of these or is cut short.
    """
    try:
        with path.open("rb") as file:
            return _size(file)
    except (struct.error, OverflowError, ValueError, IndexError, OSError):
        raise capture_error(
            path, "image", "no size in its header", "check that the file is a whole JPEG, PNG or TIFF"
        ) from None


def _size(file: BinaryIO) -> tuple[int, int]:
    start = file.read(8)
    if start[:2] == b"\xff\xd8":
        return _jpeg_size(file)
    if start == b"\x89PNG\r\n\x1a\n":
        return struct.unpack(">8xII", file.read(16))
    if start[:4] in (b"II*\0", b"MM\0*"):
        return _tiff_size(file, "<" if start[:1] == b"I" else ">", start)
    raise ValueError("unknown format")


def _jpeg_size(file: BinaryIO) -> tuple[int, int]:
    file.seek(2)
    while True:
        marker = file.read(2)
        while marker[1] == 0xFF:  # fill bytes before a marker
            marker = marker[1:] + file.read(1)
        if marker[0] != 0xFF:
            raise ValueError("no marker")
        if marker[1] == 1 or 0xD0 <= marker[1] <= 0xD8:  # markers without a segment
            continue
        (length,) = struct.unpack(">H", file.read(2))
        if marker[1] in JPEG_SIZE_MARKERS:
            height, width = struct.unpack(">xHH", file.read(5))
            return width, height
        file.seek(length - 2, os.SEEK_CUR)


def _tiff_size(file: BinaryIO, order: str, start: bytes) -> tuple[int, int]:
    file.seek(struct.unpack(order + "I", start[4:])[0])
    (count,) = struct.unpack(order + "H", file.read(2))
    found = {}
    for _ in range(count):
        tag, kind, _, value = struct.unpack(order + "HHI4s", file.read(12))
        if kind in (TIFF_SHORT, TIFF_LONG):
            found[tag] = struct.unpack(order + ("H2x" if kind == TIFF_SHORT else "I"), value)[0]
    if not {TIFF_WIDTH, TIFF_HEIGHT} <= found.keys():
        raise ValueError("no size")
    return found[TIFF_WIDTH], found[TIFF_HEIGHT]
