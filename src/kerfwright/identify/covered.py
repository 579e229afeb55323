"""Places on a board that another board's end covers: nobody sees them, and stereo leaves a notch or a hole there.

The wood round a foot that stands against a frame was seen well, so that the notch behind it passes for a real one.
Where a board ends on a face, and the face goes on to both sides of that end, there is wood behind it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint, Polygon

from kerfwright.identify.joints import Trace, face_plane, trace_of
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.outlines import largest_piece
from kerfwright.identify.types import Sheet

__all__ = ["backed_by_ends", "end_sections"]

SQUARE = 0.5  # cosine between the normals of a board and of one that ends on it, at most
BESIDE = 0.6  # share of the strip on either side of an end that must be wood
GOES_ON = 0.3  # share of an end that may go on behind the board
FAR = 1e5  # mm; longer than any board


def backed_by_ends(sheets: Sequence[Sheet], diameter: float, options: WholeOptions) -> tuple[Sheet, ...]:
    """The sheets with wood behind the ends of others that stand on their faces."""
    slack = options.outline_error * diameter
    out = []
    for sheet in sheets:
        behind = [
            place for other in sheets if other is not sheet and abs(other.normal @ sheet.normal) < SQUARE
            for face in ("top", "bottom") for place in _covered(sheet, other, face, slack)
        ]
        region = largest_piece(shapely.union_all([sheet.region, *(p.buffer(0.05) for p in behind)])) if behind else None
        out.append(sheet if region is None else replace(sheet, region=region))
    return tuple(out)


def _covered(sheet: Sheet, other: Sheet, face: str, slack: float) -> list[Polygon]:
    """Where the other board ends on a face, in the board's plane, and the board's wood is missing but goes on beside.
    """
    found = []
    for line in _end_lines(sheet, other, face, slack):
        place = _section(sheet, other, line, 0.0)
        if sheet.region.covers(place):
            continue
        sides = [_section(sheet, other, line, shift * other.thickness.value) for shift in (-1.0, 1.0)]
        if all(side.intersection(sheet.region).area > BESIDE * side.area for side in sides):
            found.append(place)
    return found


def end_sections(sheet: Sheet, other: Sheet, slack: float) -> list[Polygon]:
    """Where the other board ends on either face of a sheet, in the sheet's plane; slack: mm that it may be short."""
    return [
        _section(sheet, other, line, 0.0)
        for face in ("top", "bottom") for line in _end_lines(sheet, other, face, slack)
    ]


def _end_lines(sheet: Sheet, other: Sheet, face: str, slack: float) -> list[LineString]:
    """Lines in the other board's plane along which it ends on a face, and does not go on behind the sheet."""
    trace = trace_of(other, *face_plane(sheet, face))
    if trace is None:
        return []
    behind = _chord(other, trace, -(sheet.thickness.value / trace.sine + slack))
    found = []
    for line in getattr(_chord(other, trace, slack), "geoms", []):
        on_plane = _shifted(line, -slack * trace.m)
        goes_on = behind.intersection(on_plane.buffer(2 * slack + sheet.thickness.value)).length
        if goes_on <= GOES_ON * line.length:
            found.append(on_plane)
    return found


def _chord(other: Sheet, trace: Trace, inside: float) -> shapely.MultiLineString:
    """What the line at some distance inside the trace has in common with a board's region."""
    ends = trace.place(np.full(2, inside), np.array([-FAR, FAR]))
    chord = other.region.intersection(LineString(ends))
    return shapely.MultiLineString([g for g in getattr(chord, "geoms", [chord]) if g.length > 0])


def _shifted(line: LineString, by: np.ndarray) -> LineString:
    return LineString(np.asarray(line.coords) + by)


def _section(sheet: Sheet, other: Sheet, line: LineString, shift: float) -> Polygon:
    """The board `other` cut along a line of its plane, moved by `shift` mm along its normal, in the sheet's plane."""
    xy = np.asarray(line.coords)
    corners = np.concatenate([np.c_[xy, np.full(2, z + shift)] for z in (0.0, other.thickness.value)])
    return MultiPoint(sheet.to_board(other.to_world(corners))[:, :2]).convex_hull
