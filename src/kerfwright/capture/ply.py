"""Read the points of a PLY file: ASCII and both byte orders; other elements, properties and lists are passed over."""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from kerfwright.capture.parsing import capture_error
from kerfwright.capture.ply_header import ASCII, Element, PlyHeader, read_header
from kerfwright.capture.raw_cloud import MOST_POINTS, RawCloud

__all__ = ["read_ply"]

COLUMNS = {
    "points": (("x", "y", "z"),),
    "normals": (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")),
    "colours": (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue")),
}


@np.errstate(invalid="ignore", over="ignore")  # at NaN of the signalling kind
def read_ply(path: Path) -> RawCloud:
    """Read the vertices as they are: values are not judged, NaN included.

    Raises
    ------
    CaptureError
        If the file cannot be read, is damaged, or has no coordinates.
    """
    try:
        with path.open("rb") as file:
            header = read_header(file, path)
            index, element = _vertices(header)
            columns = [_indices(element, names) for names in COLUMNS.values()]
            wanted = [i for triple in columns for i in triple or ()]
            file.seek(header.size)
            read = _ascii_columns if header.encoding == ASCII else _binary_columns
            table = dict(zip(wanted, read(file, header, index, wanted), strict=True))
    except OSError as error:
        raise capture_error(path, "file", error.strerror, "check that it exists and can be read") from error
    points, normals, colours = ([table[i] for i in triple] if triple else None for triple in columns)
    return RawCloud(_stacked(points), _stacked(normals) if normals else None, _bytes(colours) if colours else None)


def _vertices(header: PlyHeader) -> tuple[int, Element]:
    index = next((i for i, e in enumerate(header.elements) if e.name == "vertex"), None)
    if index is None:
        raise capture_error(header.path, "element vertex", "missing", "export a cloud of points")
    element = header.elements[index]
    if _indices(element, COLUMNS["points"]) is None:
        names = " ".join(p.name for p in element.properties) or "none"
        raise capture_error(header.path, "vertex properties", names, "x, y and z are needed: export the cloud again")
    if element.count > MOST_POINTS:
        raise capture_error(header.path, "element vertex", element.count, f"at most {MOST_POINTS}: thin the cloud")
    return index, element


def _indices(element: Element, choices: tuple[tuple[str, ...], ...]) -> tuple[int, ...] | None:
    """Indices of the first triple of properties that is there as a whole."""
    place = {p.name: i for i, p in reversed(list(enumerate(element.properties))) if p.length is None}
    return next((tuple(place[n] for n in names) for names in choices if all(n in place for n in names)), None)


def _stacked(columns: list[np.ndarray]) -> np.ndarray:
    out = np.empty((len(columns[0]), len(columns)))
    for i, column in enumerate(columns):
        out[:, i] = column
    return out


def _bytes(columns: list[np.ndarray]) -> np.ndarray:
    """Colours 0 to 255, whatever the file's type: real numbers are taken as 0 to 1, if none is larger."""
    if all(c.dtype == np.uint8 for c in columns):
        return np.stack(columns, axis=1)
    values = np.nan_to_num(_stacked(columns))
    if columns[0].dtype.kind == "u":
        factor = 255 / np.iinfo(columns[0].dtype).max
    else:
        factor = 255.0 if columns[0].dtype.kind == "f" and values.size and values.max() <= 1 else 1.0
    return np.clip(np.round(values * factor), 0, 255).astype(np.uint8)


def _binary_columns(file: BinaryIO, header: PlyHeader, index: int, wanted: list[int]) -> list[np.ndarray]:
    for element in header.elements[:index]:
        if element.has_lists:
            for _ in _list_rows(file, element, header):
                pass
        else:
            file.seek(element.count * element.row.itemsize, io.SEEK_CUR)
    element = header.elements[index]
    if element.has_lists:
        rows = np.array([[row[i] for i in wanted] for row in _list_rows(file, element, header)])
        rows = rows.reshape(-1, len(wanted))
        return [rows[:, k].astype(element.properties[i].kind.newbyteorder("=")) for k, i in enumerate(wanted)]
    rows = np.fromfile(file, element.row, element.count)
    if len(rows) < element.count:
        raise _cut_short(header, element, len(rows))
    return [rows[str(i)] for i in wanted]


def _cut_short(header: PlyHeader, element: Element, found: int) -> Exception:
    return capture_error(
        header.path,
        f"element {element.name}",
        f"{found} rows of {element.count}",
        "the file is cut short: copy or export it again",
    )


def _list_rows(file: BinaryIO, element: Element, header: PlyHeader) -> Iterator[list[float | None]]:
    """Row by row, as each has its own size; lists give None."""
    for found in range(element.count):
        try:
            yield [_value(file, p.kind, p.length) for p in element.properties]
        except struct.error:
            raise _cut_short(header, element, found) from None


def _value(file: BinaryIO, kind: np.dtype, length: np.dtype | None) -> float | None:
    if length is None:
        return struct.unpack(_code(kind), file.read(kind.itemsize))[0]
    count = int(struct.unpack(_code(length), file.read(length.itemsize))[0])
    file.seek(max(count, 0) * kind.itemsize, io.SEEK_CUR)
    return None


def _code(kind: np.dtype) -> str:
    """struct's code of a number type."""
    return kind.str[0].replace("|", "<") + kind.char


def _ascii_columns(file: BinaryIO, header: PlyHeader, index: int, wanted: list[int]) -> list[np.ndarray]:
    """Columns of the element; colours of whole numbers keep their type."""
    element = header.elements[index]
    with io.TextIOWrapper(file, encoding="latin-1") as text:
        for before in header.elements[:index]:
            _pass_over(text, before)
        lines = _without_lists(text, element) if element.has_lists else filter(str.strip, text)
        table = _ascii_table(lines, element, wanted, header.path)
    if len(table) < element.count:
        raise _cut_short(header, element, len(table))
    kinds = [element.properties[i].kind for i in wanted]
    return [table[:, k].astype(float if kind.kind == "f" else kind, copy=False) for k, kind in enumerate(kinds)]


def _ascii_table(lines: Iterable[str], element: Element, wanted: list[int], path: Path) -> np.ndarray:
    if not element.count:
        return np.empty((0, len(wanted)))
    try:
        with warnings.catch_warnings(action="ignore"):  # of no lines at all, which the caller tells
            return np.loadtxt(lines, usecols=wanted, max_rows=element.count, comments=None, ndmin=2)
    except ValueError as error:
        found = str(error).split(";")[0]
        raise capture_error(
            path, "element vertex", found, "numbers with decimal points belong here: export again"
        ) from None


def _pass_over(text: io.TextIOBase, element: Element) -> None:
    left = element.count
    while left and (line := text.readline()):
        left -= bool(line.strip())


def _without_lists(text: io.TextIOBase, element: Element) -> Iterator[str]:
    """Lines with a zero in the place of each list."""
    for line in text:
        words, at, out = line.split(), 0, []
        for p in element.properties:
            word = words[at] if at < len(words) else ""
            at += 1 + (int(word) if p.length is not None and word.isdigit() else 0)
            out.append("0" if p.length is not None else word)
        yield " ".join(out)
