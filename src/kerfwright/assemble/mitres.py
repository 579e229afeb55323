"""Mitres: two boards whose ends are bevelled so that they meet in the plane through their corner's inner and outer line
(type 4, cut on cut; paper, Connections).

From outside a mitre shows nothing but the corner: the seam of a butt joint, one thickness away from it, is missing on
both outer faces. The end faces, where both boards end flush, show a seam from the inner to the outer corner.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import Polygon

from kerfwright.identify.joints import Joint, face_plane, trace_of
from kerfwright.identify.photo_edges import Photos, sweep_edge
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles

__all__ = ["CornerLines", "EndFace", "corner_lines", "look_for_mitre", "mitred", "overlapping"]

FAR = 1e4  # mm; longer than any board
SWEPT = 20  # places along a line across an end face, which is as wide as a board is thick
# shares of the lines that are swept, and of their length that they are swept to either side, so that no silhouette is
# crossed: a sweep of the diagonal leaves the wood near the outer corner
DIAGONAL, DIAGONAL_REACH = (0.08, 0.6), 0.36
STRAIGHT, STRAIGHT_REACH = (0.15, 0.85), 0.42
GRAZING = 0.25  # least cosine between an end face's normal and the line of sight
REACHED = 0.5  # of the way from the other board's inner face to the outer corner that an outline must cover


@dataclass(frozen=True)
class EndFace:
    """What photographs show on the end faces of a corner: strengths in units of what is found beside each line.

    mitre: from the inner to the outer corner; butt: the better of the two that run an inner face on.
    """

    mitre: float
    butt: float
    views: int


@dataclass(frozen=True, eq=False)
class CornerLines:
    """The four lines along `axis` (unit, world) in which the sheet planes of two boards meet, each by its foot (3,) on
    the plane through the origin square to the axis.

    inner, outer : of the two inner faces, and of the two outer ones.
    seam_b, seam_a : where b's outer face meets a's inner one, the seam when b ends on a; and the other way round.
    """

    axis: np.ndarray
    inner: np.ndarray
    outer: np.ndarray
    seam_b: np.ndarray
    seam_a: np.ndarray
    into_b: np.ndarray  # (3,) unit, square to the axis, in b's plane away from the corner
    into_a: np.ndarray

    @property
    def normal(self) -> np.ndarray:
        """Unit normal of the mitre's plane, from a to b."""
        across = np.cross(self.axis, self.outer - self.inner)
        across = across / np.linalg.norm(across)
        return across if across @ self.into_b > 0 else -across


def corner_lines(sheets: tuple[Sheet, ...], first: Joint, second: Joint) -> CornerLines:
    """The lines of a corner at which b may end on a (`first`), or a on b (`second`)."""
    a, b = sheets[first.a], sheets[first.b]
    (normal_a, offset_a), (normal_b, offset_b) = face_plane(a, first.face_a), face_plane(b, second.face_a)
    axis = np.cross(normal_a, normal_b)
    axis = axis / np.linalg.norm(axis)
    planes = np.stack([normal_a, normal_b, axis])

    def foot(depth_a: float, depth_b: float) -> np.ndarray:
        return np.linalg.solve(planes, [offset_a - depth_a, offset_b - depth_b, 0.0])

    into_b, into_a = np.cross(axis, normal_b), np.cross(axis, normal_a)
    return CornerLines(
        axis, foot(0, 0), foot(a.thickness.value, b.thickness.value), foot(0, b.thickness.value),
        foot(a.thickness.value, 0), into_b if into_b @ normal_a > 0 else -into_b,
        into_a if into_a @ normal_b > 0 else -into_a,
    )  # fmt: skip


def mitred(sheets: tuple[Sheet, ...], first: Joint, second: Joint) -> tuple[Joint, Joint]:
    """The two joints of a corner moved onto the mitre's plane: in b, and in a; gaps of ragged outlines are closed.

    Boards of one thickness meet in the plane that halves their angle.
    """
    lines = corner_lines(sheets, first, second)
    first, second = _closed(sheets, first, second, lines.axis)
    normal, offset = lines.normal, float(lines.normal @ lines.inner)
    in_b = trace_of(sheets[first.b], normal, offset)
    in_a = trace_of(sheets[first.a], -normal, -offset)
    if in_a is None or in_b is None:
        raise ValueError("mitre: lies in a sheet plane: the two boards are all but parallel")
    return replace(first, trace=in_b), replace(second, trace=in_a)


def _closed(sheets: tuple[Sheet, ...], first: Joint, second: Joint, axis: np.ndarray) -> tuple[Joint, Joint]:
    """The joints without gaps that are narrow, or that the other board's outline covers."""
    narrow = 2 * max(sheets[j.b].thickness.value for j in (first, second))
    scales = [_along_axis(sheets[j.b], j, axis) for j in (first, second)]
    spans = [
        [sorted((sign * low + start, sign * high + start)) for low, high in joint.intervals]
        for joint, (sign, start) in zip((first, second), scales, strict=True)
    ]
    runs: list[list[float]] = []
    for low, high in sorted(spans[0] + spans[1]):
        if runs and low - runs[-1][1] <= narrow:
            runs[-1][1] = max(runs[-1][1], high)
        else:
            runs.append([low, high])
    closed = []
    for joint, (sign, start), own in zip((first, second), scales, spans, strict=True):
        held = [[x for span in own if low <= span[0] <= high for x in span] for low, high in runs]
        back = [sorted((sign * (min(h) - start), sign * (max(h) - start))) for h in held if h]
        closed.append(replace(joint, intervals=tuple((low, high) for low, high in sorted(back))))
    return closed[0], closed[1]


def _along_axis(board: Sheet, joint: Joint, axis: np.ndarray) -> tuple[float, float]:
    """Sign and start of a joint's own positions along the corner's axis: at = sign * position + start."""
    line = joint.trace.place(np.zeros(2), np.array([0.0, 1.0]))
    at = board.to_world(np.c_[line, np.full(2, joint.trace.depth)]) @ axis
    return float(np.sign(at[1] - at[0])), float(at[0])


def overlapping(sheets: tuple[Sheet, ...], first: Joint, second: Joint) -> bool:
    """Whether both boards' outlines reach the corner's outer line, as those of a mitre do."""
    outer = corner_lines(sheets, first, second).outer[None]
    places = [j.trace.coordinates(sheets[j.b].to_board(outer)[:, :2])[0][0] for j in (first, second)]
    return all(j.gap < REACHED * place for j, place in zip((first, second), places, strict=True))


def look_for_mitre(
    sheets: tuple[Sheet, ...], first: Joint, second: Joint, photos: Photos, obstacles: Obstacles, diameter: float,
    flush: float,
) -> EndFace:
    """The corner's end face that most photographs show; without views where the boards do not end within `flush` mm of
    each other, or no photograph shows it.
    """
    lines = corner_lines(sheets, first, second)
    extents = np.array([_extent(sheets, j, lines.axis) for j in (first, second)])
    found = [EndFace(0.0, 0.0, 0)]
    for side, sign in ((0, -1.0), (1, 1.0)):
        if np.ptp(extents[:, side]) <= flush:
            height = float(extents[:, side].mean())
            found.append(_end_face(lines, height, sign * lines.axis, photos, obstacles, diameter))
    return max(found, key=lambda face: (face.views, face.mitre))


def _extent(sheets: tuple[Sheet, ...], joint: Joint, axis: np.ndarray) -> tuple[float, float]:
    """From where to where the board that ends has wood beside the corner, along its axis."""
    board, trace = sheets[joint.b], joint.trace
    depth = sheets[joint.a].thickness.value / trace.sine
    band = [trace.place(np.full(2, x), np.array([-FAR, FAR])) for x in (-depth, depth)]
    near = shapely.get_coordinates(board.region.intersection(Polygon([*band[0], *band[1][::-1]])))
    if not len(near):
        return np.nan, np.nan
    along = trace.coordinates(near)[1]
    line = trace.place(np.zeros(2), np.array([along.min(), along.max()]))
    at = board.to_world(np.c_[line, np.full(2, trace.depth)]) @ axis
    return float(at.min()), float(at.max())


def _end_face(
    lines: CornerLines, height: float, outward: np.ndarray, photos: Photos, obstacles: Obstacles, diameter: float
) -> EndFace:
    lift = height * lines.axis
    across = [(lines.outer, DIAGONAL, DIAGONAL_REACH)]
    across += [(end, STRAIGHT, STRAIGHT_REACH) for end in (lines.seam_b, lines.seam_a)]
    shown = [
        _line_shown(lines.inner + lift, end + lift, shares, reach, outward, photos, obstacles, diameter)
        for end, shares, reach in across
    ]
    if shown[0] is None:
        return EndFace(0.0, 0.0, 0)
    return EndFace(shown[0][0], max((s[0] for s in shown[1:] if s is not None), default=0.0), shown[0][1])


def _line_shown(
    start: np.ndarray, end: np.ndarray, shares: tuple[float, float], reach: float, outward: np.ndarray, photos: Photos,
    obstacles: Obstacles, diameter: float,
) -> tuple[float, int] | None:
    """Strength of a line across an end face against what is found beside it, and the views; None where none does."""
    length = float(np.linalg.norm(end - start))
    places = start + np.linspace(*shares, SWEPT)[:, None] * (end - start)
    direction = np.cross(outward, (end - start) / length)
    offsets = np.arange(-reach * length, reach * length, diameter / 2000)
    near = np.abs(offsets) <= diameter / 400
    if near.all() or len(offsets) < 8:
        return None
    visible = obstacles.visible(photos.views, places, outward, GRAZING)
    sweep = sweep_edge(photos, places, direction, offsets, visible, smoothing=diameter / 1000)
    if sweep is None:
        return None
    return float(sweep.strength[near].max() / np.median(sweep.strength[~near])), sweep.views
