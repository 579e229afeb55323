"""Slanted ends that are sawn flush: at a corner that is not square, the board that runs through may be bevelled so that
its end continues the outer face of the board that stops there. The cloud's points on that end tell.
"""

from __future__ import annotations

import numpy as np
import shapely

from kerfwright.capture.types import Cloud
from kerfwright.identify.joints import Joint, Trace, face_plane, trace_of
from kerfwright.identify.types import Sheet

__all__ = ["flush_end", "flush_trace"]

LEAST_SLOPE = 0.03  # mm a mm of thickness; a cut nearer to square is cut square
NEAR = 1 / 150  # of D; points further from the outer face's plane are none of the end's
OFF = 1 / 300  # of D by which most of them may miss it: the cloud drifts
FACING = 0.9  # cosine of their normals with the plane's
INNER = (0.1, 0.9)  # shares of the thickness between which the end is read: its edges are eased
BIN = 1 / 100  # of D, along the end
LEAST_BINS = 0.5  # share of them that must show the end
TURNED = 0.3  # of the angle to a square cut by which the points' own slant may miss the plane


def flush_trace(sheets: tuple[Sheet, ...], end: Joint) -> Trace | None:
    """Trace of board a's outer face in board b, which lies inside of it."""
    normal, offset = face_plane(sheets[end.a], end.face_a)
    return trace_of(sheets[end.b], -normal, -offset)


def flush_end(sheets: tuple[Sheet, ...], joint: Joint, outer: str, cloud: Cloud) -> Joint | None:
    """Where the board that `joint` ends on is itself bevelled flush with the outer face of the one that ends there.

    outer : face of joint.b on the outer side of the corner.

    Returns
    -------
    A joint whose b is the board that runs through and whose a is the one that stops; None where its end is square, lies
    elsewhere, or is not seen.
    """
    end = Joint(joint.b, joint.a, outer, joint.trace, (), 0.0, np.zeros((0, 2)))
    trace = flush_trace(sheets, end)
    if trace is None or abs(trace.slope) < LEAST_SLOPE:
        return None
    along, height, off = _end_points(sheets[joint.a], trace, *face_plane(sheets[joint.b], outer), cloud)
    count = len(np.unique(np.floor(along / (BIN * cloud.diameter))))
    if count < LEAST_BINS * joint.length / (BIN * cloud.diameter) or np.median(np.abs(off)) > OFF * cloud.diameter:
        return None
    turn = np.polyfit(height, off, 1)[0]
    square = trace.slope * trace.sine
    if abs(turn) > TURNED * abs(square):
        return None
    low, high = np.quantile(along, [0.01, 0.99])
    return Joint(end.a, end.b, outer, trace, ((float(low), float(high)),), 0.0, end.ends)


def _end_points(
    board: Sheet, trace: Trace, normal: np.ndarray, offset: float, cloud: Cloud
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points on the board's end: position along the trace, height in the board, distance from the plane, (N,) each."""
    off = cloud.points @ normal - offset
    near = np.flatnonzero((np.abs(off) < NEAR * cloud.diameter) & (cloud.normals @ normal > FACING))
    x = board.to_board(cloud.points[near])
    thickness = board.thickness.value
    inside = (x[:, 2] > INNER[0] * thickness) & (x[:, 2] < INNER[1] * thickness)
    inside &= shapely.contains_xy(board.region.buffer(2 * NEAR * cloud.diameter), x[:, 0], x[:, 1])
    return trace.coordinates(x[inside, :2])[1], x[inside, 2], off[near[inside]]
