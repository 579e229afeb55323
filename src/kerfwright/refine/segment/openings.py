"""Openings that the cloud closed: stereo spans hand holes, and what the rough outline calls wood is never asked.

Wood keeps its colour from view to view, with its knots and its shadows, for all of it lies on the sheet plane. Through
a hole every photograph shows something else. An opening is a place inside a board where most views disagree, with wood
all round on which they agree, of another colour in most of them, and where the cloud has few points on the sheet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kerfwright.refine.segment._pixels import disagreement_of
from kerfwright.refine.segment.evidence import Seeds, grown
from kerfwright.refine.segment.grid import Grid

__all__ = ["disagreement", "open_seeds", "openings"]

UNUSUAL = 9.0  # times the disagreement usual on the board, squared colours
LEAST_UNUSUAL = 40.0  # LAB units squared: less than a visible difference is none
ROUGHNESS = 3.0  # mm; openings have no gaps and no necks narrower than twice this
LEAST_AREA = 200.0  # mm2
RIM = (3.0, 9.0)  # mm about an opening in which all must be wood
QUIET = 0.85  # share of the rim on which the views agree
OTHER_COLOUR = 6.0  # LAB units between opening and rim
OTHER_SHARE = 0.5  # share of the opening that differs so in a view that counts for it
VIEWS_FOR = 0.6  # share of the views that see it
LEAST_VIEWS = 3
THIN = 0.6  # of the rim's density of points on the sheet
CORE = 2.0  # mm within which an opening's edge is left to the cut
AROUND = 10.0


def disagreement(labs: Sequence[np.ndarray], seen: Sequence[np.ndarray], sides: Sequence[int]) -> np.ndarray:
    """(rows, cols) variance of a pixel's colour over the views of a side, the most deviant view left out.

    LAB units squared; NaN where fewer than three views of one side see it.
    """
    return disagreement_of(np.asarray(labs, np.float32), np.asarray(seen), np.asarray(sides), LEAST_VIEWS)


def openings(
    labs: Sequence[np.ndarray], seen: Sequence[np.ndarray], apart: np.ndarray, mask: np.ndarray,
    face: np.ndarray, grid: Grid, error: float,
) -> np.ndarray:
    """Pixels of the openings inside `mask`, (rows, cols) bool.

    apart : the disagreement of the photographs, LAB units squared; face : (N, 2) points of the cloud on the sheet
    faces, mm; error : mm that the mask's outline may be off.
    """
    from scipy.ndimage import binary_fill_holes

    none = np.zeros(mask.shape, bool)
    whole = binary_fill_holes(mask)
    known = np.isfinite(apart)
    inner = grown(whole, -error, grid.pixel)
    if not (known & inner).any():
        return none
    limit = max(UNUSUAL * float(np.median(apart[known & inner])), LEAST_UNUSUAL)
    unlike = np.where(known, apart, 0) > limit
    found = none.copy()
    for piece in _pieces(unlike & inner, grid.pixel):
        large = piece.sum() * grid.pixel**2 >= LEAST_AREA
        if large and _is_opening(piece, unlike, known, whole, labs, seen, face, grid):
            found |= piece
    return found


def _pieces(mask: np.ndarray, pixel: float) -> list[np.ndarray]:
    """Connected pieces, smoothed, their own holes filled."""
    from scipy.ndimage import binary_fill_holes, label

    smooth = mask
    for by in (ROUGHNESS, -2 * ROUGHNESS, ROUGHNESS):
        smooth = grown(smooth, by, pixel)
    labels, count = label(smooth)
    return [binary_fill_holes(labels == k + 1) for k in range(count)]


def _is_opening(piece, unlike, known, whole, labs, seen, face, grid: Grid) -> bool:
    """Whether wood lies all round, most views show another colour inside, and the cloud is thin there."""
    near, far = (grown(piece, by, grid.pixel) for by in RIM)
    if (far & ~whole).any():
        return False
    rim = far & ~near
    if (rim & known & ~unlike).sum() < QUIET * rim.sum():
        return False
    return _differs(piece, rim, labs, seen) and _is_thin(piece, rim, face, grid)


def _differs(piece: np.ndarray, rim: np.ndarray, labs, seen) -> bool:
    told = []
    for lab, shown in zip(labs, seen, strict=True):
        own, wood = shown & piece, shown & rim
        if own.sum() > OTHER_SHARE * piece.sum() and wood.sum() > OTHER_SHARE * rim.sum():
            step = np.linalg.norm(lab[own] - np.median(lab[wood], axis=0), axis=1)
            told.append((step > OTHER_COLOUR).mean() > OTHER_SHARE)
    return len(told) >= LEAST_VIEWS and float(np.mean(told)) >= VIEWS_FOR


def _is_thin(piece: np.ndarray, rim: np.ndarray, face: np.ndarray, grid: Grid) -> bool:
    counts = [grid.lookup(m, face, False).sum() if len(face) else 0 for m in (piece, rim)]
    return counts[0] / piece.sum() < THIN * max(counts[1] / rim.sum(), 1e-9)


def open_seeds(seeds: Seeds, opened: np.ndarray, pixel: float) -> Seeds:
    """The seeds with openings: outside but for a seam about their edges, which is for the cut to say."""
    if not opened.any():
        return seeds
    core, around = grown(opened, -CORE, pixel), grown(opened, AROUND, pixel)
    belief = np.where(around, 0, seeds.belief).astype(np.float32)
    return replace(seeds, inside=seeds.inside & ~around, outside=seeds.outside | core, beyond=seeds.beyond | core,
                   belief=belief)
