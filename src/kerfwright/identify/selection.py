"""Which candidates are the boards: an exact 0-1 program (paper, Part Selection, where it is simulated annealing).

Maximise the share of the observed surface that the chosen boards explain, less a cost a board, so that no board shares
more than half of its volume with the union of the others. A place explained by a sheet plane counts fully, one
explained by a cut face a little less: of two ways to cut the same block out of sheet stock the thinner stock wins. The
union rule is added as cuts where a solution breaks it; pairwise constraints alone are not the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

from kerfwright.capture.types import Cloud
from kerfwright.errors import StageError
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.slabs import UNSEEN, Slab
from kerfwright.identify.types import Neighbourhood

__all__ = ["Evidence", "Selection", "explained_share", "gather_evidence", "program_value", "select_exact"]

CUT_SHARE = 0.95  # worth of a place explained by a cut face, against 1 for a sheet plane
BULKY = 0.5  # extra cost of a board whose cut surface reaches the most the five-times rule allows
GUESSED = 0.5  # extra cost of a board whose thickness nothing shows
SEEN_THROUGH = 2.0  # cost of see-through interior, in shares of the board's own surface


@dataclass(frozen=True, eq=False)
class Evidence:
    """What each candidate explains: (C, S) bool arrays over surface samples, and how volumes overlap."""

    places: np.ndarray  # (S, 3) world
    by_sheet: np.ndarray
    by_cut: np.ndarray
    cost: np.ndarray  # (C,) in shares of the observed surface
    interior: tuple[np.ndarray, ...]  # per candidate: (M, C) bool, which candidates hold each of its interior samples

    def overlap(self, a: int, others: list[int]) -> float:
        """Share of a's volume inside the union of others."""
        return float(self.interior[a][:, others].any(axis=1).mean()) if others and len(self.interior[a]) else 0.0

    def broken(self, chosen: list[int]) -> list[int]:
        """Those of a set that have more than half of their volume in the union of the others."""
        return [k for k in chosen if self.overlap(k, [o for o in chosen if o != k]) > 0.5]


@dataclass(frozen=True)
class Selection:
    """Chosen candidates with the exact program's objective and proven bound; annealing proves none, but has energies.
    """

    chosen: tuple[int, ...]
    objective: float
    bound: float | None
    explained: float  # share of the observed surface
    method: str = "exact"
    energy: dict[str, float] | None = None  # squared distance of cloud and boards in D: total and mean over the points


def gather_evidence(cloud: Cloud, around: Neighbourhood, slabs: list[Slab], options: IdentifyOptions) -> Evidence:
    """Sample the surface evenly and ask every candidate what it explains."""
    idx = _even_samples(cloud.points, options.sample_voxel * cloud.diameter)
    places, normals = cloud.points[idx], around.normals[idx]
    tolerance = max(4 * around.noise, cloud.diameter / 200)
    pairs = [_explains(slab, places, normals, tolerance) for slab in slabs]
    by_sheet, by_cut = (np.array(side).reshape(len(slabs), len(idx)) for side in zip(*pairs, strict=True))
    interior = tuple(_held_by(slab, slabs) for slab in slabs)
    cost = np.array([_cost(slab, own, options) for slab, own in zip(slabs, by_sheet, strict=True)])
    return Evidence(places, by_sheet, by_cut, cost, interior)


def _even_samples(points: np.ndarray, voxel: float) -> np.ndarray:
    """Index of one point a voxel, so that every part of the surface counts by its area."""
    key = np.floor((points - points.min(axis=0)) / voxel).astype(np.int64)
    flat = (key[:, 0] * (key[:, 1].max() + 1) + key[:, 1]) * (key[:, 2].max() + 1) + key[:, 2]
    return np.sort(np.unique(flat, return_index=True)[1])


def _explains(slab: Slab, places: np.ndarray, normals: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Which places lie on the slab's sheet planes, and which on its cut faces."""
    x, n = slab.to_board(places), normals @ slab.world_from_board[:3, :3]
    thickness = slab.thickness.value
    slack = min(max(tolerance, 2 * slab.thickness.standard_error), 0.5 * thickness)
    near = (x[:, 2] > -slack) & (x[:, 2] < thickness + tolerance)
    sheet, cut = np.zeros(len(x), bool), np.zeros(len(x), bool)
    idx = np.flatnonzero(near)
    inside = shapely.contains_xy(slab.region.buffer(tolerance), x[idx, 0], x[idx, 1])
    idx = idx[inside]
    z, nz = x[idx, 2], n[idx, 2]
    sheet[idx] = ((np.abs(z - thickness) < tolerance) & (nz > 0.7)) | ((np.abs(z) < slack) & (nz < -0.7))
    side = idx[np.abs(nz) < 0.8]
    if len(side):
        shapely.prepare(boundary := slab.region.boundary)
        rim = shapely.dwithin(boundary, shapely.points(x[side, :2]), 2.5 * tolerance)
        cut[side[rim]] = True
    return sheet, cut & ~sheet


def _held_by(slab: Slab, slabs: list[Slab], count: int = 800) -> np.ndarray:
    """(M, C) which candidates hold each interior sample of the slab."""
    step = np.sqrt(slab.region.area / (count / 4))
    low_x, low_y, high_x, high_y = slab.region.bounds
    grid = np.meshgrid(np.arange(low_x + step / 2, high_x, step), np.arange(low_y + step / 2, high_y, step))
    x, y = (g.ravel() for g in grid)
    inside = shapely.contains_xy(slab.region, x, y)
    flat = np.stack([x, y], axis=1)[inside]
    heights = slab.thickness.value * np.array([0.125, 0.375, 0.625, 0.875])
    places = slab.to_world(np.concatenate([np.c_[flat, np.full(len(flat), z)] for z in heights]))
    held = np.zeros((len(places), len(slabs)), bool)
    for k, other in enumerate(slabs):
        p = other.to_board(places)
        deep = (p[:, 2] > 0) & (p[:, 2] < other.thickness.value)
        held[deep, k] = shapely.contains_xy(other.region, p[deep, 0], p[deep, 1])
    return held


def _cost(slab: Slab, by_sheet: np.ndarray, options: IdentifyOptions) -> float:
    bulk = BULKY * min(slab.cut_ratio / options.cut_area_ratio, 1.0)
    unseen = GUESSED if slab.thickness.evidence in UNSEEN else 0.0
    return options.board_cost * (1 + bulk + unseen) + SEEN_THROUGH * slab.free_share * float(by_sheet.mean())


def select_exact(evidence: Evidence, options: IdentifyOptions) -> Selection:
    """The best set of candidates; raises StageError when the solver finds none."""
    count = len(evidence.cost)
    sheet_rows, sheet_weight = _signatures(evidence.by_sheet)
    any_rows, any_weight = _signatures(evidence.by_sheet | evidence.by_cut)
    value = np.r_[-evidence.cost, (1 - CUT_SHARE) * sheet_weight, CUT_SHARE * any_weight]
    cover = _cover_matrix([sheet_rows, any_rows], count)
    constraints = [LinearConstraint(cover, -np.inf, 0)]
    constraints += [_at_most(pair, 1, len(value)) for pair in _conflicts(evidence)]
    integrality = np.r_[np.ones(count), np.zeros(len(value) - count)]
    while True:
        answer = milp(-value, integrality=integrality, bounds=Bounds(0, 1), constraints=constraints,
                      options={"node_limit": options.solver_nodes, "mip_rel_gap": 0})
        if answer.x is None:
            raise StageError(f"selection: solver: {answer.message}: report this with the capture")
        chosen = [k for k in range(count) if answer.x[k] > 0.5]
        broken = evidence.broken(chosen)
        if not broken:
            break
        for k in broken:
            holders = [o for o in chosen if o == k or evidence.interior[k][:, o].any()]
            constraints.append(_at_most(holders, len(holders) - 1, len(value)))
    explained = explained_share(evidence, chosen)
    return Selection(tuple(chosen), float(-answer.fun), float(-answer.mip_dual_bound), explained)


def explained_share(evidence: Evidence, chosen: list[int]) -> float:
    """Share of the surface that a set of candidates explains."""
    return float((evidence.by_sheet | evidence.by_cut)[chosen].any(axis=0).mean()) if chosen else 0.0


def program_value(evidence: Evidence, chosen: list[int]) -> float:
    """The exact program's objective at a set of candidates."""
    sheet = float(evidence.by_sheet[chosen].any(axis=0).mean()) if chosen else 0.0
    explained = explained_share(evidence, chosen)
    return (1 - CUT_SHARE) * sheet + CUT_SHARE * explained - float(evidence.cost[chosen].sum())


def _signatures(explained: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distinct columns of (C, S) with the share of samples that have them; columns nobody explains are left out."""
    columns, count = np.unique(explained.T, axis=0, return_counts=True)
    some = columns.any(axis=1)
    return columns[some], count[some] / explained.shape[1]


def _cover_matrix(groups: list[np.ndarray], count: int) -> coo_array:
    """Rows y_s - sum of x over its explainers <= 0."""
    rows, columns, data, start = [], [], [], 0
    for group in groups:
        s, c = np.nonzero(group)
        rows += [s + start, np.arange(len(group)) + start]
        columns += [c, np.arange(len(group)) + count + start]
        data += [-np.ones(len(s)), np.ones(len(group))]
        start += len(group)
    return coo_array(
        (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))), shape=(start, count + start)
    )


def _conflicts(evidence: Evidence) -> list[list[int]]:
    count = len(evidence.cost)
    return [
        [a, b] for a in range(count) for b in range(a + 1, count)
        if evidence.overlap(a, [b]) > 0.5 or evidence.overlap(b, [a]) > 0.5
    ]


def _at_most(members: list[int], most: int, width: int) -> LinearConstraint:
    row = np.zeros((1, width))
    row[0, members] = 1
    return LinearConstraint(row, -np.inf, most)
