"""Read points from lines of numbers: XYZ, ASC, TXT and PTS, which begins with the number of points.

No standard says which columns follow x y z; a heading does, else the values do: a triple of length 1 is a normal, one
that is nowhere negative a colour, a single column an intensity.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np

from kerfwright.capture.parsing import capture_error, read_lines
from kerfwright.capture.raw_cloud import RawCloud, bytes_of, check_count

__all__ = ["read_xyz"]

HEADING = 3  # lines at most before the numbers
NORMAL = 0.01  # by which the length of a normal may differ from 1
NAMES = {
    "points": (("x", "y", "z"),),
    "normals": (("nx", "ny", "nz"), ("normalx", "normaly", "normalz"), ("normal_x", "normal_y", "normal_z")),
    "colours": (("r", "g", "b"), ("red", "green", "blue")),
}


def read_xyz(path: Path) -> RawCloud:
    """Read the points as they are: values are not judged, NaN included.

    Raises
    ------
    CaptureError
        If the file cannot be read, or its lines are not as many numbers each.
    """
    lines = [line for line in read_lines(path) if line.strip()]
    start = next((k for k, line in enumerate(lines[: HEADING + 1]) if len(_words(line)) >= 3 and _numeric(line)), None)
    if start is None:
        raise capture_error(path, "line 1", lines[0] if lines else "", "x y z belong on each line: export again")
    check_count(len(lines) - start, path, "lines")
    table = _table(lines[start:], path, start)
    heading = [re.sub(r"[^a-z_]", "", word.lower()) for word in _words(lines[start - 1])] if start else []
    return _named(table, heading) if len(heading) == table.shape[1] and "x" in heading else _guessed(table)


def _words(line: str) -> list[str]:
    return re.split(r"[\s,;]+", line.strip().strip(",;"))


def _numeric(line: str) -> bool:
    try:
        [float(word) for word in _words(line)]
    except ValueError:
        return False
    return True


def _table(lines: list[str], path: Path, start: int) -> np.ndarray:
    between = next((mark for mark in ",;" if mark in lines[0]), None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return np.loadtxt([line.strip().strip(",;") for line in lines], delimiter=between, ndmin=2, comments=None)
    except (ValueError, UserWarning) as error:
        reason = " ".join(str(error).split())
        remedy = "as many numbers on each line" + (", with decimal points, not commas" if "," in lines[0] else "")
        raise capture_error(path, f"after line {start}", reason, f"{remedy}: export again") from None


def _named(table: np.ndarray, heading: list[str]) -> RawCloud:
    found = {
        kind: next(([heading.index(n) for n in names] for names in choices if set(names) <= set(heading)), None)
        for kind, choices in NAMES.items()
    }
    points, normals, colours = (None if at is None else table[:, at] for at in found.values())
    return RawCloud(table[:, :3] if points is None else points, normals, None if colours is None else bytes_of(colours))


def _guessed(table: np.ndarray) -> RawCloud:
    rest = table[:, 3:]
    if rest.shape[1] in (1, 4, 7):  # an intensity comes before the colour
        rest = rest[:, 1:]
    normals = colours = None
    for triple in (rest[:, k : k + 3] for k in range(0, rest.shape[1] - 2, 3)):
        if normals is None and _is_normal(triple):
            normals = triple
        elif colours is None and triple.min() >= 0 and triple.max() <= 65535:
            colours = bytes_of(triple)
    return RawCloud(table[:, :3], normals, colours)


def _is_normal(triple: np.ndarray) -> bool:
    """Nearly all of length 1, some of which point backwards along an axis."""
    with np.errstate(over="ignore", invalid="ignore"):
        unit = np.abs(np.linalg.norm(triple, axis=1) - 1) < NORMAL
    return bool(unit.mean() > 0.9 and np.nanmin(triple) < 0)
