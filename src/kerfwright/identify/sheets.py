"""From chosen candidates to rough boards: pieces joined, outlines moved onto the cut faces, evidence collected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.rims import trace_rim
from kerfwright.identify.slabs import Slab, footprint
from kerfwright.identify.types import Neighbourhood, Sheet
from kerfwright.model import Origin, Quantity

__all__ = ["join_across", "to_sheet"]


def join_across(slabs: list[Slab], reach: float) -> list[Slab]:
    """Join coplanar pieces that another board's end covers the gap between: that board stops here, this one runs
    through.

    reach: how uncertain an outline is, mm. Where the other board goes on beyond the plane, it is the one that runs
    through.
    """
    slabs = list(slabs)
    while True:
        pairs = [(i, j) for i in range(len(slabs)) for j in range(i + 1, len(slabs))]
        joined = ((i, j, _joined(slabs[i], slabs[j], _but(slabs, i, j), reach)) for i, j in pairs)
        found = next((entry for entry in joined if entry[2] is not None), None)
        if found is None:
            return slabs
        slabs = [*_but(slabs, found[0], found[1]), found[2]]


def _but(slabs: list[Slab], *left_out: int) -> list[Slab]:
    return [s for k, s in enumerate(slabs) if k not in left_out]


def _joined(a: Slab, b: Slab, others: list[Slab], reach: float) -> Slab | None:
    if a.normal @ b.normal < 0.999:
        return None
    rings = np.asarray(b.region.exterior.coords)
    moved = a.to_board(b.to_world(np.c_[rings, np.full(len(rings), b.thickness.value)]))
    if abs(np.median(moved[:, 2]) - a.thickness.value) > reach / 2:
        return None
    other_region = Polygon(moved[:, :2]).buffer(0)
    gap = a.region.distance(other_region)
    for crossing in others:
        widest = 1.5 * crossing.thickness.value / _sine(crossing, a) + 2 * reach
        if abs(crossing.normal @ a.normal) > 0.9 or gap > widest:
            continue
        if not _stops_at(crossing, a, reach):
            continue
        bridge = _bridge(a.region, other_region, gap)
        cover = footprint(crossing, _thickened(a, reach)).buffer(reach)
        if bridge.area and bridge.intersection(cover).area > 0.7 * bridge.area:
            whole = shapely.union_all([a.region, other_region, bridge]).buffer(0.01)
            whole = max(getattr(whole, "geoms", [whole]), key=lambda p: p.area)
            best = min((a, b), key=lambda s: (s.thickness.standard_error, -s.region.area))
            return replace(a, region=whole, thickness=best.thickness, top=a.top + b.top, bottom=a.bottom + b.bottom)
    return None


def _sine(a: Slab, b: Slab) -> float:
    return float(np.sqrt(max(1 - (a.normal @ b.normal) ** 2, 1e-3)))


def _stops_at(crossing: Slab, slab: Slab, reach: float) -> bool:
    """Whether the crossing board lies on one side of the slab only."""
    rings = np.asarray(crossing.region.exterior.coords)
    corners = np.concatenate([np.c_[rings, np.full(len(rings), h)] for h in (0.0, crossing.thickness.value)])
    z = slab.to_board(crossing.to_world(corners))[:, 2]
    return min(z.max() - slab.thickness.value, -z.min()) < 1.5 * reach


def _thickened(slab: Slab, reach: float) -> Slab:
    """The slab with its sheet planes moved out, so that a board that only touches it has a section in it.

    A section is taken a quarter of the thickness inside: that must be outside the true slab by half the reach.
    """
    thickness = slab.thickness.value
    margin = max(2 * reach, thickness / 2 + reach)
    board = slab.world_from_board.copy()
    board[:3, 3] -= margin * slab.normal
    return replace(slab, world_from_board=board, thickness=replace(slab.thickness, value=thickness + 2 * margin))


def _bridge(a: Polygon, b: Polygon, gap: float) -> Polygon:
    """The gap between two facing edges."""
    near_a = a.intersection(b.buffer(gap + 1, join_style="mitre"))
    near_b = b.intersection(a.buffer(gap + 1, join_style="mitre"))
    return shapely.union_all([near_a, near_b]).convex_hull.difference(shapely.union_all([a, b]))


def to_sheet(name: str, slab: Slab, cloud: Cloud, around: Neighbourhood, options: IdentifyOptions) -> Sheet:
    """A rough board with its cloud points; its region is moved onto the cut faces that the cloud shows."""
    thickness = slab.thickness.value
    top_frame = slab.world_from_board.copy()
    top_frame[:3, 3] += thickness * slab.normal
    fringe = max(4 * around.spacing, cloud.diameter / 60)
    rim = trace_rim(top_frame, slab.region, cloud, around, thickness, spacing=cloud.diameter / 400, width=fringe)
    rings = [rim.places[rim.ring == k] for k in range(int(rim.ring.max()) + 1)]
    region = _polygon(rings, slab.region)
    top, bottom, cut = _evidence(slab, region, cloud, around)
    seen = slab.thickness.evidence not in ("inferred", "twin")
    return Sheet(name, slab.world_from_board, _quantity(slab), seen, region, top, bottom, cut)


def _polygon(rings: list[np.ndarray], rough: Polygon) -> Polygon:
    """Rings to a valid polygon; the rough region where moving the outline made nothing of it."""
    moved = Polygon(rings[0], [r for r in rings[1:] if len(r) > 2]).buffer(0)
    moved = max(getattr(moved, "geoms", [moved]), key=lambda p: p.area)
    return moved if moved.area > 0.5 * rough.area else rough


def _quantity(slab: Slab) -> Quantity:
    origin = {"inferred": Origin.INFERRED, "twin": Origin.SHARED, "ground": Origin.IMPLIED}.get(
        slab.thickness.evidence, Origin.MEASURED
    )
    return Quantity(value=slab.thickness.value, standard_error=slab.thickness.standard_error, origin=origin)


def _evidence(
    slab: Slab, region: Polygon, cloud: Cloud, around: Neighbourhood
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Indices of cloud points on the top, the bottom and the cut faces."""
    tolerance = max(5 * around.noise, cloud.diameter / 500)
    x, thickness = slab.to_board(cloud.points), slab.thickness.value
    near = np.flatnonzero((x[:, 2] > -tolerance) & (x[:, 2] < thickness + tolerance))
    near = near[shapely.contains_xy(region.buffer(2 * tolerance), x[near, 0], x[near, 1])]
    z, nz = x[near, 2], around.normals[near] @ slab.normal
    top = near[(np.abs(z - thickness) < tolerance) & (nz > 0.8)]
    bottom = near[(np.abs(z) < tolerance) & (nz < -0.8)]
    side = near[np.abs(nz) < 0.6]
    shapely.prepare(boundary := region.boundary)
    rim = shapely.dwithin(boundary, shapely.points(x[side, :2]), 2 * tolerance)
    return top, bottom, side[rim]
