"""The truth beside a capture: boards with their meshes and cut paths, and the cloud laid on them.

Truth frame: millimetres, z up, the frame of truth.json (which is in metres).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kerfwright.errors import CaptureError

__all__ = ["TrueBoard", "Truth", "read_truth"]


@dataclass(frozen=True, eq=False)
class TrueBoard:
    """A board as it really is."""

    name: str
    thickness: float  # mm
    truth_from_board: np.ndarray  # (4, 4), mm
    vertices: np.ndarray  # (N, 3) truth frame
    triangles: np.ndarray  # (M, 3)
    loops: tuple[dict[str, Any], ...]  # as in truth.json: edges in the board's plane, mm

    @property
    def normal(self) -> np.ndarray:
        """Unit normal of its top sheet plane."""
        return self.truth_from_board[:3, 2]

    @property
    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices and triangles."""
        return self.vertices, self.triangles


@dataclass(frozen=True, eq=False)
class Truth:
    """An object, and how its capture lies on it."""

    name: str
    boards: tuple[TrueBoard, ...]
    capture_from_truth: np.ndarray  # (4, 4) similarity from millimetres to capture units
    cloud: np.ndarray | None  # (N, 3), truth frame


def read_truth(folder: Path) -> Truth:
    """Read truth.json and frame.json of a truth folder, and cloud.ply beside the folder where there is one.

    Raises
    ------
    CaptureError
        If truth.json is missing or not what it should be.
    """
    record = _json(folder / "truth.json")
    try:
        boards = tuple(_board(part) for part in record["parts"])
        capture_from_truth = _frame(folder / "frame.json") @ np.diag([1e-3, 1e-3, 1e-3, 1])
        return Truth(str(record["name"]), boards, capture_from_truth, _cloud(folder.parent, capture_from_truth))
    except (KeyError, TypeError, IndexError) as error:
        found = f"{type(error).__name__} {error}"
        raise CaptureError(f"{folder}: truth: {found}: give a folder in the format of docs/formats.md") from error


def _json(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CaptureError(f"{path}: file: {error.strerror}: name the folder that holds truth.json") from error
    except ValueError as error:
        raise CaptureError(f"{path}: JSON: {error}: restore the file") from error


def _board(part: dict[str, Any]) -> TrueBoard:
    pose = np.array(part["pose"], float)
    vertices = np.array(part["mesh"]["vertices"], float) @ pose[:3, :3].T + pose[:3, 3]
    pose[:3, 3] *= 1000
    triangles = np.array(part["mesh"]["faces"], int)
    return TrueBoard(part["name"], 1000 * part["thickness"], pose, 1000 * vertices, triangles, tuple(part["loops"]))


def _frame(path: Path) -> np.ndarray:
    """(4, 4) capture from truth in metres; the same frame where no file says otherwise."""
    out = np.eye(4)
    if path.exists():
        record = _json(path)
        out[:3, :3] = record["scale"] * np.array(record["turn"], float)
        out[:3, 3] = record["shift"]
    return out


def _cloud(capture: Path, capture_from_truth: np.ndarray) -> np.ndarray | None:
    path = capture / "cloud.ply"
    if not path.exists():
        return None
    import open3d

    points = np.asarray(open3d.io.read_point_cloud(str(path)).points)
    back = np.linalg.inv(capture_from_truth)
    return points @ back[:3, :3].T + back[:3, 3]
