"""Boards side by side that stereo joined over the gap between them, parted at the groove that is left.

Stereo spans a gap of a few millimetres, but not quite: the surface sags between two boards, all along the gap. A
straight strip right across a region, in which the points lie below the sheet plane, or lean, and that no other board
stands in, is a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely
from scipy.ndimage import label
from shapely.geometry import Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.coplanar import with_own_points
from kerfwright.identify.outlines import largest_piece
from kerfwright.identify.types import Sheet

__all__ = ["parted"]

LEVEL = 1 / 1000  # of D, that points of a sheet face may lie off its plane
LEAN = np.cos(np.radians(20.0))  # ... and how far their normals
ACROSS = 1 / 250  # of D, a step across a groove
ALONG = 1 / 25  # of D, a stretch along it
FULL = 0.5  # of the usual number of points on the plane; a cell of a groove has fewer
SUNK = 0.3  # of the usual number of points that a stretch of a groove has below the plane, at least
UNBROKEN = 0.9  # share of the stretches that show a groove
BESIDE, CROSSED = 4, 0.6  # steps to both sides that tell how long a groove is, and the share of it that has points
DEEP = 1 / 40  # of D; what lies deeper is not the bottom of a groove
WIDTH = (1 / 150, 1 / 25)  # of D; eased edges of boards that touch make narrower grooves, and wider ones stereo sees
NARROWEST = 1 / 16  # of D; a narrower strip is no board
DENSE = 0.5  # of the density of points that the face seen best has: grooves of others are not looked for
TURNS = np.radians(np.arange(-1.5, 1.51, 0.25))  # ragged outlines turn their rectangles by as much
STANDING = 0.3  # cosine between the normals of a board and of one that stands on it, at most
ALONGSIDE = 3.0  # times the thickness of a board that stands along a groove, that it may reach across it


@dataclass(frozen=True, eq=False)
class _Groove:
    """The strip low < m.xy < high across a region, board frame mm."""

    m: np.ndarray
    low: float
    high: float


def parted(sheets: Sequence[Sheet], cloud: Cloud) -> tuple[tuple[Sheet, ...], dict[str, tuple[str, ...]]]:
    """The sheets, each that has grooves right across it as its pieces, numbered anew where there are such; and the new
    names by the old ones.
    """
    most = max((_density(s) for s in sheets), default=0.0)
    out: list[Sheet] = []
    for sheet in sheets:
        seen_well = _density(sheet) > DENSE * most
        grooves = _grooves(sheet, [s for s in sheets if s is not sheet], cloud) if seen_well else []
        out += _pieces(sheet, grooves, cloud) if grooves else [sheet]
    if len(out) == len(sheets):
        return tuple(sheets), {s.name: (s.name,) for s in sheets}
    numbered = tuple(replace(sheet, name=f"board_{k + 1:02d}") for k, sheet in enumerate(out))
    names = {s.name: tuple(new.name for old, new in zip(out, numbered, strict=True) if old.name == s.name) for s in out}
    return numbered, names


def _density(sheet: Sheet) -> float:
    return max(len(sheet.top_idx), len(sheet.bottom_idx)) / sheet.region.area


def _grooves(sheet: Sheet, others: Sequence[Sheet], cloud: Cloud) -> list[_Groove]:
    """Grooves across the sheet in the direction that shows most of them, and those widest, in order along it."""
    xy, on_plane, below = _looked_at(sheet, cloud)
    ring = np.asarray(sheet.region.minimum_rotated_rectangle.exterior.coords)
    side = (ring[1] - ring[0]) / np.linalg.norm(ring[1] - ring[0])
    best: list[_Groove] = []
    for first in (np.arctan2(side[1], side[0]), np.arctan2(side[0], -side[1])):
        for turn in TURNS:
            m = np.array([np.cos(first + turn), np.sin(first + turn)])
            found = _across(sheet, m, xy, on_plane, below, cloud.diameter)
            if (len(found), _width(found)) > (len(best), _width(best)):
                best = found
    return [groove for groove in best if not any(_stands_in(other, sheet, groove) for other in others)]


def _width(grooves: Sequence[_Groove]) -> float:
    return sum(g.high - g.low for g in grooves)


def _looked_at(sheet: Sheet, cloud: Cloud) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (N, 2) over and under the face that was seen better, which of them lie on its plane, and which below."""
    sign, level = (1.0, sheet.thickness.value) if len(sheet.top_idx) >= len(sheet.bottom_idx) else (-1.0, 0.0)
    x = sheet.to_board(cloud.points)
    height = sign * (x[:, 2] - level)
    idx = np.flatnonzero((height > -DEEP * cloud.diameter) & (height < DEEP * cloud.diameter))
    idx = idx[shapely.contains_xy(sheet.region, x[idx, 0], x[idx, 1])]
    lean = sign * (cloud.normals[idx] @ sheet.normal)
    slack = LEVEL * cloud.diameter
    return x[idx, :2], (np.abs(height[idx]) < slack) & (lean > LEAN), (height[idx] < -slack) & (lean > 0)


def _across(
    sheet: Sheet, m: np.ndarray, xy: np.ndarray, on_plane: np.ndarray, below: np.ndarray, size: float
) -> list[_Groove]:
    """Grooves square to m."""
    tangent = np.array([-m[1], m[0]])
    corners = np.asarray(sheet.region.exterior.coords)[:, :2]
    low = np.array([(corners @ m).min(), (corners @ tangent).min()])
    cell = np.array([ACROSS, ALONG]) * size
    shape = np.ceil((np.array([(corners @ m).max(), (corners @ tangent).max()]) - low) / cell).astype(int)
    at = np.floor((np.c_[xy @ m, xy @ tangent] - low) / cell).astype(int).clip(0, shape - 1)
    flat = at[:, 0] * shape[1] + at[:, 1]
    level, sunk = (np.bincount(flat[own], minlength=shape.prod()).reshape(shape) for own in (on_plane, below))
    wood = level + sunk > 0
    usual = float(np.median(level[wood])) if wood.any() else 0.0
    runs, count = label(_share(level < FULL * usual, wood) > UNBROKEN)
    found = []
    for number in range(1, count + 1):
        rows = np.flatnonzero(runs == number)
        groove = _Groove(m, low[0] + rows[0] * cell[0], low[0] + (rows[-1] + 1) * cell[0])
        sags = _share(sunk[rows].mean(axis=0, keepdims=True) > SUNK * usual, wood[rows].any(axis=0, keepdims=True))
        if WIDTH[0] * size < groove.high - groove.low < WIDTH[1] * size and sags[0] > UNBROKEN and _crosses(wood, rows):
            found.append(groove)
    edges = [low[0], *(v for g in found for v in (g.low, g.high)), low[0] + shape[0] * cell[0]]
    wide = [b - a > NARROWEST * size for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [g for g, before, after in zip(found, wide, wide[1:], strict=False) if before and after]


def _crosses(wood: np.ndarray, rows: np.ndarray) -> bool:
    """Whether the rows have points in most stretches of those beside: strays of a sparse cloud are no groove."""
    beside = wood[max(0, rows[0] - BESIDE) : rows[-1] + BESIDE + 1].any(axis=0)
    return bool(wood[rows].any(axis=0).sum() > CROSSED * beside.sum())


def _share(cells: np.ndarray, wood: np.ndarray) -> np.ndarray:
    """(R,) of the cells of each row that are wood, the share that some cells have."""
    return (cells & wood).sum(axis=1) / np.maximum(wood.sum(axis=1), 1)


def _stands_in(other: Sheet, sheet: Sheet, groove: _Groove) -> bool:
    """Whether a board that stands on the sheet does so in the groove, along it."""
    if abs(other.normal @ sheet.normal) > STANDING:
        return False
    ring = np.asarray(other.region.exterior.coords)[:, :2]
    corners = np.concatenate([np.c_[ring, np.full(len(ring), z)] for z in (0.0, other.thickness.value)])
    x = sheet.to_board(other.to_world(corners))
    reach = sheet.thickness.value / 2
    across = x[(x[:, 2] > -reach) & (x[:, 2] < sheet.thickness.value + reach), :2] @ groove.m
    if not len(across) or np.ptp(across) > ALONGSIDE * other.thickness.value:
        return False
    return bool(across.min() < groove.high and across.max() > groove.low)


def _pieces(sheet: Sheet, grooves: Sequence[_Groove], cloud: Cloud) -> list[Sheet]:
    """The boards between the grooves, largest first, each with its own points."""
    m, far = grooves[0].m, 4 * cloud.diameter
    tangent = np.array([-m[1], m[0]])
    edges = [-far, *(v for g in grooves for v in (g.low, g.high)), far]
    pieces = []
    for low, high in pairwise(edges):
        if any((low, high) == (g.low, g.high) for g in grooves):
            continue
        strip = Polygon([a * m + b * tangent for a, b in ((low, -far), (high, -far), (high, far), (low, far))])
        piece = replace(sheet, region=largest_piece(sheet.region.intersection(strip)))
        pieces.append(with_own_points(piece, cloud.points, cloud.diameter / 200))
    return sorted(pieces, key=lambda s: -s.region.area)
