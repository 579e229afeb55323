"""Rough boards as the pipeline finds them, beside the true ones in the same working units."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.assemble.types import Assembly
from kerfwright.cache import read_kept
from kerfwright.capture.types import Capture
from kerfwright.evaluate.truth import Truth, read_truth
from kerfwright.identify.freespace import FreeSpace, see_through
from kerfwright.identify.types import Parts, Sheet
from kerfwright.model import Quantity
from kerfwright.pipeline import STAGES, ReconstructOptions, run_stages
from kerfwright.progress import Reporter

__all__ = ["Rough", "free_space", "match", "rough_boards", "seen_on", "side_by_side"]

CLOSE_DEGREES = 10.0  # between sheet normals of boards that may be the same
LEAST_OVERLAP = 0.3  # of their outlines
NEEDED = ("capture", "identify", "assemble")
LAST = [stage.name for stage in STAGES].index(NEEDED[-1])
MOSTLY = 0.7  # of a true board, that lies in a rough one of which it is a part


@dataclass(frozen=True, eq=False)
class Rough:
    """What the stages before `refine` made, and the truth as sheets in the same frame and unit."""

    capture: Capture
    parts: Parts
    assembly: Assembly
    truth: tuple[Sheet, ...]
    unit: float  # mm


def rough_boards(folder: Path, kept: Path | None = None) -> Rough:
    """The stages before `refine` of one capture; from the .cache of kept/NAME where that is there."""
    cache = None if kept is None else kept / folder.name / ".cache"
    found = {n: read_kept(cache, n) if cache and cache.is_dir() else None for n in NEEDED}
    if any(found[n] is None for n in NEEDED):
        found = run_stages(folder, ReconstructOptions(), Reporter(), stages=STAGES[: LAST + 1])
    truth, capture = read_truth(folder / "truth"), found["capture"]
    world_from_truth = np.linalg.inv(capture.capture_from_world) @ truth.capture_from_truth
    boards = tuple(_true_sheet(truth, k, world_from_truth) for k in range(len(truth.boards)))
    return Rough(capture, found["identify"], found["assemble"], boards, 1 / _size(world_from_truth))


def _size(similarity: np.ndarray) -> float:
    return float(np.cbrt(np.linalg.det(similarity[:3, :3])))


def _true_sheet(truth: Truth, k: int, world_from_truth: np.ndarray) -> Sheet:
    """A true board in the stages' frame; its region is its largest extent over the thickness."""
    board, unit = truth.boards[k], _size(world_from_truth)
    pose = world_from_truth @ board.truth_from_board
    pose[:3, :3] /= unit
    flat = ((board.vertices - board.truth_from_board[:3, 3]) @ board.truth_from_board[:3, :3])[:, :2] * unit
    triangles = [t for t in shapely.polygons(flat[board.triangles]) if t.area > 1e-6]
    shadow = shapely.union_all(shapely.buffer(triangles, 1e-2)).buffer(-1e-2).simplify(1e-2)
    none = np.zeros(0, int)
    region = max(shapely.get_parts(shadow), key=lambda p: p.area)
    return Sheet(board.name, pose, Quantity(value=board.thickness * unit), True, region, none, none, none)


def free_space(rough: Rough) -> FreeSpace:
    """What the cameras saw through, as `refine` asks for it."""
    return see_through(
        rough.capture, rough.parts.spacing, max(5 * rough.parts.noise, rough.capture.cloud.diameter / 150)
    )


def match(rough: Rough) -> dict[int, int]:
    """{true board: rough board}: the one-to-one match of largest overlap in the rough boards' planes."""
    from scipy.optimize import linear_sum_assignment

    share = np.array([[_overlap(t, s) for s in rough.assembly.sheets] for t in rough.truth])
    pairs = zip(*linear_sum_assignment(-share), strict=True)
    return {int(i): int(j) for i, j in pairs if share[i, j] > LEAST_OVERLAP}


def side_by_side(rough: Rough, pairs: dict[int, int]) -> dict[int, tuple[int, ...]]:
    """{rough board: true boards} of rough boards that are several true ones side by side, which none else was found as.

    Such boards are parted later, by their seams or by the gaps that the photographs show.
    """
    out = {}
    for j, found in enumerate(rough.assembly.sheets):
        own = [i for i, k in pairs.items() if k == j]
        free = [i for i, t in enumerate(rough.truth) if i not in pairs and _held(t, found) > MOSTLY]
        if len(own) + len(free) > 1:
            out[j] = (*own, *free)
    return out


def _held(true: Sheet, found: Sheet) -> float:
    """Share of a true board that lies in a found one; 0 where the planes are not the same."""
    outline = seen_on(true, found)
    return float(outline.intersection(found.region).area / outline.area) if _overlap(true, found) > 0 else 0.0


def _overlap(true: Sheet, found: Sheet) -> float:
    """Intersection over union in the found board's plane; 0 where the planes are not the same."""
    if abs(true.normal @ found.normal) < np.cos(np.radians(CLOSE_DEGREES)):
        return 0.0
    half = true.thickness.value / 2
    centre = true.to_world(np.array([[*true.region.centroid.coords[0], half]]))
    if abs(found.to_board(centre)[0, 2] - found.thickness.value / 2) > max(half, found.thickness.value / 2):
        return 0.0
    outline = seen_on(true, found)
    return float(outline.intersection(found.region).area / outline.union(found.region).area)


def seen_on(true: Sheet, found: Sheet) -> Polygon:
    """A true outline on a found board's plane."""
    half = true.thickness.value / 2
    move = lambda xy: found.to_board(true.to_world(np.column_stack([xy, np.full(len(xy), half)])))[:, :2]  # noqa: E731
    return shapely.transform(true.region, move).buffer(0)
