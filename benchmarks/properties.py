"""Turn, move, scale, mirror and shuffle a capture, reconstruct each, and measure what changed besides the place.

The models are compared in the frame of the untouched capture: boards by their nearest middles, contacts by type and
boards, and outlines on both sheet faces by their distance from the outline and the faces of the board they match.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from runs import reconstruct
from scipy.spatial import cKDTree
from tables import markdown

from kerfwright.capture import Capture, Cloud, View, open_capture, write_colmap_text, write_ply
from kerfwright.model import Board, Model, read_model
from kerfwright.model.frames import matrix, transform_points
from kerfwright.model.geometry import path_polygon
from kerfwright.pipeline import STAGES, ReconstructOptions, run_stages
from kerfwright.progress import Reporter

HEADER = ["variant", "boards", "contacts", "lost or new contacts", "rms, % of D", "largest, % of D", "same bytes"]
PREPARED = ["variant", "points", "numbers of points that differ", "of poses", "largest"]
SAMPLE = 1.0  # mm between points of an outline


@dataclass(frozen=True)
class Variant:
    """x_in_variant = variant_from_capture @ x_in_capture (4x4), and what else is done to the capture."""

    name: str
    variant_from_capture: np.ndarray
    up: str = "z"
    change: Callable[[Capture], Capture] = lambda capture: capture


def variants(seed: int) -> list[Variant]:
    """The properties that are looked at."""
    rng = np.random.default_rng(seed)
    still = np.eye(4)
    turn, move, lie = still.copy(), still.copy(), still.copy()
    c, s = np.cos(np.radians(37)), np.sin(np.radians(37))
    turn[:2, :2] = [[c, -s], [s, c]]
    move[:3, 3] = [8000, -6000, 0]
    lie[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    return [
        Variant("untouched, twice", still),
        Variant("points shuffled", still, change=lambda c: replace(c, cloud=c.cloud.select(_order(c.cloud, rng)))),
        Variant("photographs shuffled", still, change=lambda c: replace(c, views=_shuffled(c.views, rng))),
        Variant("turned 37 degrees", turn),
        Variant("lying, --up x", lie, up="x"),
        Variant("moved 10 km", move),
        Variant("scaled by 0.1", np.diag([0.1, 0.1, 0.1, 1.0])),
        Variant("mirrored", np.diag([-1.0, 1.0, 1.0, 1.0])),
    ]  # fmt: skip


def _order(things: Cloud | Sequence[View], rng: np.random.Generator) -> np.ndarray:
    return rng.permutation(len(things))


def _shuffled(views: Sequence[View], rng: np.random.Generator) -> tuple[View, ...]:
    return tuple(views[k] for k in _order(views, rng))


def write_variant(capture: Capture, variant: Variant, folder: Path) -> float:
    """Write the capture as it is changed; returns by how much it was scaled."""
    changed = variant.change(capture)
    linear = variant.variant_from_capture[:3, :3]
    scale, mirrored = float(np.cbrt(abs(np.linalg.det(linear)))), np.linalg.det(linear) < 0
    (folder / "images").mkdir(parents=True)
    for view in changed.views:
        _write_image(view, folder / "images" / view.name, mirrored)
    views = [_moved(view, variant.variant_from_capture, mirrored) for view in changed.views]
    write_colmap_text(folder / "sparse" / "0", views)
    cloud = changed.cloud
    points = transform_points(variant.variant_from_capture, cloud.points)
    write_ply(folder / "cloud.ply", Cloud(points, cloud.normals @ linear.T / scale, cloud.colours), double=True)
    return scale


def _write_image(view: View, path: Path, mirrored: bool) -> None:
    """The same bytes, or the picture mirrored without loss: PNG, whatever its name, for readers look at the bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not mirrored:
        shutil.copy(view.path, path)
        return
    import cv2

    path.write_bytes(cv2.imencode(".png", view.image()[:, ::-1, ::-1])[1].tobytes())


def _moved(view: View, variant_from_capture: np.ndarray, mirrored: bool) -> View:
    """The view of the moved world; a mirrored world is seen by a camera whose x axis is mirrored as well."""
    linear = variant_from_capture[:3, :3]
    scale = np.cbrt(abs(np.linalg.det(linear)))
    flip = np.diag([-1.0 if mirrored else 1.0, 1.0, 1.0])
    pose = np.eye(4)
    pose[:3, :3] = flip @ view.camera_from_world[:3, :3] @ linear.T / scale
    pose[:3, 3] = -pose[:3, :3] @ transform_points(variant_from_capture, view.centre[None])[0]
    camera = view.camera
    if mirrored:
        if camera.model != "PINHOLE":
            raise SystemExit(f"{view.name}: camera {camera.model}: mirroring is written for PINHOLE only")
        fx, fy, cx, cy = camera.params
        camera = replace(camera, params=(fx, fy, camera.width - cx, cy))
    return replace(view, camera=camera, camera_from_world=pose)


def compare(found: Model, base: Model, variant: Variant) -> list[str]:
    """A row of the table, its last cell apart."""
    base_from_found = (
        np.linalg.inv(matrix(base.capture_from_model)) @ np.linalg.inv(variant.variant_from_capture)
        @ matrix(found.capture_from_model)
    )  # fmt: skip
    middles = np.array([_middle(b, np.eye(4)) for b in base.boards])
    names, misses = {}, []
    for board in found.boards:
        nearest = base.boards[int(np.linalg.norm(middles - _middle(board, base_from_found), axis=1).argmin())]
        names[board.name] = nearest.name
        misses.append(_distances(board, base_from_found, nearest))
    ours = {(c.type, names[c.a], names[c.b]) for c in found.contacts}
    theirs = {(c.type, c.a, c.b) for c in base.contacts}
    miss = np.concatenate(misses) / _diameter(base) * 100
    boards = f"{len(found.boards)}" + ("" if len(set(names.values())) == len(base.boards) else " (not one to one)")
    return [
        variant.name, boards, str(len(found.contacts)), str(len(ours ^ theirs)),
        f"{np.sqrt((miss**2).mean()):.4f}", f"{miss.max():.4f}",
    ]  # fmt: skip


def _outline(board: Board) -> np.ndarray:
    """Points (N, 3) of the outlines on both sheet faces, board frame."""
    xy = shapely.get_coordinates(shapely.segmentize(path_polygon(board.cut_path).boundary, SAMPLE))
    return np.concatenate([np.c_[xy, np.full(len(xy), z)] for z in (0.0, board.thickness.value)])


def _middle(board: Board, target_from_model: np.ndarray) -> np.ndarray:
    points = _outline(board)
    target_from_board = target_from_model @ matrix(board.model_from_board)
    return transform_points(target_from_board, (points.min(axis=0) + points.max(axis=0))[None] / 2)[0]


def _distances(board: Board, base_from_found: np.ndarray, other: Board) -> np.ndarray:
    """How far (mm) the outlines of a board lie from the edges of another."""
    other_from_board = np.linalg.inv(matrix(other.model_from_board)) @ base_from_found @ matrix(board.model_from_board)
    x = transform_points(other_from_board, _outline(board))
    within = shapely.distance(path_polygon(other.cut_path).boundary, shapely.points(x[:, :2]))
    across = np.minimum(np.abs(x[:, 2]), np.abs(x[:, 2] - other.thickness.value))
    return np.hypot(within, across)


def _diameter(model: Model) -> float:
    points = [transform_points(matrix(b.model_from_board), _outline(b)) for b in model.boards]
    return float(np.ptp(np.concatenate(points), axis=0).max())


def prepared(folder: Path, scale: float, up: str) -> Capture:
    """What the stages get of the capture."""
    options = ReconstructOptions(up=up, millimetres_per_unit=scale)
    return run_stages(folder, options, Reporter(), stages=STAGES[:1])["capture"]


def compare_prepared(found: Capture, base: Capture, variant: Variant) -> list[str]:
    """A row of the table of what the stages get; working units, D = 500."""
    if len(found.cloud) != len(base.cloud):
        return [variant.name, str(len(found.cloud)), "-", "-", "-"]
    if np.linalg.det(variant.variant_from_capture) < 0:
        found = _mirrored_back(found, base)
    pairs = [(found.cloud.points, base.cloud.points)]
    pairs += [(a.camera_from_world, b.camera_from_world) for a, b in zip(found.views, base.views, strict=True)]
    differ = [np.count_nonzero(a != b) for a, b in pairs]
    largest = max(np.abs(a - b).max() for a, b in pairs)
    return [variant.name, str(len(found.cloud)), str(differ[0]), str(sum(differ[1:])), f"{largest:.1e}"]


def _mirrored_back(found: Capture, base: Capture) -> Capture:
    """The capture mirrored along the axis, x or y, that brings its points to those of the base; in the base's order."""
    choices = []
    for axis in (0, 1):
        flip = np.eye(4)
        flip[axis, axis] = -1
        points = transform_points(flip, found.cloud.points)
        distance, nearest = cKDTree(points).query(base.cloud.points)
        choices.append((float(distance.max()), flip, points[nearest]))
    _, flip, points = min(choices, key=lambda choice: choice[0])
    image = np.diag([-1.0, 1.0, 1.0, 1.0])
    views = tuple(replace(view, camera_from_world=image @ view.camera_from_world @ flip) for view in found.views)
    return replace(found, cloud=Cloud(points, points), views=views)


def run(capture: Path, out: Path, scale: float, up: str) -> Path:
    """Reconstruct; the path of the model."""
    done = reconstruct(capture, out, ["--scale", repr(scale), "--up", up, "-q"])
    if done.code not in (0, 1):
        raise SystemExit(f"{capture}: exit code {done.code}: {done.last_line}")
    return out / "model.json"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--prepared", action="store_true", help="only what the stages get: equal numbers, equal models")
    parser.add_argument("--only", action="append", help="name of a variant; may be repeated")
    given = parser.parse_args()
    shutil.rmtree(given.out / "properties", ignore_errors=True)
    capture, work, rows = open_capture(given.capture), given.out / "properties", []
    base = None
    chosen = [variant for variant in variants(given.seed) if not given.only or variant.name in given.only]
    for k, variant in enumerate([Variant("untouched", np.eye(4)), *chosen]):
        folder = work / str(k) / "capture"  # one name for all, as it stands in the model
        scaled = write_variant(capture, variant, folder)
        scale = capture.scale.millimetres_per_unit / scaled
        if given.prepared:
            found = prepared(folder, scale, variant.up)
            base = base or found
            rows.append(compare_prepared(found, base, variant))
            print(rows[-1], flush=True)
            continue
        path = run(folder, work / str(k) / "out", scale, variant.up)
        model = read_model(path)
        if base is None:
            base, before = model, path.read_bytes()
            continue
        rows.append([*compare(model, base, variant), "yes" if path.read_bytes() == before else "no"])
        print(rows[-1], flush=True)
        (given.out / "properties.md").write_text(markdown(HEADER, rows))
    print(markdown(PREPARED if given.prepared else HEADER, rows))


if __name__ == "__main__":
    main()
