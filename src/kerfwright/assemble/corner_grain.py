"""Which way the grain runs in the corners of a frame.

Boards are long along their grain, so that the two members of a corner show grain across each other, whatever their
tone. In the corner itself the grain changes along the seam: along the diagonal of a mitre, or not at all before the end
of the member that runs through. A frame sawn out of one panel has the same grain all round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.ndimage import gaussian_filter
from shapely.geometry import Polygon

from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles

__all__ = ["grain_kind"]

STEP = 1 / 1000  # of D, between samples
BLUR = 1.0  # samples
BLOCK = 10  # samples a side of a block in which a direction is told
MEMBER = 1.5  # corner widths along a member that show its own grain
RIM = 1 / 150  # of D, along outlines, whose eased edges have a direction of their own
VIEWS = 8
LEAST_VIEWS = 3
FACING = 0.4  # cosine
LEAST_BLOCKS = 6  # of a region
APART = 1.5  # standard deviations of blocks between the grain of the two members
SURE = 2.5  # standard errors by which a half of the corner must have the one or the other


@dataclass(frozen=True, eq=False)
class _Grain:
    """Blocks of a face with what they show: middles (N, 2), and (N,) from -1 to 1, grain along `after` or `before`."""

    middles: np.ndarray
    along: np.ndarray

    def inside(self, region: Polygon) -> np.ndarray:
        """Of the blocks in a region."""
        return self.along[shapely.contains_xy(region, self.middles[:, 0], self.middles[:, 1])]


def grain_kind(
    sheet: Sheet, inner: np.ndarray, ends: dict[str, np.ndarray], photos: Photos, obstacles: Obstacles, diameter: float
) -> str | None:
    """Where the seam of a corner runs, by the grain: "mitre", "before" or "after", as `rings.RingCorner` names them;
    None where it does not tell.
    """
    if set(ends) != {"mitre", "before", "after"}:
        return None
    quad = [inner, ends["before"], ends["mitre"], ends["after"]]
    ways = {kind: (ends[kind] - inner) / np.linalg.norm(ends[kind] - inner) for kind in ("before", "after")}
    for face in ("top", "bottom"):
        grain = _grain(sheet, face, quad, ways, photos, obstacles, diameter)
        kind = None if grain is None else _kind(grain, quad, ways)
        if kind is not None:
            return kind
    return None


def _kind(grain: _Grain, quad: list[np.ndarray], ways: dict[str, np.ndarray]) -> str | None:
    inner, before, outer, after = quad
    width = max(np.linalg.norm(before - inner), np.linalg.norm(after - inner))
    members = []  # the boards on either side of the corner, beyond its own square
    for end, kind in ((after, "before"), (before, "after")):
        way = MEMBER * width * ways[kind]
        members.append(grain.inside(Polygon([inner, end, end - way, inner - way])))
    halves = [grain.inside(Polygon(p)) for p in ([inner, outer, after], [inner, before, outer])]
    if min(map(len, (*members, *halves))) < LEAST_BLOCKS:
        return None
    one, other = (float(np.median(m)) for m in members)
    spread = max(float(np.mean([1.4826 * np.median(np.abs(m - np.median(m))) for m in members])), 1e-3)
    if one - other < APART * spread:
        return None
    told = []
    for half in halves:
        off = float(np.mean(half)) - (one + other) / 2
        if abs(off) < SURE * spread / np.sqrt(len(half)):
            return None
        told.append(off > 0)
    return {(True, False): "mitre", (True, True): "before", (False, False): "after"}.get(tuple(told))


def _grain(
    sheet: Sheet, face: str, quad: list[np.ndarray], ways: dict[str, np.ndarray], photos: Photos,
    obstacles: Obstacles, diameter: float,
) -> _Grain | None:
    """Directions of grain about a corner, on the mean of the photographs that show it best."""
    step = STEP * diameter
    corners = np.array(quad)
    reach = MEMBER * max(np.linalg.norm(corners[k] - corners[0]) for k in (1, 3))
    low, high = corners.min(axis=0) - reach, corners.max(axis=0) + reach
    xy = np.stack(np.meshgrid(np.arange(low[0], high[0], step), np.arange(low[1], high[1], step)), axis=-1)
    flat = xy.reshape(-1, 2)
    level = sheet.thickness.value if face == "top" else 0.0
    world = sheet.to_world(np.c_[flat, np.full(len(flat), level)])
    tone = _tone(sheet, face, world, photos, obstacles, xy.shape[:2])
    if tone is None or not np.isfinite(tone).any():
        return None
    wood = shapely.contains_xy(sheet.region.buffer(-RIM * diameter), flat[:, 0], flat[:, 1]).reshape(xy.shape[:2])
    slope = np.gradient(gaussian_filter(np.nan_to_num(tone, nan=float(np.nanmedian(tone))), BLUR))
    across = {k: (slope[1] * -way[1] + slope[0] * way[0]) ** 2 for k, way in ways.items()}
    known = wood & np.isfinite(tone)
    sums = [_blocks(np.where(known, a, 0.0)) for a in (across["before"], across["after"])]
    whole = _blocks(known.astype(float)) > 0.8 * BLOCK**2
    middles = np.stack([_blocks(xy[..., k]) / BLOCK**2 for k in (0, 1)], axis=-1)
    along = (sums[0] - sums[1]) / np.maximum(sums[0] + sums[1], 1e-12)
    return _Grain(middles[whole], along[whole])


def _blocks(values: np.ndarray) -> np.ndarray:
    """Sums over blocks; what is left at the end is cut off."""
    rows, cols = (n // BLOCK for n in values.shape)
    return values[: rows * BLOCK, : cols * BLOCK].reshape(rows, BLOCK, cols, BLOCK).sum(axis=(1, 3))


def _tone(
    sheet: Sheet, face: str, world: np.ndarray, photos: Photos, obstacles: Obstacles, shape: tuple[int, int]
) -> np.ndarray | None:
    """Mean logarithm of brightness over the views that look at a face most squarely; NaN where fewer than half of them
    see it. None where few look.
    """
    outward = sheet.normal if face == "top" else -sheet.normal
    ray = np.array([view.centre for view in photos.views]).reshape(-1, 3) - world.mean(axis=0)
    cosine = ray @ outward / np.linalg.norm(ray, axis=1)
    picked = [int(k) for k in np.argsort(-cosine, kind="stable")[:VIEWS] if cosine[k] > FACING]
    if len(picked) < LEAST_VIEWS:
        return None
    seen = obstacles.visible([photos.views[k] for k in picked], world, outward, FACING / 2)
    tones = []
    for k, shown in zip(picked, seen, strict=True):
        grey = photos.colours(k, world).mean(axis=1)
        grey = np.where(shown, np.log(np.maximum(grey, 2.0)), np.nan)
        tones.append(grey - np.nanmedian(grey) if np.isfinite(grey).any() else grey)
    told = np.isfinite(tones)
    count = told.sum(axis=0)
    mean = np.where(told, tones, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.where(count * 2 >= len(picked), mean, np.nan).reshape(shape)
