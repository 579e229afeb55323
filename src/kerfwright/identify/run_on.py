"""Boards run on, over what nobody saw, to the planes of the boards that they end on, and to the floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from kerfwright.identify.joints import Joint, Trace, columns, end_on, runs_of, trace_of
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.outlines import filled_region
from kerfwright.identify.reaching import Scene, goes_on_unseen, shown_end
from kerfwright.identify.types import Sheet

__all__ = ["floor_runs", "floor_trace", "run_on"]

FLOOR = np.array([0.0, 0.0, 1.0])  # outward normal of the plane z = 0


@dataclass(frozen=True, eq=False)
class _End:
    """Where a board ends, in its plane; the wood lies on the left of start -> end."""

    start: np.ndarray  # (2,)
    end: np.ndarray  # (2,)
    origin: str  # "contact" or "ground"


def run_on(scene: Scene) -> tuple[tuple[Sheet, ...], list[Joint]]:
    """The sheets of a scene with their regions run on to what they end on; and in which joints they end on others."""
    ends: list[list[_End]] = [[] for _ in scene.sheets]
    pairs = combinations(range(len(scene.sheets)), 2)
    joints = [joint for a, b in pairs for joint in _joints(scene, a, b)]
    for joint in joints:
        ends[joint.b] += _ends(joint.trace, joint.intervals, "contact")
    out = []
    for sheet, own in zip(scene.sheets, ends, strict=True):
        floor = floor_trace(sheet)
        if floor is not None:
            own += _ends(floor, floor_runs(sheet, floor, (), scene.diameter, scene.options), "ground")
        out.append(replace(sheet, region=filled_region(sheet.region, own, scene.mm(scene.options.far_reach))))
    return tuple(out), joints


def _joints(scene: Scene, a: int, b: int) -> list[Joint]:
    """In which of two ways one board ends on the other: both where that is open, and none where they only come near."""
    search = scene.search(scene.options.outline_error)
    both = [end_on(scene.sheets, *pair, search) for pair in ((a, b), (b, a))]
    near = [j for j in both if goes_on_unseen(scene, j) is not None]
    if near:
        return near
    shown = [(end.score, j) for j in both if j is not None and (end := shown_end(scene, j)) is not None]
    return [max(shown, key=lambda entry: entry[0])[1]] if shown else []


def _ends(trace: Trace, intervals: Sequence[tuple[float, float]], origin: str) -> list[_End]:
    return [
        _End(*(trace.place(np.zeros(1), np.array([along]))[0] for along in (high, low)), origin)
        for low, high in intervals
    ]


def floor_trace(sheet: Sheet) -> Trace | None:
    """The line in which a board meets the floor z = 0; None for a level one."""
    return trace_of(sheet, FLOOR, 0.0)


def floor_runs(
    sheet: Sheet, trace: Trace, above: Sequence[Joint], diameter: float, options: WholeOptions, traced: bool = False
) -> tuple[tuple[float, float], ...]:
    """Where along its line on the floor a board stands on it, unless it ends on another board there.

    above : the ends of this board on others. traced : its outline was traced in photographs, so that where it is
        higher than elsewhere an arch begins.
    """
    step = diameter / 200
    along, first, _ = columns(sheet.region, trace, step)
    standing = np.abs(first) < options.ground_reach * diameter
    if standing.any() and traced:
        standing &= first < 2 * max(float(np.median(first[standing])), 0.0) + options.outline_error * diameter
    for joint in above:
        if joint.trace.m @ trace.m > 0.9:
            for low, high in joint.intervals:
                ends = joint.trace.place(np.zeros(2), np.array([low, high])) @ trace.tangent
                standing &= ~((along > ends.min() - 4 * step) & (along < ends.max() + 4 * step))
    return runs_of(along, standing, step, options.min_contact * diameter, joining=2 * step)
