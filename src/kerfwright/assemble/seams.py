"""Seams in the photographs: is there an edge where two boards would meet? (paper, Disambiguating Corners)

The paper compares an average gradient along the seam and a coarse difference of colour. Both are in the sweep of
`photo_edges`: the step of the mean colours where the seam should be, against what is found beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.assemble.joints import Joint
from kerfwright.assemble.visibility import Obstacles
from kerfwright.identify.photo_edges import Photos, SweepResult, sweep_edge
from kerfwright.identify.types import Sheet

__all__ = ["Seam", "look_for_end", "look_for_seam"]

# a seam that no photograph shows: less than any clear seam, more than a clear face (paper: low, not zero)
UNSEEN_SCORE = 1.5


@dataclass(frozen=True)
class Seam:
    """Strength of an edge at the expected place, in units of what is found beside it, and the views that showed it."""

    score: float
    views: int
    offset: float = 0.0  # mm from the expected place


def look_for_seam(
    sheets: tuple[Sheet, ...], joint: Joint, face: str, photos: Photos, obstacles: Obstacles, window: float
) -> Seam:
    """Score of the line on a sheet face of b in which the joint's plane cuts it. window: mm that the line may be off.
    """
    sweep = _sweep(sheets[joint.b], joint, face, photos, obstacles, -8 * window, 8 * window)
    if sweep is None:
        return Seam(UNSEEN_SCORE, 0)
    near = np.abs(sweep.offsets) <= window
    level = np.median(sweep.strength[~near])
    k = int(np.argmax(np.where(near, sweep.strength, -np.inf)))
    return Seam(float(sweep.strength[k] / level), sweep.views, float(sweep.offsets[k]))


def look_for_end(
    sheets: tuple[Sheet, ...], joint: Joint, photos: Photos, obstacles: Obstacles, window: float
) -> Seam | None:
    """Whether b, whose outline stops short of a, is seen to run on up to it: the strongest edge from there on is at the
    plane itself.

    None when no photograph shows the place.
    """
    found = []
    for face in ("top", "bottom"):
        sweep = _sweep(sheets[joint.b], joint, face, photos, obstacles, -2 * window, joint.gap + 4 * window)
        if sweep is not None:
            strength = sweep.strength / np.median(sweep.strength)
            k = int(np.argmax(strength))
            found.append(Seam(float(strength[k]), sweep.views, float(sweep.offsets[k])))
    return max(found, key=lambda s: s.score * np.sqrt(s.views)) if found else None


def _sweep(
    board: Sheet, joint: Joint, face: str, photos: Photos, obstacles: Obstacles, low: float, high: float,
    step: float | None = None,
) -> SweepResult | None:
    height = board.thickness.value if face == "top" else 0.0
    step = step or (high - low) / 160
    shift = joint.trace.slope * (height - joint.trace.depth)
    along = np.concatenate([np.linspace(a, b, max(10, int((b - a) / 2.0))) for a, b in joint.intervals])
    line = joint.trace.place(np.full(len(along), shift), along)
    places = board.to_world(np.c_[line, np.full(len(line), height)])
    direction = board.world_from_board[:3, :2] @ joint.trace.m
    outward = board.normal if face == "top" else -board.normal
    visible = obstacles.visible(photos.views, places + 0.5 * (low + high) * direction, outward)
    return sweep_edge(photos, places, direction, np.arange(low, high, step), visible, smoothing=max(0.35, 1.5 * step))
