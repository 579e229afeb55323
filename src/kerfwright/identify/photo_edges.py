"""Where an edge lies, measured in the photographs.

A straight or curved edge that is roughly known in space is swept along a direction; in every photograph that shows it,
colours are read along the sweep. Colours averaged along the edge step where the edge is, in all views at the same
offset, because the edge itself is a curve in space: what lies beside it does not matter. Wood grain, noise and the
background do not agree in this way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, minimum_filter1d

from kerfwright.capture.photos import photograph
from kerfwright.capture.types import Capture, View

__all__ = ["Photos", "SweepResult", "refine_peak", "sweep_edge"]

RIM = 2  # offsets at either end of a sweep where no peak is believed


class Photos:
    """Photographs of a capture, sampled bilinearly."""

    def __init__(self, capture: Capture):
        self.views = capture.views

    def colours(self, k: int, x_in_world: np.ndarray) -> np.ndarray:
        """(..., 3) places to the (..., 3) float32 RGB that view k shows there; NaN outside the photograph."""
        from kerfwright.capture._lens import read_points

        view: View = self.views[k]
        flat = np.ascontiguousarray(x_in_world, float).reshape(-1, 3)
        read = read_points(photograph(view), flat, view.camera_from_world, view.camera.lens)
        return read.reshape(x_in_world.shape)


@dataclass(frozen=True, eq=False)
class SweepResult:
    """Edge strength over the offsets (mm), the best offset with its standard error, and how far it stands out."""

    offsets: np.ndarray
    strength: np.ndarray
    best: float
    standard_error: float
    contrast: float  # best strength over the median strength
    views: int
    persistence: np.ndarray  # share of all stretches in all views that show an edge at each offset


def sweep_edge(
    photos: Photos,
    places: np.ndarray,
    direction: np.ndarray,
    offsets: np.ndarray,
    visible: np.ndarray,
    *,
    smoothing: float = 0.4,
    chunk: int = 10,
) -> SweepResult | None:
    """Sweep an edge through space and find where the photographs show it.

    places (N, 3) world mm, neighbours in order along the edge; direction (3,) or (N, 3) unit; offsets (T,) mm, evenly
    spaced; visible (V, N) bool: which view shows which place, or (V, N, T): at which offset. smoothing: mm of the step
    detector. chunk: places averaged before the step is measured. None when no view shows a whole chunk, or there are
    too few offsets for a peak with others on both sides.
    """
    if len(offsets) <= 2 * RIM:
        return None
    direction = np.broadcast_to(direction, places.shape)
    grid = places[:, None, :] + offsets[None, :, None] * direction[:, None, :]
    step = offsets[1] - offsets[0]
    curves = []
    for k in range(len(photos.views)):
        at_all = visible[k] if visible.ndim == 2 else visible[k].any(axis=1)
        own = np.flatnonzero(at_all)
        if len(own) >= chunk:
            shown = None if visible.ndim == 2 else visible[k, own]
            curves.extend(_view_curves(photos, k, grid[own], own, shown, chunk, smoothing / step))
    if not any(np.isfinite(curve).any() for _, curve in curves):
        return None
    return _combine(np.array([c for _, c in curves]), [k for k, _ in curves], offsets)


def _view_curves(
    photos: Photos, k: int, grid: np.ndarray, own: np.ndarray, shown: np.ndarray | None, chunk: int, sigma: float
) -> list[tuple[int, np.ndarray]]:
    """Edge strength over the offsets, one curve a chunk of places; NaN where something hides a part of the chunk."""
    colours = photos.colours(k, grid)
    groups = np.split(np.arange(len(own)), np.flatnonzero(np.diff(own // chunk)) + 1)
    whole = np.isfinite(colours).all(axis=(1, 2))
    groups = [group for group in groups if len(group) >= 0.7 * chunk and whole[group].all()]
    if not groups:
        return []
    profiles = np.stack([colours[group].mean(axis=0) for group in groups])
    slopes = np.linalg.norm(gaussian_filter1d(profiles, sigma, axis=1, order=1), axis=2)
    if shown is not None:
        clear = np.stack([shown[group].all(axis=0) for group in groups])
        slopes[minimum_filter1d(clear, 2 * int(2 * sigma) + 1, axis=1) == 0] = np.nan
    return [(k, slope) for slope in slopes]


def _combine(slopes: np.ndarray, owners: list[int], offsets: np.ndarray) -> SweepResult:
    """Mean of the curves, each limited so that one strong background edge cannot outvote the rest."""
    limited = _limited(slopes / max(np.nanmedian(slopes), 1e-6))
    told = np.isfinite(limited).sum(axis=0)
    strength = np.nansum(limited, axis=0) / np.maximum(told, 1)
    strength[told == 0] = np.median(strength[told > 0])
    inner = slice(RIM, len(offsets) - RIM)
    k = RIM + int(np.argmax(strength[inner]))
    best = float(offsets[k] + refine_peak(strength[k - 1 : k + 2]) * (offsets[1] - offsets[0]))
    error = _standard_error(limited, owners, k, offsets)
    shown = (maximum_filter1d(np.nan_to_num(limited), 3, axis=1) > 2.0).sum(axis=0) / np.maximum(told, 1)
    return SweepResult(
        offsets, strength, best, error, float(strength[k] / np.median(strength)), len(set(owners)), shown
    )


def _limited(strength: np.ndarray, most: float = 12.0) -> np.ndarray:
    """Values pressed below `most`; still rising, for a flat top would hide where the peak is."""
    knee = 0.75 * most
    excess = np.maximum(strength / knee - 1, 0) * knee / (most - knee)
    return np.minimum(strength, knee) + (most - knee) * excess / (1 + excess)


def refine_peak(y: np.ndarray) -> float:
    """Vertex of the parabola through three samples, in steps from the middle one, within one step."""
    bend = y[0] - 2 * y[1] + y[2]
    return float(np.clip((y[0] - y[2]) / (2 * bend), -1, 1)) if bend < 0 else 0.0


def _standard_error(curves: np.ndarray, owners: list[int], k: int, offsets: np.ndarray, reach: float = 1.5) -> float:
    """Scatter of the views' own peaks about the common one, over the root of their number."""
    near = np.abs(offsets - offsets[k]) <= reach
    peaks = []
    for owner in sorted(set(owners)):
        own = curves[[o == owner for o in owners]][:, near]
        told = np.isfinite(own).any(axis=0)
        if told.any():
            peaks.append(offsets[near][told][np.argmax(np.nanmean(own[:, told], axis=0))])
    if not peaks:
        return reach / 2
    spread = 1.4826 * np.median(np.abs(np.array(peaks) - np.median(peaks)))
    return float(max(spread, 0.3 * (offsets[1] - offsets[0])) / np.sqrt(len(peaks))) if len(peaks) > 1 else reach / 2
