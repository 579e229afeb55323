"""The header of a PLY file (Turk, The PLY Polygon File Format, 1994): what its elements and their properties are."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from kerfwright.capture.parsing import capture_error, whole_number

__all__ = ["ASCII", "Element", "PlyHeader", "Property", "read_header"]

ASCII = "ascii"
BYTE_ORDERS = {ASCII: "", "binary_little_endian": "<", "binary_big_endian": ">"}
NUMBER_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
HEADER_BYTES = 1 << 20  # a header is a few hundred bytes; more is no header


@dataclass(frozen=True)
class Property:
    """A column; a list has `length`, the type of the number of items in front of them."""

    name: str
    kind: np.dtype
    length: np.dtype | None = None

    def least_bytes(self, ascii_text: bool) -> int:
        """The least room a value takes: one digit and what parts it from the next, or its bytes."""
        return 2 if ascii_text else (self.length or self.kind).itemsize


@dataclass(frozen=True)
class Element:
    """A table of the file."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def has_lists(self) -> bool:
        """Whether rows differ in size."""
        return any(p.length for p in self.properties)

    def least_bytes(self, ascii_text: bool) -> int:
        """The least room that all rows take."""
        return self.count * sum(p.least_bytes(ascii_text) for p in self.properties)

    @property
    def row(self) -> np.dtype:
        """A row without lists; columns are numbered, as names may repeat."""
        return np.dtype([(str(i), p.kind) for i, p in enumerate(self.properties)])


@dataclass(frozen=True)
class PlyHeader:
    """Encoding and elements; the data begins at byte `size`."""

    path: Path
    encoding: str
    elements: tuple[Element, ...]
    size: int


def read_header(file: BinaryIO, path: Path) -> PlyHeader:
    """Read and check the header; refuses elements that the file has no room for before anything is allocated.

    Raises
    ------
    CaptureError
        If the header is damaged or promises more than the file holds.
    """
    start = file.read(HEADER_BYTES)
    if start[:3] != b"ply":
        raise capture_error(path, "first bytes", start[:3], "not a PLY file: export the cloud as PLY")
    end = start.find(b"end_header")
    size = end + len(b"end_header")
    size += 2 if start[size : size + 2] == b"\r\n" else 1
    if end < 0 or size > len(start):
        raise capture_error(
            path, "header", "no end_header", "the file is cut short or damaged: copy or export it again"
        )
    lines = start[:end].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    header = PlyHeader(path, _encoding(lines, path), _elements(lines, path), size)
    _check_room(header, os.fstat(file.fileno()).st_size - size)
    return header


def _encoding(lines: list[str], path: Path) -> str:
    found = [line.split()[1:2] for line in lines if line.split()[:1] == ["format"]]
    if len(found) != 1 or not found[0] or found[0][0] not in BYTE_ORDERS:
        raise capture_error(path, "format", found, f"expected one of {', '.join(BYTE_ORDERS)}: export the cloud again")
    return found[0][0]


def _elements(lines: list[str], path: Path) -> tuple[Element, ...]:
    order = BYTE_ORDERS[_encoding(lines, path)]
    found: list[tuple[str, int, list[Property]]] = []
    for number, line in enumerate(lines, 1):
        words = line.split()
        if words[:1] == ["element"] and len(words) == 3:
            found.append((words[1], whole_number(words[2], path, f"element {words[1]}"), []))
        elif words[:1] == ["property"] and found:
            found[-1][2].append(_property(words, order, path, number))
        elif words[:1] in (["element"], ["property"]):
            raise capture_error(path, f"header line {number}", line, "not PLY: export the cloud again")
    return tuple(Element(name, count, tuple(properties)) for name, count, properties in found)


def _property(words: list[str], order: str, path: Path, number: int) -> Property:
    kinds = words[2:4] if words[1:2] == ["list"] else words[1:2]
    if len(words) != (5 if words[1:2] == ["list"] else 3) or any(k not in NUMBER_TYPES for k in kinds):
        raise capture_error(
            path, f"header line {number}", " ".join(words), "not a PLY property: export the cloud again"
        )
    dtypes = [np.dtype(order + NUMBER_TYPES[k]) for k in kinds]
    return Property(words[-1], dtypes[-1], dtypes[0] if len(dtypes) == 2 else None)


def _check_room(header: PlyHeader, left: int) -> None:
    for element in header.elements:
        left -= element.least_bytes(header.encoding == ASCII)
        if element.count and left < -1:  # the last line may lack its end
            raise capture_error(
                header.path,
                f"element {element.name}",
                element.count,
                "more than the file holds: it is cut short or its header is wrong, copy or export it again",
            )
