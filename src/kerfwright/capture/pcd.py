"""Read the points of a PCD file of the Point Cloud Library: ascii, binary, and binary_compressed (LZF, by columns).

https://pointclouds.org/documentation/tutorials/pcd_file_format.html
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kerfwright.capture.parsing import capture_error, read_bytes, whole_number
from kerfwright.capture.raw_cloud import RawCloud, check_count

__all__ = ["read_pcd"]

HEADER_BYTES = 1 << 16
KINDS = {"I": "i", "U": "u", "F": "f"}
LONGEST_RUN = 264  # bytes that three of LZF give at most


@dataclass(frozen=True)
class _Header:
    path: Path
    layout: np.dtype
    count: int
    encoding: str
    size: int  # bytes


@np.errstate(invalid="ignore", over="ignore")  # at NaN of the signalling kind
def read_pcd(path: Path) -> RawCloud:
    """Read the points as they are: values are not judged, NaN included.

    Raises
    ------
    CaptureError
        If the file cannot be read, is damaged, or has no coordinates.
    """
    data = read_bytes(path)
    header = _header(data, path)
    table = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}[header.encoding](data, header)
    names = [name for name in header.layout.names if header.layout[name].shape == ()]
    if not {"x", "y", "z"} <= set(names):
        raise capture_error(path, "FIELDS", " ".join(names), "x, y and z are needed: export the cloud again")
    normal = ("normal_x", "normal_y", "normal_z")
    return RawCloud(
        np.stack([table[n].astype(float) for n in "xyz"], axis=1),
        np.stack([table[n].astype(float) for n in normal], axis=1) if set(normal) <= set(names) else None,
        next((_colours(table[n]) for n in ("rgb", "rgba") if n in names), None),
    )


def _colours(packed: np.ndarray) -> np.ndarray | None:
    """Red, green and blue in the lower 24 bits, also where the bits are kept as a float."""
    if packed.dtype.itemsize != 4:
        return None
    bits = np.ascontiguousarray(packed).view(np.uint32)
    return np.stack([bits >> 16 & 255, bits >> 8 & 255, bits & 255], axis=1).astype(np.uint8)


def _header(data: bytes, path: Path) -> _Header:
    found: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in found:
        end = data.find(b"\n", at, HEADER_BYTES)
        if end < 0:
            raise capture_error(path, "DATA", "missing", "a PCD file has a line DATA: export the cloud again")
        words = data[at:end].decode("ascii", errors="replace").split()
        at = end + 1
        if words and not words[0].startswith("#"):
            found[words[0]] = words[1:]
    encoding = " ".join(found["DATA"]).lower()
    if encoding not in ("ascii", "binary", "binary_compressed"):
        raise capture_error(path, "DATA", encoding, "ascii, binary or binary_compressed: export the cloud again")
    layout = _layout(found, path)
    size = found.get("POINTS") or [str(np.prod([whole_number(n, path, "WIDTH") for n in found.get("WIDTH", ["0"])]))]
    count = whole_number(" ".join(size), path, "POINTS")
    check_count(count, path, "POINTS")
    if count > len(data):  # compressed repeats still take three bytes for 264, and a point is larger than one
        raise capture_error(path, "POINTS", count, "more than the file can hold: copy or export it again")
    return _Header(path, layout, count, encoding, at)


def _layout(found: dict[str, list[str]], path: Path) -> np.dtype:
    names = found.get("FIELDS", [])
    columns = [found.get("SIZE", []), found.get("TYPE", []), found.get("COUNT", ["1"] * len(names))]
    if not names or any(len(column) != len(names) for column in columns) or len(names) > 100:
        raise capture_error(path, "FIELDS", " ".join(names), "SIZE, TYPE, COUNT must be as long: export again")
    fields = []
    for k, (name, size, kind, count) in enumerate(zip(names, *columns, strict=True)):
        if kind not in KINDS or size not in ("1", "2", "4", "8") or (kind == "F" and size not in ("4", "8")):
            raise capture_error(path, f"TYPE of {name}", kind + size, "I, U or F of 1 to 8 bytes: export again")
        repeat = whole_number(count, path, f"COUNT of {name}")
        shape = () if repeat == 1 else (min(repeat, 10_000),)
        unique = name if name != "_" and name not in names[:k] else f"_{k}"
        fields.append((unique, f"<{KINDS[kind]}{size}", shape))
    return np.dtype(fields)


def _short(header: _Header, found: int, wanted: int) -> Exception:
    return capture_error(
        header.path, "points", f"{found} bytes of {wanted}", "the file is cut short: copy or export it again"
    )


def _binary(data: bytes, header: _Header) -> dict[str, np.ndarray]:
    wanted = header.count * header.layout.itemsize
    if len(data) - header.size < wanted:
        raise _short(header, len(data) - header.size, wanted)
    rows = np.frombuffer(data, header.layout, header.count, header.size)
    return {name: rows[name] for name in header.layout.names}


def _ascii(data: bytes, header: _Header) -> dict[str, np.ndarray]:
    words = data[header.size :].split()
    width = sum(int(np.prod(header.layout[n].shape)) for n in header.layout.names)
    if len(words) < header.count * width:
        raise _short(header, len(words), header.count * width)
    out, at = {}, 0
    for name in header.layout.names:
        kind = header.layout[name]
        if kind.shape == ():
            out[name] = _column(words[at : header.count * width : width], kind, name, header)
        at += int(np.prod(kind.shape))
    return out


def _column(words: list[bytes], kind: np.dtype, name: str, header: _Header) -> np.ndarray:
    try:
        values = np.array(words, dtype="S40").astype(float)
    except ValueError as error:
        raise capture_error(header.path, f"column {name}", str(error), "numbers belong here: export it again") from None
    if kind.kind == "f":
        with np.errstate(over="ignore"):
            return values.astype(kind)
    return np.nan_to_num(values, posinf=0, neginf=0).clip(-(2.0**62), 2.0**62).astype(np.int64).astype(kind)


def _compressed(data: bytes, header: _Header) -> dict[str, np.ndarray]:
    packed, size = (int(n) for n in np.frombuffer(data[header.size : header.size + 8].ljust(8, b"\0"), "<u4"))
    wanted = header.count * header.layout.itemsize
    block = data[header.size + 8 : header.size + 8 + packed]
    if size != wanted or len(block) < packed or wanted > LONGEST_RUN * len(block):
        raise _short(header, len(block), packed)
    flat = _unpacked(block, size, header)
    out, at = {}, 0
    for name in header.layout.names:
        kind = header.layout[name]
        values = np.frombuffer(flat, kind.base, header.count * int(np.prod(kind.shape)), at)
        if kind.shape == ():
            out[name] = values
        at += header.count * kind.itemsize
    return out


def _unpacked(block: bytes, size: int, header: _Header) -> bytes:
    """LZF (Lehmann, liblzf): runs of plain bytes, and copies of what came out before."""
    out, at = bytearray(), 0
    try:
        while at < len(block) and len(out) <= size:
            control = block[at]
            at += 1
            if control < 32:
                out += block[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += block[at]
                at += 1
            start = len(out) - ((control & 31) << 8) - block[at] - 1
            at += 1
            if start < 0:
                raise IndexError
            repeat = bytes(out[start : start + length + 2])  # shorter than the copy where it overlaps itself
            out += (repeat * (-(-(length + 2) // len(repeat))))[: length + 2]
    except IndexError:
        raise _short(header, len(out), size) from None
    if len(out) != size:
        raise _short(header, len(out), size)
    return bytes(out)
