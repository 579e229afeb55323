"""Holes that are none: gaps of the cloud in smooth wood, through which stereo seems to have seen.

Wood shows the same colour in every photograph, for all of it lies on the sheet plane, and much the same as the wood
round it. A hole in which the photographs agree so is filled; so is one that nearly all of them show in the very colour
of its rim, where a shadow or a glint in the others spoils the agreement.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kerfwright.refine.segment.evidence import grown

__all__ = ["without_false_holes"]

CORE = 2.0  # mm that a hole's edge may be off
RIM = (3.0, 9.0)  # mm about a hole: wood to compare it with
AGREED = 3.0  # times the board's usual disagreement, squared colours
LEAST_AGREED = 4.0  # LAB units squared: less is noise; real holes have 10 and more
ALIKE = 8.0  # LAB units between hole and rim: shadows and knots differ so
SAME = 3.0  # LAB units: no difference
SAME_SHARE = 0.75  # of the views that show hole and rim
SHOWN = 0.5  # share of hole and of rim that a view must show for its say
LEAST_VIEWS = 3


def without_false_holes(
    mask: np.ndarray, labs: Sequence[np.ndarray], seen: Sequence[np.ndarray], apart: np.ndarray, pixel: float
) -> np.ndarray:
    """The mask, (rows, cols) bool, with those holes filled that the photographs show to be wood.

    labs (rows, cols, 3), seen (rows, cols) bool: one a photograph; apart: their disagreement, LAB units squared;
    pixel: mm.
    """
    from scipy.ndimage import binary_fill_holes, label

    labels, count = label(binary_fill_holes(mask) & ~mask)
    if not count:
        return mask
    inner = mask & np.isfinite(apart)
    limit = max(AGREED * float(np.median(apart[inner])), LEAST_AGREED) if inner.any() else 0.0
    filled = mask.copy()
    for k in range(count):
        hole = labels == k + 1
        if _is_wood(hole, mask, apart, limit, labs, seen, pixel):
            filled |= hole
    return filled


def _is_wood(hole: np.ndarray, mask: np.ndarray, apart: np.ndarray, limit: float, labs, seen, pixel: float) -> bool:
    core = grown(hole, -CORE, pixel)
    core = core if core.any() else hole
    near, far = (grown(hole, by, pixel) for by in RIM)
    steps = _steps(core, far & ~near & mask, labs, seen)
    if len(steps) < LEAST_VIEWS:
        return False
    known = core & np.isfinite(apart)
    agreed = known.sum() > SHOWN * core.sum() and float(np.median(apart[known])) < limit
    return (agreed and float(np.median(steps)) < ALIKE) or float(np.mean(np.less(steps, SAME))) >= SAME_SHARE


def _steps(core: np.ndarray, rim: np.ndarray, labs, seen) -> list[float]:
    """LAB units between hole and rim, a view that shows both."""
    steps = []
    for lab, shown in zip(labs, seen, strict=True):
        own, wood = shown & core, shown & rim
        if own.sum() > SHOWN * core.sum() and wood.sum() > SHOWN * rim.sum() > 0:
            steps.append(float(np.linalg.norm(np.median(lab[own], axis=0) - np.median(lab[wood], axis=0))))
    return steps
