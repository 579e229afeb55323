"""How thick a board is whose one face nobody saw: other boards that end on that face show where it lies.

The back of a case hides its inner face in the dark and its edges behind the sides. But the line in which it meets a
shelf is a line in space, and the photographs show it: the line is swept away from the seen face, over every board that
ends there at once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kerfwright.assemble.options import AssembleOptions
from kerfwright.capture.types import Cloud
from kerfwright.identify.faces import with_thickness
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.joints import Joint, columns, face_plane, trace_of
from kerfwright.identify.photo_edges import Photos, SweepResult, refine_peak
from kerfwright.identify.reaching import Scene, end_is_seen, ends_elsewhere
from kerfwright.identify.seams import sweep_line
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles
from kerfwright.model import Origin, Quantity

__all__ = ["measured_backs"]

STEP = 1 / 1600  # of D, between two offsets of the sweep
LIKELY = (0.5, 2.0)  # of the thickness that most of the object has; a groove or an arris may lie beyond
LEAST_LOOKS = 10  # views of all lines together
CLEAR = 0.2  # share of stretches and views that show an edge there, beyond the share that show one anywhere


@dataclass(frozen=True)
class _Window:
    """Offsets from the seen face that are swept, mm; shorter lines are not."""

    low: float
    high: float
    step: float
    shortest: float


def measured_backs(
    sheets: tuple[Sheet, ...], cloud: Cloud, photos: Photos, free: FreeSpace, options: AssembleOptions
) -> tuple[Sheet, ...]:
    """The sheets, those of unseen thickness as thick as the boards that end on their hidden face show."""
    out = list(sheets)
    for k, sheet in enumerate(sheets):
        if not sheet.thickness_seen:
            low, high = (share * sheet.thickness.value for share in LIKELY)
            window = _Window(low, high, STEP * cloud.diameter, 2 * options.reach * cloud.diameter)
            found = _hidden_face(k, Scene(sheets, cloud, photos, Obstacles([], 1.0), free, options), window)
            if found is not None:
                out[k] = replace(with_thickness(sheet, found), thickness_seen=True)
    return tuple(out)


def _hidden_face(a: int, scene: Scene, window: _Window) -> Quantity | None:
    """Depth of the hidden face below the top, where the edges of all boards that end there agree on one."""
    sheets, options = scene.sheets, scene.options
    thin = Quantity(value=window.low, standard_error=window.low, origin=Origin.INFERRED)
    shown = list(sheets)
    shown[a] = with_thickness(sheets[a], thin)  # what is not known to be there must not hide anything
    obstacles = Obstacles(shown, scene.mm(options.outline_error))
    sweeps = []
    for b in range(len(sheets)):
        joint = _towards(a, b, sheets, scene.diameter, window, options) if b != a else None
        if joint is not None and not end_is_seen(scene, joint) and not ends_elsewhere(scene, joint):
            faces = _facing(sheets[a], sheets[b], scene.mm(options.reach))
            sweeps += [_sweep(sheets[b], joint, face, scene.photos, obstacles, window) for face in faces]
    sweeps = [s for s in sweeps if s is not None]
    return _agreed(sweeps, window) if sweeps else None


def _towards(
    a: int, b: int, sheets: tuple[Sheet, ...], diameter: float, window: _Window, options: AssembleOptions
) -> Joint | None:
    """The line in which a's seen face cuts b, over the columns in which b comes near it from behind."""
    normal, offset = face_plane(sheets[a], "top")
    trace = trace_of(sheets[b], -normal, -offset)
    if trace is None or trace.sine < 0.9:
        return None
    along, first, last = columns(sheets[b].region, trace, diameter / 200)
    own = (first > -options.outline_error * diameter) & (first < options.far_reach * diameter) & (last > window.high)
    if own.sum() * diameter / 200 < window.shortest:
        return None
    interval = (float(along[own].min()), float(along[own].max()))
    ends = trace.place(first[own], along[own])
    return Joint(a, b, "top", trace, (interval,), float(np.median(first[own])), ends)


def _facing(a: Sheet, b: Sheet, reach: float) -> list[str]:
    """The faces of b that a goes on in front of: only they can show where a's hidden face is."""
    ring = np.asarray(a.region.exterior.coords)
    height = b.to_board(a.to_world(np.c_[ring, np.zeros(len(ring))]))[:, 2]
    in_front = {"top": height.max() > b.thickness.value + reach, "bottom": height.min() < -reach}
    return [face for face, shows in in_front.items() if shows]


def _sweep(
    board: Sheet, joint: Joint, face: str, photos: Photos, obstacles: Obstacles, window: _Window
) -> SweepResult | None:
    return sweep_line(board, joint, face, photos, obstacles, window.low, window.high, window.step)


def _agreed(sweeps: list[SweepResult], window: _Window) -> Quantity | None:
    """The offset at which all sweeps together are strongest."""
    weight = np.array([s.views for s in sweeps], float)
    strength = np.average([s.strength / np.median(s.strength) for s in sweeps], axis=0, weights=weight)
    shown = np.average([s.persistence for s in sweeps], axis=0, weights=weight)
    peaks = 1 + np.flatnonzero((strength[1:-1] > strength[:-2]) & (strength[1:-1] >= strength[2:]))
    if not len(peaks) or weight.sum() < LEAST_LOOKS:
        return None
    k = int(max(peaks, key=lambda j: strength[j]))
    if shown[k] - np.median(shown) < CLEAR:
        return None
    value = float(sweeps[0].offsets[k] + refine_peak(strength[k - 1 : k + 2]) * window.step)
    error = float(max(np.mean([s.standard_error for s in sweeps]), window.step))
    return Quantity(value=value, standard_error=error, origin=Origin.MEASURED)
