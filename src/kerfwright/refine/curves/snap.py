"""Which stretches of the boundary follow which constraint segments.

The paper marks boundary points near a constraint segment and makes every curve through them a line. Here near means
within the standard errors of both, and along the same way; the marked runs become edges that lie on the segment's
line exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.samples import Samples

__all__ = ["GuideLine", "Run", "find_runs", "guide_lines", "is_bump"]

STEEP = np.radians(50.0)  # sides of a saw's notch are steeper, those of a shadow are not
_SIDE = 2.0  # mm: half the chord along which the slope of a side is taken


@dataclass(frozen=True, eq=False)
class GuideLine:
    """The line of one or several collinear constraint segments: points x with normal @ x = offset, material on the
    left.
    """

    direction: np.ndarray  # (2,) unit
    normal: np.ndarray  # (2,) unit, left of the direction: into the material
    offset: float
    standard_error: float
    spans: tuple[tuple[float, float], ...]  # of the segments along the direction
    segment: int  # index of the most certain segment


@dataclass(frozen=True)
class Run:
    """Samples first .. last (last may exceed N) that follow a guide line."""

    line: int
    first: int
    last: int


def guide_lines(segments: Sequence[ConstraintSegment]) -> list[GuideLine]:
    """Lines of the segments; those that are collinear within their standard errors share the most certain one's
    line.
    """
    lines: list[GuideLine] = []
    for k in sorted(range(len(segments)), key=lambda i: (segments[i].standard_error, i)):
        line = _line(segments[k], k)
        twin = next((i for i, other in enumerate(lines) if line is not None and _collinear(other, line)), None)
        if line is None:
            continue
        if twin is None:
            lines.append(line)
        else:
            lines[twin] = _joined(lines[twin], segments[k])
    return lines


def _line(segment: ConstraintSegment, index: int) -> GuideLine | None:
    start, end = np.asarray(segment.start, float), np.asarray(segment.end, float)
    length = float(np.linalg.norm(end - start))
    if length < 1e-6:
        return None
    u = (end - start) / length
    n = np.array([-u[1], u[0]])
    return GuideLine(
        u, n, float(n @ start), float(segment.standard_error), ((float(u @ start), float(u @ end)),), index
    )


def _collinear(a: GuideLine, b: GuideLine) -> bool:
    """Whether b runs the same way and its ends lie on a's line within the standard errors."""
    ends = [b.normal * b.offset + b.direction * s for s in b.spans[0]]
    near = 3 * np.hypot(a.standard_error, b.standard_error) + 0.05
    return bool(a.direction @ b.direction > 0.99 and all(abs(a.normal @ p - a.offset) < near for p in ends))


def _joined(line: GuideLine, segment: ConstraintSegment) -> GuideLine:
    span = tuple(sorted(float(line.direction @ np.asarray(p, float)) for p in (segment.start, segment.end)))
    spans = (*line.spans, span)
    return GuideLine(line.direction, line.normal, line.offset, line.standard_error, spans, line.segment)


def find_runs(samples: Samples, lines: Sequence[GuideLine], options: CurveOptions) -> list[Run]:
    """Maximal runs of samples along guide lines, in order round the loop; each sample follows at most one line."""
    owner = _owners(samples, lines, options)
    runs = _bridged(_stretches(owner), samples, lines, options)
    least = samples.steps(options.shortest_edge)
    return [run for run in runs if run.last - run.first + 1 >= least]


def _owners(samples: Samples, lines: Sequence[GuideLine], options: CurveOptions) -> np.ndarray:
    """(N,) index of the line that each sample follows, -1 for none."""
    direction = samples.directions(options.shortest_edge)
    best, owner = np.full(samples.count, 1.0), np.full(samples.count, -1)
    for k, line in enumerate(lines):
        tolerance = options.snap_sigmas * np.hypot(samples.sigma, line.standard_error)
        along = samples.points @ line.direction
        margin = options.corner_reach
        within = np.any([(along > a - margin) & (along < b + margin) for a, b in line.spans], axis=0)
        within &= direction @ line.direction > np.cos(options.snap_angle)
        far = np.where(within, np.abs(samples.points @ line.normal - line.offset) / tolerance, np.inf)
        owner = np.where(far < best, k, owner)
        best = np.minimum(far, best)
    return owner


def _stretches(owner: np.ndarray) -> list[Run]:
    """Runs of equal owner round the loop, those of -1 left out."""
    n = len(owner)
    if owner[0] >= 0 and np.all(owner == owner[0]):
        return []  # a closed boundary cannot follow one line all round
    changes = np.flatnonzero(owner != np.roll(owner, 1))
    ends = np.append(changes[1:], changes[0] + n) if len(changes) else changes
    return [Run(int(owner[a]), int(a), int(b) - 1) for a, b in zip(changes, ends, strict=True) if owner[a] >= 0]


def _bridged(runs: list[Run], samples: Samples, lines: Sequence[GuideLine], options: CurveOptions) -> list[Run]:
    """Join runs of one line that are parted by a bump of the boundary."""
    merged = list(runs)
    k = 0
    while len(merged) > 1 and k < len(merged):
        a, b = merged[k], merged[(k + 1) % len(merged)]
        first = b.first + (samples.count if b.first <= a.last else 0)
        if a.line == b.line and is_bump(samples, a.last, first, lines[a.line].direction, lines[a.line].offset, options):
            joined = Run(a.line, a.first, b.last + first - b.first)
            merged[k] = joined
            del merged[(k + 1) % len(merged)]
            k = 0
        else:
            k += 1
    return sorted(merged, key=lambda r: r.first)


def is_bump(
    samples: Samples, first: int, last: int, direction: np.ndarray, offset: float, options: CurveOptions
) -> bool:
    """Whether samples first .. last leave the line with left normal `direction` turned by 90 degrees only as a bump
    does.
    """
    between = np.arange(first, last + 1) % samples.count
    along = samples.points[between] @ direction
    depth = np.abs(samples.points[between] @ np.array([-direction[1], direction[0]]) - offset).max()
    chord = along[-1] - along[0]
    if not 0 <= chord <= options.bump_length or depth > options.bump_depth:
        return False
    inside = samples.directions(_SIDE)[between]
    return bool((inside @ direction).min() > np.cos(STEEP))
