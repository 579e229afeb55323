"""Drilled holes, too small to be found as openings: circles that are darker inside in the photographs, where the cloud
has no points and the photographs disagree.

A small hole shows little but its own cut face in the shade. Its rim lies on the sheet plane, so that all photographs of
that side show it at one place; what is seen inside moves. A knot or a plug has the rim, but lies on the plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kerfwright.refine.segment.evidence import Seeds, grown
from kerfwright.refine.segment.grid import Grid

__all__ = ["drilled_holes", "drilled_seeds"]

BLUR = 0.8  # mm; of the edge filter
RADII = (3.0, 16.0)  # mm; larger holes are openings
STEPS = (1.2, 0.4, 0.15)  # mm of the search over centres and radii, finer and finer
MOST_SHIFT = 7.0  # mm between a hole's middle and that of what was found of it
ANGLES = 36
STEEP = 1.0  # LAB lightness a mm: a rim is at least as steep
CAP = 6.0  # LAB lightness a mm that counts at most: one strong edge is no circle
EVEN = 0.4  # of the usual step on the circle: at the corners of a square there is none
ROUND = 0.85  # share of the circle with a steep step up outwards
EMPTY = 0.25  # of the density of points about it
UNLIKE = 3.0  # times the disagreement about it
LEAST_UNLIKE = 2.0  # LAB units squared
ABOUT = (2.0, 6.0)  # mm beyond the rim: wood to compare with
SPREAD = 2.0  # mm; standard deviation over which points are counted
KNOWN = 0.8  # of the disc that the photographs must show
LEAST_VIEWS = 3
EXACT = 1.0  # mm that a circle may be off
WOOD = 4.0  # mm about a hole that are wood


def drilled_holes(
    labs: Sequence[np.ndarray], seen: Sequence[np.ndarray], sides: Sequence[int], apart: np.ndarray, mask: np.ndarray,
    face: np.ndarray, grid: Grid,
) -> np.ndarray:
    """Pixels of the drilled holes inside `mask`, (rows, cols) bool.

    labs, seen, sides : one a photograph; apart : their disagreement, LAB units squared; face : (N, 2) points of the
    cloud on the sheet faces, mm.
    """
    from scipy.ndimage import binary_fill_holes

    found = np.zeros(mask.shape, bool)
    counts = _counts(face, grid)
    whole = binary_fill_holes(mask)
    starts = _starts(apart, counts, whole, grid.pixel)
    if not len(starts):
        return found
    for side in sorted(set(sides)):
        own = [(lab[..., 0], m) for lab, m, s in zip(labs, seen, sides, strict=True) if s == side]
        if len(own) >= LEAST_VIEWS:
            slopes = _slopes(own, grid.pixel)
            for start in starts:
                disc = _disc(start, slopes, apart, counts, whole, grid)
                found = found if disc is None else found | disc
    return found


def _counts(face: np.ndarray, grid: Grid) -> np.ndarray:
    """Points of the cloud a pixel."""
    counts = np.zeros(grid.shape)
    if len(face):
        at = np.floor(grid.to_index(face) + 0.5).astype(int)
        inside = ((at >= 0) & (at < grid.shape[::-1])).all(axis=1)
        np.add.at(counts, (at[inside, 1], at[inside, 0]), 1)
    return counts


def _starts(apart: np.ndarray, counts: np.ndarray, whole: np.ndarray, pixel: float) -> np.ndarray:
    """(N, 2) column and row: middles of places of a hole's size where photographs disagree and the cloud is empty."""
    from scipy.ndimage import center_of_mass, gaussian_filter, label

    inner = grown(whole, -RADII[0], pixel)
    known = np.isfinite(apart)
    if not (inner & known).any():
        return np.zeros((0, 2))
    density = gaussian_filter(counts, SPREAD / pixel)
    calm = float(np.median(apart[inner & known]))
    unlike = gaussian_filter(np.where(known, apart, 0), BLUR / pixel) > max(UNLIKE * calm, LEAST_UNLIKE)
    labels, count = label(unlike & (density < EMPTY * float(np.median(density[inner]))) & inner)
    least, most = (np.pi * (r / pixel) ** 2 for r in (RADII[0] / 2, RADII[1]))
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    fits = [k + 1 for k in range(count) if least <= sizes[k] <= most]
    middles = [(c, r) for r, c in center_of_mass(labels > 0, labels, fits)]
    return np.array(middles).reshape(-1, 2)


def _slopes(own: Sequence[tuple[np.ndarray, np.ndarray]], pixel: float) -> np.ndarray:
    """(rows, cols, 2) slope of the lightness averaged over one side's photographs, LAB units a mm, along x and y."""
    from scipy.ndimage import gaussian_filter

    total = sum(np.where(m, light, 0) for light, m in own)
    mean = total / np.maximum(sum(m.astype(np.float32) for _, m in own), 1)
    blur = BLUR / pixel
    return np.stack([gaussian_filter(mean, blur, order=(0, 1)), gaussian_filter(mean, blur, order=(1, 0))], -1) / pixel


def _disc(
    start: np.ndarray, slopes: np.ndarray, apart: np.ndarray, counts: np.ndarray, whole: np.ndarray, grid: Grid
) -> np.ndarray | None:
    """The hole about a start; None when there is no circle or what it holds is wood."""
    centre, radius, share = _circle(start, slopes, grid.pixel)
    if share < ROUND:
        return None
    rows, columns = np.indices(grid.shape)
    away = np.hypot(columns - centre[0], rows - centre[1]) * grid.pixel
    disc, core = away < radius, away < max(radius - 1.5, 0.5 * radius)
    ring = (away > radius + ABOUT[0]) & (away < radius + ABOUT[1])
    known = np.isfinite(apart)
    if (ring & ~whole).any() or (known & core).sum() < KNOWN * core.sum() or not (known & ring).any():
        return None
    apart_in, apart_out = float(np.median(apart[known & core])), float(np.median(apart[known & ring]))
    density_in, density_out = counts[core].mean(), counts[ring].mean()
    unlike = apart_in > max(UNLIKE * apart_out, LEAST_UNLIKE)
    return disc if unlike and density_in < EMPTY * density_out else None


def _circle(start: np.ndarray, slopes: np.ndarray, pixel: float) -> tuple[np.ndarray, float, float]:
    """Centre (column, row), radius in mm, and the share of its rim that is darker inside, of the best circle."""
    angle = np.arange(ANGLES) * 2 * np.pi / ANGLES
    outward = np.stack([np.cos(angle), np.sin(angle)], 1)
    best, centre, radius = -np.inf, np.asarray(start, float), sum(RADII) / 2
    reach = np.array([MOST_SHIFT, (RADII[1] - RADII[0]) / 2])
    for step in STEPS:
        by = np.arange(-reach[0], reach[0] + step / 2, step) / pixel
        middles = centre + np.stack(np.meshgrid(by, by), -1).reshape(-1, 2)
        for r in np.arange(radius - reach[1], radius + reach[1] + step / 2, step):
            steps = _steps_out(middles, r / pixel, outward, slopes)
            score = np.clip(steps, 0, CAP).mean(axis=1) - CAP * (steps < STEEP).mean(axis=1)
            k = int(np.argmax(score))
            if score[k] > best:
                best, centre, radius = float(score[k]), middles[k], float(r)
        reach = np.array([step, step])
    steps = _steps_out(centre[None], radius / pixel, outward, slopes)
    return centre, radius, float((steps >= max(STEEP, EVEN * float(np.median(steps)))).mean())


def _steps_out(centres: np.ndarray, radius: float, outward: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """(C, ANGLES) slope outwards on circles; beyond the raster none."""
    at = np.rint(centres[:, None] + radius * outward).astype(int)
    inside = ((at >= 0) & (at < slopes.shape[1::-1])).all(axis=-1)
    at = np.where(inside[..., None], at, 0)
    return np.where(inside, np.einsum("cak,ak->ca", slopes[at[..., 1], at[..., 0]], outward), 0.0)


def drilled_seeds(seeds: Seeds, drilled: np.ndarray, pixel: float) -> Seeds:
    """The seeds with drilled holes: outside, and wood about them, but for a seam at their rims."""
    if not drilled.any():
        return seeds
    core, rim, wood = (grown(drilled, by, pixel) for by in (-EXACT, EXACT, WOOD))
    inside = (seeds.inside | wood & ~seeds.outside) & ~rim
    return replace(seeds, inside=inside, outside=seeds.outside | core, beyond=seeds.beyond | core)
