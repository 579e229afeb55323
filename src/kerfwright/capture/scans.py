"""Read LAS and LAZ with laspy, and E57 with pye57, which are installed on wish: the extra `clouds`."""

from __future__ import annotations

import struct
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from kerfwright.capture.laz import check_chunks, read_laz
from kerfwright.capture.parsing import capture_error, read_bytes
from kerfwright.capture.raw_cloud import RawCloud, bytes_of, check_count
from kerfwright.errors import CaptureError

__all__ = ["read_e57", "read_las"]

PACKAGES = {"laspy": "laspy[lazrs]", "pye57": "pye57"}
LAS_MARK, E57_MARK = b"LASF", b"ASTM-E57"
DAMAGED = "it is damaged: copy or export it again"
LEAST_RECORD = 54  # bytes of the head of a variable length record
BEST_COMPRESSION = 200  # times, of LAZ; points of a real cloud come to a tenth of that


def read_las(path: Path) -> RawCloud:
    """Read the points of LAS 1.0 to 1.4, compressed or not.

    Raises
    ------
    CaptureError
        If the file cannot be read or is damaged, or laspy is not installed.
    """
    return _guarded(path, LAS_MARK, "laspy", _las)


def read_e57(path: Path) -> RawCloud:
    """Read the points of all scans (ASTM E2807), each moved to where the file says that it belongs.

    Raises
    ------
    CaptureError
        If the file cannot be read or is damaged, or pye57 is not installed.
    """
    return _guarded(path, E57_MARK, "pye57", _e57)


def _guarded(path: Path, mark: bytes, module: str, read: Callable[[ModuleType, Path], RawCloud]) -> RawCloud:
    """Whatever another library raises at a damaged file is told as ours."""
    if not read_bytes(path).startswith(mark):
        raise capture_error(path, "file", "not of this format", "export the cloud again")
    try:
        library = import_module(module)
    except ImportError as error:
        remedy = f"run `pip install '{PACKAGES[module]}'`, or export the cloud as PLY"
        raise capture_error(path, "file", f"needs {module}", remedy) from error
    try:
        with np.errstate(all="ignore"):  # absurd numbers; what comes of them is judged by whoever takes the cloud
            return read(library, path)
    except (CaptureError, KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # a panic in lazrs is no Exception
        reason = f"{type(error).__name__} {' '.join(str(error).split())}"
        want = "it needs more memory than there is: thin the cloud" if isinstance(error, MemoryError) else DAMAGED
        raise capture_error(path, "file", reason, want) from error


def _check_las_header(path: Path) -> tuple[int, bool]:
    """How many points, and whether they are packed.

    Refuses what would make laspy read for hours: more records than the file has room for (LAS 1.4 R15, table 3).
    """
    with path.open("rb") as file:
        head = file.read(375).ljust(375, b"\0")
    size, minor = path.stat().st_size, head[25]
    header_size, start, records, _, length, count = struct.unpack_from("<HIIBHI", head, 94)
    _, extra, many = struct.unpack_from("<QIQ", head, 235) if minor >= 4 else (0, 0, 0)
    packed = head[104] & 0xC0 != 0  # the mark of LAZ in the point format
    room = (size - start) * (BEST_COMPRESSION if packed else 1)
    if packed:
        check_chunks(path, start)
    for name, number, least, there in (
        ("variable length records", records, LEAST_RECORD, start - header_size),
        ("extended records", extra, LEAST_RECORD, size),
        ("points", max(count, many), max(length, 20), room),
    ):
        if number * least > there:
            raise capture_error(path, name, number, "more than the file can hold: copy or export it again")
    return max(count, many), packed


def _las(laspy: ModuleType, path: Path) -> RawCloud:
    points, packed = _check_las_header(path)
    check_count(points, path, "points")
    las = read_laz(laspy, path) if packed else laspy.read(path)
    names = {name.lower(): name for name in las.point_format.dimension_names}
    xyz = np.stack([np.asarray(las.x), np.asarray(las.y), np.asarray(las.z)], axis=1).astype(float)
    normals = _columns(las, names, (("normalx", "normaly", "normalz"), ("nx", "ny", "nz")))
    colours = _columns(las, names, (("red", "green", "blue"),))
    return RawCloud(xyz, normals, None if colours is None else bytes_of(colours))


def _columns(las, names: dict[str, str], choices: tuple[tuple[str, ...], ...]) -> np.ndarray | None:
    found = next((triple for triple in choices if all(n in names for n in triple)), None)
    return None if found is None else np.stack([np.asarray(las[names[n]], float) for n in found], axis=1)


def _e57(pye57: ModuleType, path: Path) -> RawCloud:
    file = pye57.E57(str(path))
    count = sum(file.get_header(k).point_count for k in range(file.scan_count))
    check_count(count, path, "points")
    if count > 8 * path.stat().st_size:  # a point takes a bit at least
        raise capture_error(path, "points", count, "more than the file can hold: copy or export it again")
    scans = [file.read_scan(k, colors=True, ignore_missing_fields=True) for k in range(file.scan_count)]
    if not scans:
        raise capture_error(path, "scans", 0, "export the cloud again")
    rgb = ("colorRed", "colorGreen", "colorBlue")
    coloured = all(set(rgb) <= scan.keys() for scan in scans)
    points = np.concatenate([np.stack([scan[f"cartesian{a}"] for a in "XYZ"], axis=1) for scan in scans]).astype(float)
    colours = np.concatenate([np.stack([scan[c] for c in rgb], axis=1) for scan in scans]) if coloured else None
    return RawCloud(points, None, None if colours is None else bytes_of(colours), metres=True)
