"""Seams in the photographs: is there an edge where two boards would meet? (paper, Disambiguating Corners)

The paper compares an average gradient along the seam and a coarse difference of colour. Both are in the sweep of
`photo_edges`: the step of the mean colours where the seam should be, against what is found beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.identify.joints import Joint
from kerfwright.identify.photo_edges import Photos, SweepResult, sweep_edge
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles

__all__ = ["End", "Seam", "look_for_end", "look_for_seam", "sweep_line"]

LAYER = 25.0  # mm of a sweep that one test of what hides it stands for
# a seam that no photograph shows: less than any clear seam, more than a clear face (paper: low, not zero)
UNSEEN_SCORE = 1.5


@dataclass(frozen=True)
class Seam:
    """Strength of an edge at the expected place, in units of what is found beside it, and the views that showed it."""

    score: float
    views: int
    offset: float = 0.0  # mm from the expected place


@dataclass(frozen=True)
class End:
    """The edge at the plane where a board may end, and the strongest edge before it.

    score: strength in units of the median; excess: share of stretches and views that show it, less the median's.
    """

    score: float
    views: int
    excess: float
    rival_offset: float  # mm inside the plane
    rival_score: float
    rival_excess: float


def look_for_seam(
    sheets: tuple[Sheet, ...], joint: Joint, face: str, photos: Photos, obstacles: Obstacles, window: float
) -> Seam:
    """Score of the line on a sheet face of b in which the joint's plane cuts it. window: mm that the line may be off.
    """
    sweep = sweep_line(sheets[joint.b], joint, face, photos, obstacles, -8 * window, 8 * window)
    if sweep is None:
        return Seam(UNSEEN_SCORE, 0)
    near = np.abs(sweep.offsets) <= window
    level = np.median(sweep.strength[~near])
    k = int(np.argmax(np.where(near, sweep.strength, -np.inf)))
    return Seam(float(sweep.strength[k] / level), sweep.views, float(sweep.offsets[k]))


def look_for_end(
    sheets: tuple[Sheet, ...], joint: Joint, photos: Photos, obstacles: Obstacles, window: float, fringe: float,
    beside: float,
) -> End | None:
    """Whether b, whose outline stops short of a, is seen to run on up to it: an edge that most stretches and views show
    at the plane, and no clearer one before it.

    window: mm that the edge may be off; fringe: mm by which the outline may be too large; beside: mm before the plane
    in which an edge speaks for the plane as well, for boards so near are connected. None when no photograph shows the
    place.
    """
    found = []
    for face in ("top", "bottom"):
        sweep = sweep_line(
            sheets[joint.b], joint, face, photos, obstacles, -4 * window, joint.gap + fringe, 0.5 * window
        )
        if sweep is not None:
            found.append(_end(sweep, window, beside))
    return max(found, key=lambda e: (min(e.views, 3), e.excess)) if found else None


def _end(sweep: SweepResult, window: float, beside: float) -> End:
    strength = sweep.strength / np.median(sweep.strength)
    excess = sweep.persistence - np.median(sweep.persistence)
    near = np.abs(sweep.offsets) <= window
    k = int(np.argmax(np.where(near, strength * np.maximum(excess, 0.0), -np.inf)))
    rival = int(np.argmax(np.where(sweep.offsets > beside, strength, -np.inf)))
    return End(
        float(strength[k]), sweep.views, float(excess[k]), float(sweep.offsets[rival]), float(strength[rival]),
        float(excess[rival]),
    )


def sweep_line(
    board: Sheet, joint: Joint, face: str, photos: Photos, obstacles: Obstacles, low: float, high: float,
    step: float | None = None,
) -> SweepResult | None:
    """The joint's line on a face of the board, swept from `low` to `high` mm into the wood."""
    height = board.thickness.value if face == "top" else 0.0
    step = step or (high - low) / 160
    shift = joint.trace.slope * (height - joint.trace.depth)
    along = np.concatenate([np.linspace(a, b, max(10, int((b - a) / 2.0))) for a, b in joint.intervals])
    line = joint.trace.place(np.full(len(along), shift), along)
    places = board.to_world(np.c_[line, np.full(len(line), height)])
    direction = board.world_from_board[:3, :2] @ joint.trace.m
    offsets = np.arange(low, high, step)
    outward = board.normal if face == "top" else -board.normal
    layers = np.linspace(low, high, max(1, int((high - low) / LAYER)) + 2)[1:-1]
    shown = [obstacles.visible(photos.views, places + at * direction, outward) for at in layers]
    nearest = np.abs(offsets[:, None] - layers).argmin(axis=1)
    visible = np.stack(shown, axis=-1)[:, :, nearest] if len(layers) > 1 else shown[0]
    return sweep_edge(photos, places, direction, offsets, visible, smoothing=max(0.35, 1.5 * step))
