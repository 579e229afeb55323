"""Where the photographs of a capture lie, and how large they are, without decoding them."""

from __future__ import annotations

import os
import re
import struct
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from kerfwright.capture.parsing import capture_error, read_bytes

__all__ = ["ImageFinder", "Locate", "check_photograph", "image_size"]

Locate = Callable[[str], Path | None]  # the file of an image's name, None where it is missing

SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff"})
JPEG_SIZE_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # start of frame; ITU-T T.81, table B.1
JPEG_SCAN, JPEG_END = 0xDA, b"\xff\xd9"
MOST_PIXELS = 1 << 28  # of one photograph, decoded .75 GiB; the largest sensors of phones have 200 million
TIFF_WIDTH, TIFF_HEIGHT, TIFF_SHORT, TIFF_LONG = 256, 257, 3, 4  # TIFF 6.0, section 8


class ImageFinder:
    """Finds the files that camera files name, and remembers those that are not there in `missing`.

    No name may lead out of the capture's folder. Names that other machines wrote, absolute or of Windows, are matched
    by their ends; upper and lower case, and the two ways to write an accent, do not matter where none match exactly.
    """

    def __init__(self, capture: Path) -> None:
        self.capture = capture
        self.folders = tuple(f for f in (capture / "images", capture) if f.is_dir())
        self.missing: list[str] = []
        self._by_name: dict[str, list[Path]] = {}
        files = [p for f in self.folders for p in sorted(f.rglob("*")) if p.suffix.lower() in SUFFIXES]
        for path in dict.fromkeys(files):
            for key in dict.fromkeys((_folded(path.name), _folded(path.stem))):
                self._by_name.setdefault(key, []).append(path)
        if not files:
            raise capture_error(
                capture, "images", "none", "put the JPEG, PNG or TIFF photographs into its folder images/"
            )

    def find(self, name: str, source: Path, base: Path | None = None) -> Path | None:
        """The file of a name that `source` gives; names are relative to images/, the capture, or `base`.

        None, and an entry in `missing`, where there is none.

        Raises
        ------
        CaptureError
            If the name leads out of the capture's folder, or two files could be meant.
        """
        folders = (*self.folders, *((base,) if base else ()))
        if not _is_absolute(name):
            for text in dict.fromkeys((name, name.replace("\\", "/"))):
                for folder in folders:
                    path = self._inside(folder, text, name, source)
                    if os.path.isfile(path):  # unlike Path.is_file, false for names that no file can have
                        return path
        found = self._alike(name, source)
        if found is None:
            self.missing.append(name)
        return found

    def _alike(self, name: str, source: Path) -> Path | None:
        """The file whose path ends most like the name."""
        parts = [_folded(part) for part in re.split(r"[\\/]", name) if part not in ("", ".")]
        if not parts:
            return None
        files = self._by_name.get(parts[-1], [])
        ends = [_same_ends(parts[:-1], [_folded(part) for part in path.parts[:-1]]) for path in files]
        best = [path for path, end in zip(files, ends, strict=True) if end == max(ends)]
        if len(best) > 1:
            names = " or ".join(str(path.relative_to(self.capture)) for path in best[:2])
            raise capture_error(source, "image", name, f"could be {names}: keep one of them")
        return best[0] if best else None

    def _inside(self, folder: Path, text: str, name: str, source: Path) -> Path:
        """Judged by the name alone: a user's link to a folder elsewhere is the user's will, a file's `../` is not."""
        path = Path(os.path.abspath(folder / text)) if "\0" not in text else None
        if path is None or not path.is_relative_to(os.path.abspath(self.capture)):
            raise capture_error(
                source, "image", name, f"outside of {self.capture}: use names relative to its folder images/"
            )
        return path


def _is_absolute(name: str) -> bool:
    return bool(re.match(r"[A-Za-z]:[\\/]|[\\/]", name))


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()


def _same_ends(a: list[str], b: list[str]) -> int:
    """How many parts are the same, counted from the end."""
    count = 0
    for x, y in zip(reversed(a), reversed(b), strict=False):
        if x != y:
            break
        count += 1
    return count


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


def check_photograph(path: Path, size: tuple[int, int]) -> None:
    """Refuse what is larger than memory should be given for, and a JPEG whose end is missing, which comes out grey.

    Raises
    ------
    CaptureError
        If the photograph is one of these, or cannot be read.
    """
    if size[0] * size[1] > MOST_PIXELS:
        raise capture_error(path, "image size", "{}x{}".format(*size), f"at most {MOST_PIXELS} pixels: shrink it")
    data = read_bytes(path)
    if data[:2] == b"\xff\xd8" and JPEG_END not in data[_first_scan(data) :]:
        raise capture_error(path, "image", "cut short", "copy or export it again")


def _first_scan(data: bytes) -> int:
    """Where the pixels of a JPEG begin, or its end; previews, which are JPEGs themselves, lie in segments before."""
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF and data[at + 1] != JPEG_SCAN:
        alone = data[at + 1] in (0x01, 0xFF) or 0xD0 <= data[at + 1] <= 0xD8  # fill bytes, markers without a segment
        at += 1 + (data[at + 1] != 0xFF) if alone else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return at


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
