"""Repeated boards: those whose outlines are one within their errors, turned or mirrored, get one cut path, fitted to
what was seen of all of them ("cut 2 of these"). Each stays where it is, and on the planes that it ends on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.errors import StageError
from kerfwright.identify.outlines import segment_axes
from kerfwright.model import CutPath, Line
from kerfwright.model.geometry import transform_path
from kerfwright.refine.congruence import Contour, agree, best_motion, contour_of, moved_points
from kerfwright.refine.curves import CurveOptions, fit_curves
from kerfwright.refine.types import BoundaryLoop, Fitted, Twin

__all__ = ["with_twins"]

EXACT = 0.01  # mm by which a joint path may miss a plane that a board ends on
HELD = EXACT / 1000  # standard error of a boundary point on such a plane, when outlines are laid on each other
ON_SEGMENT = 0.05  # mm; fitted edges and boundaries lie on their segments to rounding
ONE_PLANE = 1.0  # mm; segments of twins that lie nearer belong to the same edge
COVERED = 0.95  # share of a contact's edge that the joint path must have as well
BEVEL = np.radians(0.1)  # by which slants may differ; each board keeps its own, and no saw is set more finely
ALIKE = 0.1  # by which areas and perimeters of boards may differ that are worth comparing
HARD = ("contact", "corner")  # segments on planes of other boards; the floor and traced edges are known less well

Members = list[tuple[int, np.ndarray]]  # boards and the motions that lay them on the first


def with_twins(fitted: Sequence[Fitted], curves: CurveOptions | None = None) -> tuple[Fitted, ...]:
    """The boards, congruent ones with one cut path, fitted as `curves` says. The first of each group keeps its name,
    the others say whose twin they are.
    """
    out = list(fitted)
    contours = [contour_of(f.loops) for f in fitted]
    for first in range(len(out)):
        if out[first].twin is not None:
            continue
        members: Members = [(first, np.eye(2, 3))]
        for other in range(first + 1, len(out)):
            if out[other].twin is None and _comparable(fitted[first], fitted[other]):
                motion = _laid_on(first, other, fitted, contours)
                joint = None if motion is None else _joint([*members, (other, motion)], fitted, contours, curves)
                if joint is not None:
                    members.append((other, motion))
                    for (k, _), board in zip(members, joint, strict=True):
                        out[k] = board
    return tuple(out)


def _comparable(a: Fitted, b: Fitted) -> bool:
    """Whether it is worth looking closer: one thickness, as many holes, about the same size."""
    if abs(a.sheet.thickness.value - b.sheet.thickness.value) > 1e-9 or len(a.loops) != len(b.loops):
        return False
    samples = [sum(len(loop.points) for loop in f.loops) for f in (a, b)]  # evenly spaced: as the perimeters
    areas = [f.sheet.region.area for f in (a, b)]
    return all(abs(one - other) <= ALIKE * one for one, other in (samples, areas))


def _laid_on(first: int, other: int, fitted: Sequence[Fitted], contours: Sequence[Contour]) -> np.ndarray | None:
    a, b = contours[first], contours[other]
    return best_motion(a, b, _held_errors(fitted[first], a), _held_errors(fitted[other], b))


def _held_errors(board: Fitted, contour: Contour) -> np.ndarray:
    """Standard errors of the boundary, next to none where the board ends on another's plane."""
    error = contour.error.copy()
    for segment in board.segments:
        if segment.origin in HARD:
            along, inward, length = segment_axes(segment)
            x = contour.points - segment.start
            error[(np.abs(x @ inward) < ON_SEGMENT) & (x @ along > 0) & (x @ along < length)] = HELD
    return error


def _joint(
    members: Members, fitted: Sequence[Fitted], contours: Sequence[Contour], curves: CurveOptions | None
) -> list[Fitted] | None:
    """The members with one path; None when it would leave a plane or a boundary, or cannot be fitted."""
    first = members[0][0]
    segments = _shared_segments([[_moved_segment(s, m) for s in fitted[k].segments] for k, m in members])
    if segments is None:
        return None
    loops = _mean_loops(members, fitted, contours)
    try:
        fit = fit_curves(loops, segments, curves)
    except StageError:
        return None
    path = _shifted(fit.path, _way_to_planes(fit.path, fitted[first]))
    found = []
    for k, motion in members:
        motion = _settled(motion, path, fitted[k])
        own_path = transform_path(path, _inverse(motion))
        if not _holds(own_path, fitted[k]) or not agree(contour_of(loops), contours[k], motion):
            return None
        mirrored = bool(np.linalg.det(motion[:, :2]) < 0)
        twin = None if k == first else Twin(first, motion, mirrored)
        found.append(replace(fitted[k], path=own_path, notes=fit.notes, twin=twin))
    return found


def _shifted(path: CutPath, shift: np.ndarray) -> CutPath:
    return transform_path(path, np.c_[np.eye(2), shift])


def _settled(motion: np.ndarray, path: CutPath, board: Fitted) -> np.ndarray:
    """The motion with the board's repeat of the path moved onto the planes that the board ends on."""
    shift = _way_to_planes(transform_path(path, _inverse(motion)), board)
    return np.c_[motion[:, :2], motion[:, 2] - motion[:, :2] @ shift]


def _way_to_planes(path: CutPath, board: Fitted) -> np.ndarray:
    """(2,) the least shift that puts a path's lines onto the planes of other boards that the board ends on."""
    rows, gaps = [], []
    for segment in board.segments:
        along, inward, length = segment_axes(segment)
        for line in _lines(path) if segment.origin in HARD else ():
            x = np.array([line.start, line.end]) - segment.start
            beside = (x @ along).max() < 0 or (x @ along).min() > length
            if not beside and np.abs(x @ inward).max() <= ON_SEGMENT:
                rows.append(inward)
                gaps.append(-float((x @ inward).mean()))
    return np.linalg.lstsq(np.array(rows), np.array(gaps), rcond=1e-6)[0] if rows else np.zeros(2)


def _inverse(motion: np.ndarray) -> np.ndarray:
    return np.linalg.inv(np.vstack([motion, [0, 0, 1]]))[:2]


def _mean_loops(members: Members, fitted: Sequence[Fitted], contours: Sequence[Contour]) -> tuple[BoundaryLoop, ...]:
    """The first board's boundary moved across itself to the mean of all, weighted by their errors."""
    out = []
    for loop in fitted[members[0][0]].loops:
        normal = contour_of([loop]).across(loop.points)[1]
        weight, shift = loop.standard_error**-2.0, np.zeros(len(loop.points))
        for k, motion in members[1:]:
            distance, _, nearest = contours[k].across(moved_points(_inverse(motion), loop.points))
            own = contours[k].error[nearest] ** -2.0
            weight, shift = weight + own, shift - own * distance
        points = loop.points + (shift / weight)[:, None] * normal
        out.append(replace(loop, points=points, standard_error=weight**-0.5))
    return tuple(out)


def _moved_segment(segment: ConstraintSegment, motion: np.ndarray) -> ConstraintSegment:
    """A segment in the first board's plane, the wood still on its left."""
    ends = moved_points(motion, np.array([segment.start, segment.end]))
    if np.linalg.det(motion[:, :2]) < 0:
        ends = ends[::-1]
    normal = segment.normal
    if normal is not None:
        normal = np.array([*(motion[:, :2] @ normal[:2]), normal[2]])
    return replace(segment, start=ends[0], end=ends[1], normal=normal)


def _shared_segments(boards: Sequence[Sequence[ConstraintSegment]]) -> tuple[ConstraintSegment, ...] | None:
    """One segment for those of several boards that belong to one edge; None when the boards' bevels differ."""
    groups: list[list[ConstraintSegment]] = []
    for segments in boards:
        for segment in segments:
            group = next((g for g in groups if _one_edge(g[0], segment)), None)
            if group is None:
                groups.append([segment])
            else:
                group.append(segment)
    if not all(_one_bevel(group, len(boards)) for group in groups):
        return None
    return tuple(_mean_segment(group) for group in groups)


def _one_edge(a: ConstraintSegment, b: ConstraintSegment) -> bool:
    along, inward, length = segment_axes(a)
    x = np.array([b.start, b.end]) - a.start
    overlap = min(length, (x @ along).max()) - max(0.0, (x @ along).min())
    return bool(segment_axes(b)[0] @ along > 0.999 and np.abs(x @ inward).max() < ONE_PLANE and overlap > 0)


def _one_bevel(group: Sequence[ConstraintSegment], boards: int) -> bool:
    """Whether an edge is square on all boards, or slanted alike on all."""
    slant = np.array([0.0 if s.normal is None else s.normal[2] for s in group])
    depth = [s.depth for s in group if s.normal is not None]
    if not depth:
        return True
    return len(group) >= boards and bool(np.ptp(np.arcsin(slant)) < BEVEL and np.ptp(depth) < EXACT)


def _mean_segment(group: Sequence[ConstraintSegment]) -> ConstraintSegment:
    """The mean of those on other boards' planes, of all where there are none, as long as all together."""
    hard = [s for s in group if s.origin in HARD] or list(group)
    if len(group) == 1:
        return group[0]
    direction = np.mean([segment_axes(s)[0] for s in hard], axis=0)
    direction = direction / np.linalg.norm(direction)
    inward = np.array([-direction[1], direction[0]])
    middle = np.mean([(s.start + s.end) / 2 for s in hard], axis=0)
    ends = np.array([p for s in group for p in (s.start, s.end)]) @ direction
    base = (middle @ inward) * inward
    return replace(hard[0], start=base + ends.min() * direction, end=base + ends.max() * direction)


def _holds(path: CutPath, board: Fitted) -> bool:
    """Whether a path has the edges that the board's own has on other boards' planes, to within EXACT."""
    return all(
        _length_on(path, s, EXACT) >= COVERED * _length_on(board.path, s, ON_SEGMENT)
        for s in board.segments if s.origin in HARD
    )


def _lines(path: CutPath) -> list[Line]:
    return [e for loop in (path.outer, *path.holes) for e in loop.edges if isinstance(e, Line)]


def _length_on(path: CutPath, segment: ConstraintSegment, within: float) -> float:
    """Length of the lines of a path that lie along a segment."""
    along, inward, length = segment_axes(segment)
    total = 0.0
    for line in _lines(path):
        x = np.array([line.start, line.end]) - segment.start
        if np.abs(x @ inward).max() <= within:
            total += max(0.0, min(length, (x @ along).max()) - max(0.0, (x @ along).min()))
    return total
