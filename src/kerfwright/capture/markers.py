"""The scale from printed markers of known size that the photographs show: ArUco and AprilTag, by OpenCV."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kerfwright.capture.types import View
from kerfwright.errors import CaptureError, OptionError, shown
from kerfwright.model import Scale

__all__ = ["Markers", "marker_scale", "parse_markers"]

FAMILIES = {
    **{f"{n}x{n}_{count}": f"DICT_{n}X{n}_{count}" for n in (4, 5, 6, 7) for count in (50, 100, 250, 1000)},
    "aruco": "DICT_ARUCO_ORIGINAL",
    "apriltag16h5": "DICT_APRILTAG_16h5",
    "apriltag25h9": "DICT_APRILTAG_25h9",
    "apriltag36h10": "DICT_APRILTAG_36h10",
    "apriltag36h11": "DICT_APRILTAG_36h11",
}
UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
FEWEST_VIEWS = 2
MOST_MISS = 3.0  # pixels that a corner may lie off where the others put it; more is another marker of the same number
WIDEST = 0.05  # by which a side may differ from the median of its marker: a square is a square
ROUNDS = 6  # of leaving the worst view of a marker out


@dataclass(frozen=True)
class Markers:
    """Which markers, and the side of their black square, mm."""

    family: str
    side: float


def parse_markers(text: str) -> Markers:
    """From `FAMILY:SIZE`, such as `4x4_50:40mm` or `apriltag36h11:5cm`.

    Raises
    ------
    OptionError
        If it is nothing of the kind.
    """
    found = re.fullmatch(r"\s*(\w+)\s*:\s*([0-9.]+)\s*(mm|cm|m|in)?\s*", text)
    try:
        side = float(found[2]) * UNITS[found[3] or "mm"] if found else 0.0
    except ValueError:
        side = 0.0
    if not found or not 0 < side < 1e5 or found[1].lower() not in FAMILIES:
        known = ", ".join(FAMILIES)
        raise OptionError(f"--markers: {shown(text)}: give FAMILY:SIDE, such as 4x4_50:40mm; families are {known}")
    return Markers(found[1].lower(), side)


def marker_scale(views: Sequence[View], markers: Markers) -> Scale:
    """Millimetres a unit of the views' world, from all markers that two views or more show.

    Corners are intersected from all views that show them; the scale is the median of the sides, its error their spread.

    Raises
    ------
    CaptureError
        If no marker is seen well enough, or a photograph cannot be read.
    """
    seen = _detected(views, markers.family)
    sides, misses, used = [], [], []
    for number, corners in sorted(seen.items()):
        placed = _placed(corners)
        if placed is None:
            continue
        square, miss = placed
        side = np.linalg.norm(square - np.roll(square, -1, axis=0), axis=1)
        if np.abs(side / np.median(side) - 1).max() < WIDEST:
            sides.extend(side)
            misses.append(miss)
            used.append(number)
    if not sides:
        raise CaptureError(
            f"--markers: {markers.family}: {len(seen)} markers found, none of them square in {FEWEST_VIEWS} "
            "photographs or more: check the family, or give --scale"
        )
    return _scale(np.array(sides), float(np.sqrt(np.mean(np.square(misses)))), used, markers)


def _scale(sides: np.ndarray, miss: float, used: list[int], markers: Markers) -> Scale:
    scale = markers.side / float(np.median(sides))
    spread = 1.4826 * float(np.median(np.abs(sides * scale - markers.side)))
    error = scale * spread / markers.side / np.sqrt(len(sides))
    names = ", ".join(map(str, used[:8])) + (" and others" if len(used) > 8 else "")
    return Scale(
        millimetres_per_unit=scale, origin="measured", standard_error=error,
        note=(
            f"From {len(used)} markers of {markers.family} ({names}), {markers.side:g} mm: sides differ by "
            f"{spread:.2f} mm, corners lie {miss:.2f} pixels off."
        ),
    )  # fmt: skip


def _detected(views: Sequence[View], family: str) -> dict[int, list[tuple[View, np.ndarray]]]:
    """Of each marker, the views that show it and its four corners there, (4, 2) pixels from the image's corner."""
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, FAMILIES[family]))
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
    detector = cv2.aruco.ArucoDetector(dictionary, settings)
    seen: dict[int, list[tuple[View, np.ndarray]]] = {}
    for view in views:
        corners, numbers, _ = detector.detectMarkers(cv2.cvtColor(view.image(), cv2.COLOR_RGB2GRAY))
        for square, number in zip(corners, () if numbers is None else np.ravel(numbers), strict=False):
            seen.setdefault(int(number), []).append((view, square.reshape(4, 2).astype(float) + 0.5))
    return seen


def _placed(corners: list[tuple[View, np.ndarray]]) -> tuple[np.ndarray, float] | None:
    """The corners in world, (4, 3), and by how many pixels they miss, RMS; None where views do not agree."""
    for _ in range(ROUNDS):
        if len(corners) < FEWEST_VIEWS:
            return None
        square = np.array([_intersected([(v, c[k]) for v, c in corners]) for k in range(4)])
        miss = np.array([np.linalg.norm(v.project(square)[0] - c, axis=1).max() for v, c in corners])
        if np.nanmax(miss) < MOST_MISS and not np.isnan(miss).any():
            return square, float(np.sqrt(np.mean(miss**2)))
        worst = int(np.nan_to_num(miss, nan=np.inf).argmax())
        corners = corners[:worst] + corners[worst + 1 :]
    return None


def _intersected(sights: list[tuple[View, np.ndarray]]) -> np.ndarray:
    """The point nearest to all lines of sight, (3,)."""
    matrix, right = np.zeros((3, 3)), np.zeros(3)
    for view, pixel in sights:
        towards = view.camera_from_world[:3, :3].T @ np.array([*view.camera.undistort(pixel[None])[0], 1.0])
        towards /= np.linalg.norm(towards)
        across = np.eye(3) - np.outer(towards, towards)
        matrix += across
        right += across @ view.centre
    return np.linalg.lstsq(matrix, right, rcond=None)[0]
