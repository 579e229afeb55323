"""Unpack the points of LAZ files in a process of its own.

At some damages lazrs, the library that unpacks, ends its process, or asks for all memory there is. The child loads
lazrs and nothing else, so that it costs no more than starting Python does; laspy reads the header here.
"""

from __future__ import annotations

import errno
import os
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from signal import Signals
from types import ModuleType
from typing import Any

import numpy as np

from kerfwright.capture.parsing import capture_error

__all__ = ["check_chunks", "read_laz"]

# Argument 1 is the LAZ file, 2 where its points begin, 3 how many there are, 4 the file to write them to, 5 the memory
# that may be used. The record of the header that tells how points are packed comes on standard input.
UNPACK = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[5]),) * 2)
import lazrs
record = sys.stdin.buffer.read()
points = bytearray(int(sys.argv[3]) * lazrs.LazVlr(record).item_size())
with open(sys.argv[1], "rb") as packed:
    packed.seek(int(sys.argv[2]))
    lazrs.ParLasZipDecompressor(packed, record).decompress_many(points)
with open(sys.argv[4], "wb") as plain:
    plain.write(points)
"""
# Bytes for Python, lazrs and its threads' stacks; the points are there once, and lazrs keeps what it unpacks them from.
UNPACK_ROOM, UNPACK_COPIES = 2**30, 2
UNPACK_ENVIRONMENT = {"RAYON_NUM_THREADS": "4", "RUST_BACKTRACE": "0"}
REMEDY = "it is damaged: copy or export it again"


def check_chunks(path: Path, start: int) -> None:
    """Refuse a table of chunks that the file has no room for; its place stands before the points, at `start`.

    Raises
    ------
    CaptureError
        If there are more chunks than bytes in the file.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(start)
        (table,) = struct.unpack("<q", file.read(8).ljust(8, b"\0"))
        file.seek(table if table > 0 else max(0, size + table))
        chunks = struct.unpack("<II", file.read(8).ljust(8, b"\0"))[1]
    if chunks > size:
        raise capture_error(path, "chunks", chunks, "more than the file can hold: copy or export it again")


def read_laz(laspy: ModuleType, path: Path) -> Any:
    """The points of a LAZ file, as a LasData of laspy.

    Raises
    ------
    CaptureError
        If they cannot be unpacked.
    laspy's own errors at a damaged header.
    """
    with path.open("rb") as file:
        header = laspy.LasHeader.read_from(file)
    records = header.vlrs.get("LasZipVlr")
    if not records:
        raise capture_error(path, "packing", "not told", REMEDY)
    with tempfile.TemporaryDirectory() as scratch:
        rows = _unpacked(path, header, bytes(records[0].record_data), Path(scratch) / "points")
    points = laspy.ScaleAwarePointRecord(rows, header.point_format, header.scales, header.offsets)
    return laspy.LasData(header=header, points=points)


def _unpacked(path: Path, header: Any, record: bytes, plain: Path) -> np.ndarray:
    """The points' rows as the header tells them, by way of a file."""
    count, length = header.point_count, header.point_format.size
    memory = UNPACK_ROOM + path.stat().st_size + UNPACK_COPIES * count * length
    code, said = _run_unpack([str(v) for v in (path, header.offset_to_point_data, count, plain, memory)], record)
    if code != 0:
        full = os.strerror(errno.ENOSPC).encode() in said
        remedy = f"free some space in {plain.parent.parent}" if full else REMEDY
        raise capture_error(path, "file", _reason(code, said), remedy)
    if plain.stat().st_size != count * length:
        raise capture_error(path, "packing", f"{plain.stat().st_size} bytes, {count} points of {length}", REMEDY)
    return np.fromfile(plain, header.point_format.dtype())


def _reason(code: int, said: bytes) -> str:
    if code < 0:
        return f"lazrs ended with {Signals(-code).name}"
    lines = said.decode("utf-8", "replace").strip().splitlines()
    return lines[-1].strip() if lines else f"lazrs ended with {code}"


def _run_unpack(arguments: Sequence[str], record: bytes) -> tuple[int, bytes]:
    """Run UNPACK; its exit code, negative for a signal, and what it said."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", UNPACK, *arguments], input=record, capture_output=True, check=False,
        env=os.environ | UNPACK_ENVIRONMENT,
    )  # fmt: skip
    return done.returncode, done.stderr
