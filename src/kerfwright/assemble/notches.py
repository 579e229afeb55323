"""Corners at which one choice would cut a notch: geometry decides them before any seam (paper, Disambiguating Corners).

A rail between two legs could end on a leg, or the leg on the rail. But the leg is longer than the rail is high: cut off
along the rail it would have a notch, where the cloud shows wood. A board that ends on another over its whole width has
none. So the rail ends, whatever faint line the photographs show along its face.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kerfwright.identify.joints import Joint, columns
from kerfwright.identify.types import Sheet

__all__ = ["is_notch"]

BEYOND = 0.5  # of the other board's thickness: wood that reaches as far beyond its face is no ragged outline
FILLED = 0.5  # share of the joint that must have such wood; where there is none the board was notched indeed
BESIDE = 1.0  # lengths of the joint that such wood goes on for beside it


def is_notch(sheets: Sequence[Sheet], joint: Joint, step: float) -> bool:
    """Whether `joint` would cut a notch into its board: wood that was seen beyond the plane goes on beside the joint.

    step : mm between the places along the joint that are looked at.
    """
    one, other = sheets[joint.a], sheets[joint.b]
    along, first, _ = columns(other.region, joint.trace, step)
    beyond = first < -BEYOND * one.thickness.value / joint.trace.sine
    cut_off = np.zeros(len(along), bool)
    for low, high in joint.intervals:
        cut_off |= (along >= low) & (along <= high)
    if not cut_off.any() or beyond[cut_off].mean() < FILLED:
        return False
    return bool((beyond & ~cut_off).sum() >= BESIDE * cut_off.sum())
