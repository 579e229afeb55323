"""Seams of boards glued edge to edge: how many are found, and what is split that should not be.

    python benchmarks/splits.py OUT [--sets single panel lengths butt tee] [--count 50] [--first SEED]

Whole captures take minutes each. Here the sheet is the true one, 0.2 mm and 0.02 degrees off, as are the poses,
and only photographs that look down on the sheet are made (at the size and with the noise of the presets plain and
shadows in turn), without a cloud. OUT keeps the photographs, so that another run takes seconds.
"""

from __future__ import annotations

import argparse
import pickle
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from scipy.spatial.transform import Rotation
from shapely.geometry import LineString, Polygon
from tables import markdown

from kerfwright.assemble.splits import SeamSearch, find_seam_lines
from kerfwright.capture import Camera, Capture, Cloud
from kerfwright.capture.frame import moved, similarity
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles
from kerfwright.model import Board, Model, Quantity, Scale
from kerfwright.model.frames import matrix
from kerfwright.model.geometry import path_polygon
from kerfwright.pipeline import WORKING_SIZE
from kerfwright.synthetic import PRESETS, CaptureOptions, assembled, random_assembly
from kerfwright.synthetic.cameras import camera_path, intrinsics
from kerfwright.synthetic.capture import MemoryView
from kerfwright.synthetic.carpentry import slab
from kerfwright.synthetic.meshes import mesh_in_model
from kerfwright.synthetic.render import photograph
from kerfwright.synthetic.stage import build_stage

LEAST_ELEVATION = 22.0  # degrees, from which a photograph shows a level sheet: 21 of a whole capture's 30
ANGLE_NOISE = 0.02  # degrees, of sheet and poses
OFFSET_NOISE = 0.2  # mm, of the sheet's plane and outline
RIGHT = 2.0  # mm by which a seam may be off
EDGE = 12  # px of background round the panel
COARSE_ROOM = {"floor_texels": 512, "room_nodes": 24, "light_rays": 24}  # the room is seen in a margin only


def main() -> None:
    """Print a row a set, and what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--sets", nargs="+", choices=sorted(SETS), default=["single", "panel"])
    parser.add_argument("--count", type=int, default=50, help="objects a set")
    parser.add_argument("--first", type=int, default=0, help="seed of the first object")
    parser.add_argument("--workers", type=int, default=2)
    o = parser.parse_args()
    rows = []
    for name in o.sets:
        cases = [(name, seed, o.out) for seed in range(o.first, o.first + o.count)]
        with ProcessPoolExecutor(o.workers) as pool:
            results = list(pool.map(judged, cases))
        print("\n".join(r.told() for r in results if not r.right), flush=True)
        rows.append(_row(name, results))
    head = ["set", "objects", "right", "with false", "with missing", "seams", "found", "false", "RMS mm", "s"]
    print(markdown(head, rows))


@dataclass(frozen=True)
class Result:
    """What became of one object; lengths in mm."""

    name: str
    seams: int
    errors: tuple[float, ...]  # of the seams found
    missing: tuple[str, ...]
    false: tuple[str, ...]
    seconds: float

    @property
    def right(self) -> bool:
        return not self.missing and not self.false

    def told(self) -> str:
        return f"{self.name}: of {self.seams} seams missing [{', '.join(self.missing)}] false [{', '.join(self.false)}]"


def _row(name: str, results: list[Result]) -> list[str]:
    errors = np.array([e for r in results for e in r.errors])
    counts = (
        len(results), sum(r.right for r in results), sum(bool(r.false) for r in results),
        sum(bool(r.missing) for r in results), sum(r.seams for r in results), len(errors),
        sum(len(r.false) for r in results),
    )
    rms = f"{np.sqrt((errors**2).mean()):.2f}" if len(errors) else "-"
    return [name, *map(str, counts), rms, f"{np.mean([r.seconds for r in results]):.1f}"]


def judged(case: tuple[str, int, Path]) -> Result:
    """Make or read one object, look for seams in its rough board, and compare."""
    name, seed, out = case
    model, capture = scene(name, seed, out)
    sheet, touching = rough_board(model, capture, np.random.default_rng([seed, 1]))
    diameter = capture.cloud.diameter
    obstacles = Obstacles([sheet, *touching], diameter / 100)
    start = time.perf_counter()
    found = find_seam_lines(SeamSearch(sheet, touching, Photos(capture), obstacles, diameter))
    seconds = time.perf_counter() - start
    return compared(f"{name}_{seed}", true_seams(model), found, sheet, _scale(capture), seconds)


def compared(name: str, true: list[LineString], found, sheet: Sheet, scale: float, seconds: float) -> Result:
    """Seams found against true ones; a seam is right when both its ends lie near one true line."""
    lines = [LineString(sheet.to_world(np.c_[[s.start, s.end], [0, 0]])[:, :2] / scale) for s in found]
    off = np.array([[_apart(line, t) for t in true] for line in lines]).reshape(len(lines), len(true))
    near = off < RIGHT
    told = [f"{_told(line)} {seam.strength:.1f}" for line, seam in zip(lines, found, strict=True)]
    false = [text for text, ok in zip(told, near.any(axis=1), strict=True) if not ok]
    missing = [_told(t) for t, ok in zip(true, near.any(axis=0), strict=True) if not ok]
    errors = tuple(float(off[:, k].min()) for k in range(len(true)) if near[:, k].any())
    return Result(name, len(true), errors, tuple(missing), tuple(false), seconds)


def _apart(line: LineString, true: LineString) -> float:
    """Largest distance between the two, mm; places beyond a true line's ends are measured to its prolongation."""
    a, b = np.asarray(true.coords)
    m = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
    aside = np.abs((np.asarray(line.coords) - a) @ m).max()
    return float(max(aside, line.hausdorff_distance(true) - 15.0))  # ends are the outline's business, not the seam's


def _told(line: LineString) -> str:
    return " to ".join(f"({x:.0f} {y:.0f})" for x, y in line.coords)


def _scale(capture: Capture) -> float:
    return float(1 / np.cbrt(np.linalg.det(capture.capture_from_world[:3, :3])))


def scene(name: str, seed: int, out: Path) -> tuple[Model, Capture]:
    """Object and photographs in the stages' working units; kept in `out`."""
    kept = out / f"{name}_{seed}.pickle"
    if not kept.exists():
        out.mkdir(parents=True, exist_ok=True)
        preset = ("plain", "shadows")[seed % 2]
        made = SETS[name](seed)
        kept.write_bytes(pickle.dumps((made, _photographed(made, PRESETS[preset].seeded(seed)))))
    model, shots = pickle.loads(kept.read_bytes())
    points = np.concatenate([mesh_in_model(b)[0] for b in model.boards])
    views = tuple(_view(k, *shot) for k, shot in enumerate(shots))
    capture = Capture(model.name, views, Cloud(points, np.zeros_like(points)), Scale(millimetres_per_unit=1.0))
    return model, moved(capture, similarity(WORKING_SIZE / capture.cloud.diameter, np.eye(3), np.zeros(3)))


def _view(k: int, camera: Camera, pose: np.ndarray, jpeg: np.ndarray) -> MemoryView:
    import cv2

    pixels = cv2.imdecode(jpeg, cv2.IMREAD_COLOR)[..., ::-1]
    return MemoryView(f"{k}.jpg", Path(f"{k}.jpg"), camera, pose, pixels=pixels)


def _photographed(model: Model, options: CaptureOptions) -> list[tuple[Camera, np.ndarray, np.ndarray]]:
    """Camera, pose with its error, and JPEG of every photograph; cut out round the object, as full ones take longer."""
    import cv2

    seed = options.dataset.seed
    stage = build_stage(model, replace(options.images, **COARSE_ROOM), np.random.default_rng([seed, 0]))
    poses = camera_path(*stage.bounds, options.dataset, np.random.default_rng([seed, 1]))
    poses = [p for p in poses if np.degrees(np.arcsin(-p[2, 2])) > LEAST_ELEVATION]
    rng, camera, shots = np.random.default_rng([seed, 2]), intrinsics(options.dataset), []
    for pose in poses:
        cut = _cut_out(camera, pose, model)
        picture = photograph(stage, cut, pose, rng)
        jpeg = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, options.images.quality])[1]
        shots.append((cut, _slightly_turned(pose, rng), jpeg))
    return shots


def _cut_out(camera: Camera, pose: np.ndarray, model: Model) -> Camera:
    """The part of a camera that sees the boards named panel_*."""
    points = np.concatenate([mesh_in_model(b)[0] for b in model.boards if b.name.startswith("panel_")])
    pixels = camera.project(points @ pose[:3, :3].T + pose[:3, 3])
    low = np.clip(pixels.min(axis=0) - EDGE, 0, None).astype(int)
    high = np.minimum(pixels.max(axis=0) + EDGE, (camera.width, camera.height)).astype(int)
    fx, fy, cx, cy = camera.params
    return Camera(camera.model, *map(int, high - low), (fx, fy, cx - float(low[0]), cy - float(low[1])))


def _slightly_turned(pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The pose turned about its own centre."""
    out = pose.copy()
    out[:3, :3] = Rotation.from_rotvec(np.radians(rng.normal(0, ANGLE_NOISE, 3))).as_matrix() @ pose[:3, :3]
    out[:3, 3] = out[:3, :3] @ pose[:3, :3].T @ pose[:3, 3]
    return out


def rough_board(model: Model, capture: Capture, rng: np.random.Generator) -> tuple[Sheet, list[Sheet]]:
    """The boards named panel_* as one rough board, and the others, in working units."""
    scale = _scale(capture)
    panels = [b for b in model.boards if b.name.startswith("panel_")]
    others = [b for b in model.boards if not b.name.startswith("panel_")]
    flat = [shapely.transform(path_polygon(b.cut_path), lambda p, b=b: _level(b, p)) for b in panels]
    region = shapely.union_all(shapely.buffer(flat, 0.05, join_style="mitre"))
    region = shapely.transform(region, lambda p: scale * (p + rng.normal(0, OFFSET_NOISE, 2)))
    upper = max(matrix(b.model_from_board)[2, 3] + max(0.0, _up(b)) * b.thickness.value for b in panels)
    t = max(b.thickness.value for b in panels)
    frame = np.eye(4)
    frame[:3, :3] = Rotation.from_rotvec(np.radians(rng.normal(0, ANGLE_NOISE, 3))).as_matrix()
    frame[2, 3] = scale * (upper - t + rng.normal(0, OFFSET_NOISE))
    return _sheet("panel", frame, scale * t, region), [_as_sheet(b, scale) for b in others]


def _up(board: Board) -> float:
    return float(np.array(board.model_from_board)[2, 2])


def _level(board: Board, xy: np.ndarray) -> np.ndarray:
    """Points of a level board's outline, seen from above."""
    pose = matrix(board.model_from_board)
    return xy @ pose[:2, :2].T + pose[:2, 3]


def _as_sheet(board: Board, scale: float) -> Sheet:
    pose = matrix(board.model_from_board).copy()
    pose[:3, 3] *= scale
    region = shapely.transform(path_polygon(board.cut_path), lambda p: scale * p)
    return _sheet(board.name, pose, scale * board.thickness.value, region)


def _sheet(name: str, frame: np.ndarray, thickness: float, region: Polygon) -> Sheet:
    none = np.zeros(0, int)
    return Sheet(name, frame, Quantity(value=thickness, standard_error=0.2), True, region, none, none, none)


def true_seams(model: Model) -> list[LineString]:
    """Where two of the boards named panel_* meet, seen from above, mm."""
    lines = []
    for contact in model.contacts:
        if contact.a.startswith("panel_") and contact.b.startswith("panel_"):
            xy = np.concatenate(contact.interface)[:, :2]
            along = xy @ np.array([-contact.normal[1], contact.normal[0]])
            lines.append(LineString([xy[along.argmin()], xy[along.argmax()]]))
    return lines


def lengths(seed: int) -> Model:
    """Boards of several lengths and thicknesses side by side, flush above."""
    rng = np.random.default_rng([101, seed])
    count, high, thickest = int(rng.integers(2, 5)), 60.0, 25.0
    edges = np.concatenate([[0], np.cumsum(rng.integers(70, 160, count))]).astype(float)
    edges -= edges[-1] / 2
    half = float(rng.integers(180, 380))
    boards = []
    for k, (a, b) in enumerate(pairwise(edges)):
        t, (left, right) = float(rng.integers(15, 26)), rng.integers(0, 80, 2)
        boards.append(slab(f"panel_{k}", (-half + left, a, high + thickest - t), (half - right, b, high + thickest)))
    for name, side in (("batten_left", -1), ("batten_right", 1)):
        at = side * 0.5 * half
        for k, panel in enumerate(boards[:count]):
            low = matrix(panel.model_from_board)[2, 3] + min(0.0, _up(panel)) * panel.thickness.value
            a, b = edges[k] + 4, edges[k + 1] - 4
            boards.append(slab(f"{name}_{k}", (at - 12, a, 0), (at + 12, b, low)))
    return assembled(f"lengths_{seed}", boards, seed)


def butt(seed: int) -> Model:
    """Two boards end to end: the seam runs across the grain, end grain against end grain."""
    rng = np.random.default_rng([102, seed])
    left, right = rng.integers(150, 380, 2).astype(float)
    width, t, high = float(rng.integers(90, 220)), float(rng.integers(12, 26)), 50.0
    boards = [
        slab("panel_0", (-left, -width / 2, high), (0, width / 2, high + t)),
        slab("panel_1", (0, -width / 2, high), (right, width / 2, high + t)),
        slab("runner", (-0.8 * left, -width / 4, 0), (0.8 * right, -width / 4 + 25, high)),
        slab("second", (-0.8 * left, width / 4 - 25, 0), (0.8 * right, width / 4, high)),
    ]
    return assembled(f"butt_{seed}", boards, seed)


def tee(seed: int) -> Model:
    """A board beside two that meet end to end: the seams make a T."""
    rng = np.random.default_rng([103, seed])
    length, t, high = float(rng.integers(400, 700)), float(rng.integers(12, 26)), 50.0
    one, other = rng.integers(80, 160, 2).astype(float)
    at = float(rng.integers(-length // 5, length // 5))
    x = length / 2
    boards = [
        slab("panel_0", (-x, -one, high), (x, 0, high + t)),
        slab("panel_1", (-x, 0, high), (at, other, high + t)),
        slab("panel_2", (at, 0, high), (x, other, high + t)),
        slab("batten_left", (-0.6 * x - 12, 5 - one, 0), (-0.6 * x + 12, other - 5, high)),
        slab("batten_right", (0.6 * x - 12, 5 - one, 0), (0.6 * x + 12, other - 5, high)),
    ]
    return assembled(f"tee_{seed}", boards, seed)


SETS: dict[str, Callable[[int], Model]] = {
    "single": lambda seed: random_assembly("single", seed), "panel": lambda seed: random_assembly("panel", seed),
    "lengths": lengths, "butt": butt, "tee": tee,
}

if __name__ == "__main__":
    main()
