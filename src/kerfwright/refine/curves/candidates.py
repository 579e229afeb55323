"""Where nodes may be: corners and changes of curvature at several scales, ends of constrained runs, and fill-ins.

The paper takes the K points of highest curvature (supplement, Curve Fitting). Noise makes curvature at one scale
unreliable, and the ends of tangent arcs have no peak of curvature but a step; so corners and steps are looked for
apart.
"""

from __future__ import annotations

import numpy as np

from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.samples import Samples

__all__ = ["find_candidates"]

CORNER_SCALES = (5.0, 9.0, 16.0)  # mm: the shortest edge, and what noise needs
STEP_SCALES = (15.0, 30.0, 60.0)


def find_candidates(samples: Samples, forced: np.ndarray, blocked: np.ndarray, options: CurveOptions) -> np.ndarray:
    """Sorted sample indices of candidate nodes.

    Parameters
    ----------
    samples : Samples
    forced : (F,) int array
        Indices that must be candidates.
    blocked : (N,) bool array
        Samples that cannot be nodes: the insides of constrained runs.
    """
    chosen = list(dict.fromkeys(int(i) % samples.count for i in forced))
    gap = samples.steps(2.0)
    corners = [(score, i) for scale in CORNER_SCALES for score, i in _corners(samples, scale)]
    _take(chosen, sorted(corners, reverse=True), samples.count, gap, blocked, options.max_candidates)
    bends = [(score, i) for scale in STEP_SCALES for score, i in _curvature_steps(samples, scale)]
    _take(
        chosen, sorted(bends, reverse=True), samples.count, samples.steps(4.0), blocked, options.max_candidates * 3 // 4
    )
    _fill(chosen, samples, blocked, options.max_candidates)
    return np.array(sorted(chosen))


def _take(
    chosen: list[int], ranked: list[tuple[float, int]], count: int, gap: int, blocked: np.ndarray, most: int
) -> None:
    """Add candidates, best first, that keep a distance from those chosen."""
    for _, i in ranked:
        if len(chosen) >= most:
            return
        if blocked[i] or any(_apart(i, j, count) < gap for j in chosen):
            continue
        chosen.append(i)


def _apart(i: int, j: int, count: int) -> int:
    d = abs(i - j) % count
    return min(d, count - d)


def _corners(samples: Samples, scale: float) -> list[tuple[float, int]]:
    """Local maxima of the turning angle between the chords before and behind, in standard errors."""
    k = min(samples.steps(scale), max(1, samples.count // 4))
    before = samples.points - np.roll(samples.points, k, axis=0)
    behind = np.roll(samples.points, -k, axis=0) - samples.points
    angle = np.abs(np.arctan2(before[:, 0] * behind[:, 1] - before[:, 1] * behind[:, 0], (before * behind).sum(axis=1)))
    spread = 1 - np.exp(-((scale / samples.correlation) ** 2))
    noise = 2.0 * samples.sigma * np.sqrt(spread) / scale
    score = angle / np.hypot(noise, 0.05)
    return [(float(score[i]), i) for i in _peaks(score, k) if angle[i] > 0.15 and score[i] > 2.0]


def _curvature_steps(samples: Samples, scale: float) -> list[tuple[float, int]]:
    """Local maxima of the difference between the mean curvatures before and behind, in standard errors."""
    k = samples.steps(scale)
    if 4 * k > samples.count:
        return []
    tangent = np.unwrap(_angles(samples.directions(min(scale / 3, 8.0))))
    turn = tangent[-1] + np.angle(np.exp(1j * (tangent[0] - tangent[-1]))) - tangent[0]
    wide = np.concatenate([tangent - turn, tangent, tangent + turn])
    n, i = samples.count, np.arange(samples.count, 2 * samples.count)
    step = np.abs(wide[i + k] - 2 * wide[i] + wide[i - k]) / scale
    noise = 2.5 * samples.sigma / scale / min(scale / 3, 8.0)
    score = step / noise
    return [(float(score[j]), j) for j in _peaks(score, max(1, k // 2)) if score[j] > 1.0 and 0 <= j < n]


def _angles(vectors: np.ndarray) -> np.ndarray:
    return np.arctan2(vectors[:, 1], vectors[:, 0])


def _peaks(score: np.ndarray, reach: int) -> list[int]:
    """Indices where a closed sequence is the largest within +- reach."""
    padded = np.concatenate([score[-reach:], score, score[:reach]])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    return [int(i) for i in np.flatnonzero(score >= windows.max(axis=1))]


def _fill(chosen: list[int], samples: Samples, blocked: np.ndarray, most: int) -> None:
    """Halve the widest gaps until enough candidates are there or gaps are short."""
    free = np.flatnonzero(~blocked)
    if not chosen:
        chosen.append(int(free[0]) if len(free) else 0)
    shortest = samples.steps(12.0)
    while len(chosen) < most:
        nodes = np.array(sorted(chosen))
        gaps = np.diff(np.append(nodes, nodes[0] + samples.count))
        for k in np.argsort(-gaps, kind="stable"):
            middle = int(nodes[k] + gaps[k] // 2) % samples.count
            if gaps[k] >= 2 * shortest and not blocked[middle]:
                chosen.append(middle)
                break
        else:
            return
