"""How exact outlines are: segmentation of rough boards, scored against the truth.

    python benchmarks/segment_accuracy.py [CAPTURE ...] [--pipeline [--kept OUT]] [--views N] [--no-images]
        [--rough cloud|blob] [--overlays DIR]

With --pipeline the rough boards are those that identify and assemble find, as in use. Otherwise they are made from the
truth: a rough board has its planes fitted to its cloud points (as identification would) or moved by --plane-mm and
--plane-degrees, and its region from the density of these points (cloud) or from the true outline with a wavy error
(blob).
Constraint segments come from the true contacts. A row a board: IoU with the true outline, mean and 95th percentile
boundary distance in mm, before and after. A board is `whole` when some photograph shows all of it.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from pipeline_boards import free_space, match, rough_boards, seen_on, side_by_side
from shapely.geometry import LineString, MultiPolygon, Polygon
from shapely.geometry.polygon import orient

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.capture import open_capture
from kerfwright.capture.frame import moved, similarity
from kerfwright.capture.types import Capture
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.types import Sheet
from kerfwright.model import Quantity
from kerfwright.refine.segment import BoardOutlines, SegmentOptions, segment_boards
from kerfwright.refine.segment.scene import Occluders
from kerfwright.refine.segment.views import _inner_samples, _look

CAPTURES = Path("/work/shared/captures")
GLUED = 0.1  # working mm between true boards that are glued edge to edge
WHOLE = 0.98  # share of samples of a board that a photograph shows whole


@dataclass
class TrueBoard:
    """A board of the truth: pose and outline in its own frame, mm."""

    name: str
    world_from_board: np.ndarray
    thickness: float
    outline: Polygon

    def to_board(self, x: np.ndarray) -> np.ndarray:
        return (x - self.world_from_board[:3, 3]) @ self.world_from_board[:3, :3]

    def to_world(self, x: np.ndarray) -> np.ndarray:
        return x @ self.world_from_board[:3, :3].T + self.world_from_board[:3, 3]


def load(folder: Path) -> tuple[Capture, list[TrueBoard], list[dict]]:
    """The capture in the truth's frame, mm, and the true boards and connections."""
    truth = json.loads((folder / "truth" / "truth.json").read_text())
    frame = json.loads((folder / "truth" / "frame.json").read_text())
    scale = frame.get("scale", 1.0)
    turn, shift = np.array(frame.get("turn", np.eye(3))), np.array(frame.get("shift", [0] * 3))
    world_from_capture = similarity(1000 / scale, turn.T, -1000 / scale * turn.T @ shift)
    boards = []
    for part in truth["parts"]:
        pose = np.array(part["pose"], float)
        pose[:3, 3] *= 1000
        v, f = np.array(part["mesh"]["vertices"]) * 1000, np.array(part["mesh"]["faces"])
        triangles = [t for t in shapely.polygons(v[f][:, :, :2]) if t.area > 1e-6]
        outline = largest(shapely.union_all(shapely.buffer(triangles, 1e-2)).buffer(-1e-2).simplify(1e-2))
        boards.append(TrueBoard(part["name"], pose, part["thickness"] * 1000, outline))
    return moved(open_capture(folder), world_from_capture), boards, truth["connections"]


def rough_sheet(board: TrueBoard, capture: Capture, options, rng: np.random.Generator) -> Sheet:
    """A rough board, as identification would find it."""
    x = board.to_board(capture.cloud.points)
    nz = (capture.cloud.normals @ board.world_from_board[:3, :3])[:, 2]
    near = shapely.contains_xy(board.outline.buffer(3), x[:, :2])
    top = np.flatnonzero(near & (abs(x[:, 2] - board.thickness) < 1.5) & (nz > 0.8))
    bottom = np.flatnonzero(near & (abs(x[:, 2]) < 1.5) & (nz < -0.8))
    rim = board.outline.boundary
    cut = np.flatnonzero(near & (x[:, 2] > 0.1) & (x[:, 2] < board.thickness - 0.1) & (abs(nz) < 0.5))
    cut = cut[shapely.distance(shapely.points(x[cut, :2]), rim) < 2] if len(cut) else cut
    pose, thickness = fitted_pose(board, x, top, bottom)
    pose = tilted(pose, options.plane_mm, np.radians(options.plane_degrees), rng)
    rough = Sheet(board.name, pose, Quantity(value=thickness), True, Polygon(), top, bottom, cut)
    on_sheet = rough.to_board(capture.cloud.points[np.concatenate([top, bottom])])[:, :2]
    region = density_region(on_sheet) if options.rough == "cloud" and len(on_sheet) > 400 else blob(board.outline, rng)
    return Sheet(board.name, pose, Quantity(value=thickness), True, orient(region), top, bottom, cut)


def fitted_pose(board: TrueBoard, x: np.ndarray, top: np.ndarray, bottom: np.ndarray) -> tuple[np.ndarray, float]:
    """Pose and thickness from the points on the sheet planes; the true ones where there are too few."""
    lift, thickness = np.zeros(3), board.thickness
    sets = [(i, h) for i, h in ((top, board.thickness), (bottom, 0.0)) if len(i) > 300]
    if sets:
        rows = np.concatenate([np.column_stack([x[i, :2], np.ones(len(i))]) for i, _ in sets])
        z = np.concatenate([x[i, 2] - h for i, h in sets])
        weight = np.ones(len(z))
        for _ in range(8):
            lift = np.linalg.lstsq(rows * weight[:, None], z * weight, rcond=None)[0]
            weight = 1 / np.sqrt(np.maximum(abs(z - rows @ lift) / 0.2, 1))
    if len(sets) == 2:
        thickness = float(np.median(x[top, 2]) - np.median(x[bottom, 2]))
        lift[2] += (board.thickness - thickness) / 2
    normal = np.array([-lift[0], -lift[1], 1.0])
    normal /= np.linalg.norm(normal)
    x_axis = np.array([1.0, 0, 0]) - normal[0] * normal
    x_axis /= np.linalg.norm(x_axis)
    local = np.eye(4)
    local[:3, :3] = np.column_stack([x_axis, np.cross(normal, x_axis), normal])
    local[2, 3] = lift[2]
    return board.world_from_board @ local, thickness


def tilted(pose: np.ndarray, mm: float, radians: float, rng: np.random.Generator) -> np.ndarray:
    """The pose with its plane moved and turned by normal errors."""
    a, b = rng.normal(size=2) * radians
    normal = np.array([a, b, 1.0]) / np.linalg.norm([a, b, 1.0])
    x_axis = np.array([1.0, 0, 0]) - normal[0] * normal
    x_axis /= np.linalg.norm(x_axis)
    local = np.eye(4)
    local[:3, :3] = np.column_stack([x_axis, np.cross(normal, x_axis), normal])
    local[2, 3] = rng.normal() * mm
    return pose @ local


def density_region(xy: np.ndarray, pitch: float = 2.0, sigma: float = 4.0) -> Polygon:
    """Where points are dense: the largest piece of the isocontour, holes included."""
    import cv2
    from skimage.measure import find_contours

    low = xy.min(0) - 20
    index = ((xy - low) / pitch).astype(int)
    raster = np.zeros(index.max(0)[::-1] + 12, np.float32)
    np.add.at(raster, (index[:, 1], index[:, 0]), 1)
    smooth = cv2.GaussianBlur(raster, (0, 0), sigma / pitch)
    contours = find_contours(smooth, 0.3 * np.median(smooth[raster > 0]))
    rings = [Polygon(low + (c[:, ::-1] + 0.5) * pitch) for c in contours if len(c) > 8]
    region = Polygon()
    for ring in sorted((r.buffer(0) for r in rings if r.area > 100), key=lambda p: -p.area):
        region = region.symmetric_difference(ring)
    return joined(region)


def joined(region) -> Polygon:
    """One piece: gaps that another board leaves in the cloud are bridged, as merging faces of a board does."""
    for gap in (0, 10, 20, 40, 80):
        wide = region.buffer(gap).buffer(-gap)
        whole = largest(wide)
        if whole.area > 0.9 * wide.area:
            break
    return whole


def blob(outline: Polygon, rng: np.random.Generator, size: float = 6.0) -> Polygon:
    """The outline with a wavy error of up to about `size` mm."""
    points = np.array([outline.exterior.interpolate(s).coords[0] for s in np.arange(0, outline.length, 3.0)])
    knots = rng.normal(size=(max(4, len(points) // 12), 2)) * size / 2
    at = np.linspace(0, len(knots), len(points), endpoint=False)
    wave = np.column_stack([np.interp(at, np.arange(len(knots) + 1), [*knots[:, k], knots[0, k]]) for k in (0, 1)])
    return largest(Polygon(points + wave, [r.coords for r in outline.interiors]).buffer(0))


def largest(region) -> Polygon:
    return max(region.geoms, key=lambda p: p.area) if isinstance(region, MultiPolygon) else region


def true_constraints(board: TrueBoard, sheet: Sheet, boards: list[TrueBoard]) -> list[ConstraintSegment]:
    """A segment for each stretch of the true outline beyond which another board, or the floor, lies."""
    found = []
    for ring in (orient(board.outline).exterior, *orient(board.outline).interiors):
        corners = np.asarray(ring.coords)[:, :2]
        for a, b in pairwise(corners):
            length = np.linalg.norm(b - a)
            if length > 15:
                found += _runs(board, sheet, boards, a, b, length)
    return found


def _runs(board, sheet, boards, a, b, length) -> list[ConstraintSegment]:
    t = (b - a) / length
    at = np.arange(0.5, length, 1.0)
    xy = a + at[:, None] * t + 0.6 * np.array([t[1], -t[0]])
    world = board.to_world(np.column_stack([xy, np.full(len(xy), board.thickness / 2)]))
    out = []
    for other in (o for o in boards if o is not board):
        p = other.to_board(world)
        hit = (p[:, 2] > 0.05) & (p[:, 2] < other.thickness - 0.05) & shapely.contains_xy(other.outline, p[:, :2])
        out += _segment(board, sheet, a, t, at[hit], "contact")
        if abs(abs(p[:, 2] - other.thickness / 2) - other.thickness / 2 - 0.6).max() < 0.1:
            beside = shapely.contains_xy(other.outline.buffer(board.thickness), p[:, :2])
            out += _segment(board, sheet, a, t, at[beside], "corner")
    return out + _segment(board, sheet, a, t, at[world[:, 2] < 0], "ground")


def _segment(board, sheet, a, t, at, origin) -> list[ConstraintSegment]:
    if len(at) < 8:
        return []
    ends = a + np.array([at.min() - 0.5, at.max() + 0.5])[:, None] * t
    xy = sheet.to_board(board.to_world(np.column_stack([ends, np.full(2, board.thickness / 2)])))[:, :2]
    return [ConstraintSegment(xy[0], xy[1], origin, 0.2)]


def on_sheet(board: TrueBoard, sheet: Sheet) -> Polygon:
    """The true outline on the rough board's plane."""
    return shapely.transform(board.outline, partial(in_rough, board, sheet, board.thickness / 2)).buffer(0)


def figures(true: Polygon, found) -> tuple[float, float, float]:
    """IoU, mean and 95th percentile of the boundary distances both ways."""
    if found.is_empty:
        return 0.0, np.nan, np.nan
    iou = true.intersection(found).area / true.union(found).area
    distances = np.concatenate([_distances(a, b) for a, b in ((true, found), (found, true))])
    return iou, float(distances.mean()), float(np.percentile(distances, 95))


def _distances(a, b) -> np.ndarray:
    rings = [r for p in getattr(a, "geoms", [a]) for r in (p.exterior, *p.interiors)]
    points = [LineString(r.coords).interpolate(np.arange(0, r.length, 1.0)) for r in rings]
    return shapely.distance(np.concatenate(points), b.boundary)


def polygon_of(result: BoardOutlines):
    """The union of a board's pieces."""
    return shapely.union_all([
        Polygon(o.loops[0].points, [loop.points for loop in o.loops[1:]]).buffer(0) for o in result.outlines
    ])


def in_rough(board: TrueBoard, sheet: Sheet, z: float, xy: np.ndarray) -> np.ndarray:
    """Points of the true board's frame at height z in the rough board's."""
    return sheet.to_board(board.to_world(np.column_stack([xy, np.full(len(xy), z)])))[:, :2]


def overlay(path: Path, capture: Capture, sheet: Sheet, result: BoardOutlines, true: TrueBoard) -> None:
    """Rectified photographs with the rough outline (blue), the found one (green) and the true one (red)."""
    import cv2

    from kerfwright.refine.segment.grid import grid_over
    from kerfwright.refine.segment.rectify import Photos, pixels_at, sample

    grid = grid_over(sheet.region, 26, 1.0, 400_000)
    tiles, photos = [], Photos()
    for view in [v for v in capture.views if v.name in result.views] or list(capture.views[:2]):
        z = sheet.thickness.value if sheet.to_board(view.centre[None])[0, 2] > 0 else 0.0
        xy = grid.centres().reshape(-1, 2)
        tile, _ = sample(photos, view, pixels_at(sheet, view, xy, z).reshape(*grid.shape, 2))
        tile = cv2.resize(tile[:, :, ::-1], None, fx=2, fy=2)
        back = shapely.transform(true.outline, partial(in_rough, true, sheet, z))
        for polygon, colour in ((sheet.region, (255, 120, 0)), (back, (0, 0, 255)), (polygon_of(result), (0, 255, 0))):
            for p in getattr(polygon, "geoms", [polygon]):
                for r in (p.exterior, *p.interiors):
                    index = (grid.to_index(np.asarray(r.coords)[:, :2]) + 0.5) * 2 * 16
                    cv2.polylines(tile, [index.astype(np.int32)], True, colour, 1, cv2.LINE_AA, 4)
        tiles.append(tile)
    width = tiles[0].shape[1]
    across = max(1, 1800 // width)
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % across)
    cv2.imwrite(str(path), np.vstack([np.hstack(tiles[i:i + across]) for i in range(0, len(tiles), across)]))


@dataclass(frozen=True, eq=False)
class Case:
    """What segmentation is given, and the true board of each sheet (None: there is none)."""

    name: str
    capture: Capture
    sheets: Sequence[Sheet]
    constraints: Sequence[Sequence[ConstraintSegment]]
    boards: list[TrueBoard | None]
    missing: tuple[str, ...] = ()
    free: FreeSpace | None = None
    unit: float = 1.0  # mm


def made_from_truth(name: str, options) -> Case:
    """Rough boards made from the truth."""
    capture, boards, _ = load(options.captures / name)
    rng = np.random.default_rng(options.seed)
    sheets = [rough_sheet(b, capture, options, rng) for b in boards]
    return Case(name, capture, sheets, [true_constraints(b, s, boards) for b, s in zip(boards, sheets, strict=True)],
                list(boards))


def from_pipeline(name: str, options) -> Case:
    """Rough boards as identify and assemble find them."""
    rough = rough_boards(options.captures / name, options.kept)
    pairs = match(rough)
    boards: list[TrueBoard | None] = [None] * len(rough.assembly.sheets)
    for i, j in pairs.items():
        t = rough.truth[i]
        boards[j] = TrueBoard(t.name, t.world_from_board, t.thickness.value, t.region)
    several = side_by_side(rough, pairs)
    for j, members in several.items():
        first = rough.truth[members[0]]
        outline = shapely.union_all([seen_on(rough.truth[i], first) for i in members]).buffer(GLUED).buffer(-GLUED)
        label = f"{first.name} +{len(members) - 1}"
        boards[j] = TrueBoard(label, first.world_from_board, first.thickness.value, outline)
    inside = {i for members in several.values() for i in members}
    missing = tuple(t.name for i, t in enumerate(rough.truth) if i not in pairs and i not in inside)
    return Case(name, rough.capture, rough.assembly.sheets, rough.assembly.constraints, boards, missing,
                free_space(rough), rough.unit)


def shown_whole(case: Case) -> list[bool]:
    """Whether some photograph shows all of a true board, the other true boards being in the way."""
    true = [b for b in case.boards if b is not None]
    sheets = [Sheet(b.name, b.world_from_board, Quantity(value=b.thickness), True, b.outline, *[np.zeros(0, int)] * 3)
              for b in true]
    occluders = Occluders(sheets, [list(shapely.get_parts(s.region)) for s in sheets])
    whole = {}
    for k, sheet in enumerate(sheets):
        inner = _inner_samples(sheet.region.buffer(-1))
        looks = [_look(sheet, k, v, i, inner, occluders) for i, v in enumerate(case.capture.views)]
        whole[sheet.name] = max([found[0].share for found in looks if found], default=0) > WHOLE
    return [b is not None and whole[b.name] for b in case.boards]


def run(name: str, options) -> list[tuple[float, ...]]:
    """One capture: its table on the terminal, its figures back."""
    case = from_pipeline(name, options) if options.pipeline else made_from_truth(name, options)
    start, busy = time.perf_counter(), time.process_time()
    chosen = SegmentOptions(max_views=options.views, use_images=not options.no_images, threads=options.threads)
    results = segment_boards(case.sheets, case.constraints, case.capture, chosen, case.free)
    seconds, busy = time.perf_counter() - start, time.process_time() - busy
    rows = []
    for board, sheet, result, whole in zip(case.boards, case.sheets, results, shown_whole(case), strict=True):
        if board is None:
            print(f"{name:14} {sheet.name:18} is no true board", flush=True)
            continue
        rows.append(row(case, board, sheet, result, whole))
        if options.overlays:
            options.overlays.mkdir(parents=True, exist_ok=True)
            overlay(options.overlays / f"{name}_{board.name}.png", case.capture, sheet, result, board)
    for lost in case.missing:
        print(f"{name:14} {lost:18} was not found", flush=True)
    peak, looks = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, sum(len(r.views) for r in results)
    print(f"{name:14} {seconds:.1f} s ({busy:.1f} s of processor, {busy / max(looks, 1):.2f} a board and view), "
          f"peak {peak:.2f} GiB, mean IoU {np.mean([r[0] for r in rows]):.4f} to {np.mean([r[3] for r in rows]):.4f}, "
          f"mean distance {np.mean([r[1] for r in rows]):.2f} to {np.mean([r[4] for r in rows]):.2f} mm", flush=True)
    return rows


def row(case: Case, board: TrueBoard, sheet: Sheet, result: BoardOutlines, whole: bool) -> tuple[float, ...]:
    """Figures of one board before and after, mm, printed."""
    own = on_sheet(board, sheet)
    unit = np.array([1, case.unit, case.unit])
    before, after = (unit * figures(own, found) for found in (sheet.region, polygon_of(result)))
    se = np.median(np.concatenate([loop.standard_error for o in result.outlines for loop in o.loops])) * case.unit
    print(f"{case.name:14} {board.name:18} {sheet.name:9} whole {whole:d} pieces {len(result.outlines)} "
          f"views {len(result.views)} out {len(result.left_out)} shift {result.registration:.2f} px {result.pixel:.2f} "
          f"before {before[0]:.3f} {before[1]:5.2f} {before[2]:5.2f} "
          f"after {after[0]:.3f} {after[1]:5.2f} {after[2]:5.2f} se {se:.2f} {result.fallback or ''}", flush=True)
    return (*before, *after, whole)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--captures", type=Path, default=CAPTURES)
    parser.add_argument("--pipeline", action="store_true", help="rough boards from identify and assemble")
    parser.add_argument("--kept", type=Path, help="folder of output folders whose first stages are taken")
    parser.add_argument("--rough", choices=("cloud", "blob"), default="cloud")
    parser.add_argument("--plane-mm", type=float, default=0.0)
    parser.add_argument("--plane-degrees", type=float, default=0.0)
    parser.add_argument("--views", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--no-images", action="store_true")
    parser.add_argument("--overlays", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    names = options.names or sorted(p.parent.name for p in options.captures.glob("*/truth"))
    rows = np.array([r for name in names for r in run(name, options)])
    whole = rows[rows[:, 6] > 0, 3]
    print(f"all {len(rows)} boards: before {np.nanmean(rows[:, :3], 0).round(3)} "
          f"after {np.nanmean(rows[:, 3:6], 0).round(3)}; under .95 {(rows[:, 3] < 0.95).sum()}; "
          f"shown whole {len(whole)}, under .95 {(whole < 0.95).sum()}, worst {whole.min(initial=1):.3f}")


if __name__ == "__main__":
    main()
