"""What contacts, corners and the ground say about each board's cut path (paper, Interface surfaces & constraints)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kerfwright.assemble.decided import Decided
from kerfwright.assemble.options import AssembleOptions
from kerfwright.assemble.severing import severs
from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.joints import Joint, Trace, face_plane, trace_of
from kerfwright.identify.run_on import floor_runs, floor_trace
from kerfwright.identify.types import Sheet

__all__ = ["constraint_segments"]

PLANE_ERROR = 0.15  # mm; standard error of an aligned sheet plane, of a board seen from half a metre


def constraint_segments(
    sheets: tuple[Sheet, ...], decided: list[Decided], diameter: float, options: AssembleOptions
) -> tuple[tuple[ConstraintSegment, ...], ...]:
    """Per board its constraint segments: contacts first, then corners, then the ground.

    A board that runs through a corner ends flush with the other one's outer face, unless a third one ends on it there.
    """
    out: list[list[ConstraintSegment]] = [[] for _ in sheets]
    traces = _pointed(sheets, decided)
    for number, d in enumerate(decided):
        out[d.joint.b] += _segments(traces[number], d.joint.intervals, "contact", number, d.joint.trace)
        if d.kind == 4:
            out[d.joint.a] += _segments(d.other.trace, d.other.intervals, "contact", number)
        elif d.flush is not None:
            out[d.joint.a] += _segments(d.flush.trace, d.flush.intervals, "corner", number)
        elif d.kind == 2 and not severs(sheets, d.other, d, decided):
            trace = _outer_trace(sheets, d)
            if trace is not None:
                out[d.joint.a] += _segments(trace, d.other.intervals, "corner", number)
    for k, sheet in enumerate(sheets):
        contacts = [d.joint for d in decided if d.joint.b == k]
        out[k] += _ground(sheet, contacts, diameter, options)
    return tuple(tuple(segments) for segments in out)


def _pointed(sheets: tuple[Sheet, ...], decided: list[Decided]) -> list[Trace]:
    """The contacts' traces; where two slanted planes end a board in a point, both are moved to the line of the point.
    """
    traces = [d.joint.trace for d in decided]
    for i, one in enumerate(decided):
        for j in range(i + 1, len(decided)):
            a, b = one.joint.trace, decided[j].joint.trace
            if one.joint.b != decided[j].joint.b or a.m @ b.m < 0.999 or a.slope * b.slope >= 0:
                continue
            base = [t.offset - t.slope * t.depth for t in (a, b)]
            height = (base[1] - base[0]) / (a.slope - b.slope)
            if 0 < height < sheets[one.joint.b].thickness.value:
                offset = base[0] + a.slope * height
                moved = [replace(t, offset=offset, depth=height) for t in (a, b)]
                traces[i], traces[j] = _on_one_line(moved, (one.joint, decided[j].joint))
    return traces


def _on_one_line(traces: list[Trace], joints: tuple[Joint, Joint]) -> list[Trace]:
    """Two traces along the same point of a board, which differ by the angle of their planes, in one direction: an edge
    lies on both.
    """
    m = traces[0].m + traces[1].m
    m = m / np.linalg.norm(m)
    middles = [
        t.place(np.zeros(1), np.array([(j.intervals[0][0] + j.intervals[-1][1]) / 2]))[0]
        for t, j in zip(traces, joints, strict=True)
    ]
    offset = float(np.mean([place @ m for place in middles]))
    return [replace(t, m=m, tangent=np.array([-m[1], m[0]]), offset=offset) for t in traces]


def _segments(
    trace: Trace, intervals: tuple[tuple[float, float], ...], origin: str, contact: int | None,
    plane: Trace | None = None,
) -> list[ConstraintSegment]:
    """Directed so that the wood lies on the left. `plane` is the trace before it was moved to the line of a point."""
    slanted = abs(trace.slope) > 1e-3
    segments = []
    for low, high in intervals:
        start, end = (trace.place(np.zeros(1), np.array([along]))[0] for along in (high, low))
        depth = _depth_of(plane, (start + end) / 2) if slanted and plane is not None else trace.depth
        segments.append(ConstraintSegment(
            start=start, end=end, origin=origin, standard_error=PLANE_ERROR, normal=trace.normal if slanted else None,
            depth=depth, contact=contact,
        ))
    return segments


def _depth_of(plane: Trace, place: np.ndarray) -> float:
    """The height at which a slanted plane passes a place of the board."""
    return float(plane.depth + (place @ plane.m - plane.offset) / plane.slope)


def _outer_trace(sheets: tuple[Sheet, ...], d: Decided) -> Trace | None:
    """Trace in the board that runs through of the outer face of the board that stops on it: there the corner closes."""
    b = sheets[d.joint.b]
    inner = d.other.face_a  # of b, on which a would have ended
    normal, offset = face_plane(b, "bottom" if inner == "top" else "top")
    return trace_of(sheets[d.joint.a], -normal, -offset)


def _ground(sheet: Sheet, contacts: list[Joint], diameter: float, options: AssembleOptions) -> list[ConstraintSegment]:
    """Where the board stands on the floor z = 0, unless it ends on another board there."""
    trace = floor_trace(sheet)
    if trace is None:
        return []
    runs = floor_runs(sheet, trace, contacts, diameter, options, traced=not options.rough)
    return _segments(trace, runs, "ground", None)
