"""Boards laid on one another, sheet on sheet (paper, Connections, type 3): cleats, rails under a seat, doubled panels.

The faces that touch are hidden by each other, so that the thickness of one of the boards is mostly a guess: its hidden
face is put where the other board's is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.coplanar import moved_region
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.joints import face_plane
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.types import Sheet
from kerfwright.model import Origin

__all__ = ["Pair", "facing_pairs", "is_seen_through", "laid_on", "put_on_plane", "share_seen"]

PARALLEL = 1 - 1e-9  # cosine: one class of the alignment
SEEN = 0.25  # share of the overlap that must show points of a face for it to count as seen
DEEPEST = 0.5  # overlap, of the thinner board's thickness: deeper ones are two finds of one board
FREE = 0.2  # share of a gap that cameras saw through


@dataclass(frozen=True, eq=False)
class Pair:
    """Face `face_a` of sheet a looks at `face_b` of sheet b across a gap, mm; overlap in a's board frame."""

    a: int
    b: int
    face_a: str
    face_b: str
    gap: float
    overlap: Polygon | MultiPolygon


@dataclass(frozen=True)
class _Link:
    """A hidden face, as (board, face), that is put on the plane of another."""

    hidden: tuple[int, str]
    other: tuple[int, str]


def laid_on(
    sheets: tuple[Sheet, ...], cloud: Cloud, free: FreeSpace, options: WholeOptions
) -> tuple[Sheet, ...]:
    """The sheets with hidden faces moved onto the faces that hide them; what hides them together is made flush."""
    links = []
    for pair in facing_pairs(sheets, options.min_contact * cloud.diameter):
        link = _link(pair, sheets, cloud, options)
        if link is not None and not is_seen_through(pair, sheets, free):
            links.append(link)
    for group in _groups(links):
        sheets = _on_one_plane(sheets, group, options.flush * cloud.diameter)
    return sheets


def _groups(links: list[_Link]) -> list[list[_Link]]:
    """Links that share a face, directly or through others: all their faces lie on one plane."""
    groups: list[list[_Link]] = []
    for link in links:
        near = [g for g in groups if any({link.hidden, link.other} & {other.hidden, other.other} for other in g)]
        groups = [g for g in groups if g not in near] + [[*(one for g in near for one in g), link]]
    return groups


def _on_one_plane(sheets: tuple[Sheet, ...], group: list[_Link], furthest: float) -> tuple[Sheet, ...]:
    """Hidden faces put on one plane: of the largest board that holds it, and of those within `furthest` mm of that one,
    which are moved to their common mean. A board further off stays, and the checker tells what it runs into.
    """
    hidden = {link.hidden for link in group}
    holding = sorted({link.other for link in group} - hidden) or sorted(hidden)
    normal = face_plane(sheets[holding[0][0]], holding[0][1])[0]
    offsets = np.array([_offset(sheets[k], face, normal) for k, face in holding])
    areas = np.array([sheets[k].region.area for k, _ in holding])
    near = np.abs(offsets - offsets[areas.argmax()]) <= furthest
    level = float(np.average(offsets[near], weights=areas[near]))
    moved = list(sheets)
    for (k, face), offset, beside in zip(holding, offsets, near, strict=True):
        if (k, face) not in hidden and beside:
            frame = moved[k].world_from_board.copy()
            frame[:3, 3] += (level - offset) * normal
            moved[k] = replace(moved[k], world_from_board=frame)
    for k, face in sorted(hidden):
        moved[k] = put_on_plane(moved[k], face, normal, level)
    return tuple(moved)


def _offset(sheet: Sheet, face: str, normal: np.ndarray) -> float:
    """Of a face's plane along a normal that is its own or the opposite one."""
    own, offset = face_plane(sheet, face)
    return offset if own @ normal > 0 else -offset


def facing_pairs(sheets: tuple[Sheet, ...], shortest: float, furthest: float = 0.0) -> list[Pair]:
    """Pairs of faces that look at each other, no further apart than the thinner board is thick or `furthest` mm, and
    overlap by at least `shortest` mm squared.
    """
    found = []
    for a in range(len(sheets)):
        for b in range(len(sheets)):
            if a == b or abs(sheets[a].normal @ sheets[b].normal) < PARALLEL:
                continue
            face_b = "bottom" if sheets[a].normal @ sheets[b].normal > 0 else "top"
            pair = _pair(sheets, a, b, "top", face_b, shortest, furthest)
            if pair is not None and (face_b == "bottom" or a < b):
                found.append(pair)
            if face_b == "top" and a < b:
                pair = _pair(sheets, a, b, "bottom", "bottom", shortest, furthest)
                found += [pair] if pair is not None else []
    return found


def _pair(
    sheets: tuple[Sheet, ...], a: int, b: int, face_a: str, face_b: str, shortest: float, furthest: float
) -> Pair | None:
    """The two faces, if they look at each other closely and overlap."""
    one, other = sheets[a], sheets[b]
    offset = face_plane(one, face_a)[1]
    gap = float(-face_plane(other, face_b)[1]) - offset
    thinner = min(one.thickness.value, other.thickness.value)
    if not -DEEPEST * thinner < gap < max(thinner, furthest):
        return None
    overlap = one.region.intersection(moved_region(other, one))
    return Pair(a, b, face_a, face_b, gap, overlap) if overlap.area > shortest**2 else None


def _link(pair: Pair, sheets: tuple[Sheet, ...], cloud: Cloud, options: WholeOptions) -> _Link | None:
    """Which board's face is put where the other's is: the one nobody sees; None where both are seen apart."""
    faces = ((pair.a, pair.face_a), (pair.b, pair.face_b))
    seen = [share_seen(sheets[k], face, pair, sheets[pair.a], cloud, options) for k, face in faces]
    if min(seen) > SEEN:
        return None
    areas = [sheets[k].region.area for k, _ in faces]
    first = (seen[0] > SEEN, areas[0]) < (seen[1] > SEEN, areas[1])
    return _Link(*(faces if first else faces[::-1]))


def share_seen(sheet: Sheet, face: str, pair: Pair, frame: Sheet, cloud: Cloud, options: WholeOptions) -> float:
    """Share of the overlap that shows points of the face."""
    idx = sheet.top_idx if face == "top" else sheet.bottom_idx
    xy = frame.to_board(cloud.points[idx])[:, :2]
    inner = pair.overlap.buffer(-options.outline_error * cloud.diameter)
    if inner.is_empty or not len(xy):
        return 0.0
    cell = options.outline_error * cloud.diameter
    own = xy[shapely.contains_xy(inner, xy[:, 0], xy[:, 1])]
    cells = len(np.unique(np.floor(own / cell).astype(np.int64), axis=0)) if len(own) else 0
    return float(min(cells * cell**2 / inner.area, 1.0))


def is_seen_through(pair: Pair, sheets: tuple[Sheet, ...], free: FreeSpace) -> bool:
    """Whether cameras saw through the gap between the faces."""
    frame = sheets[pair.a]
    level = frame.thickness.value + pair.gap / 2 if pair.face_a == "top" else -pair.gap / 2
    low_x, low_y, high_x, high_y = pair.overlap.bounds
    grid = np.meshgrid(np.linspace(low_x, high_x, 40), np.linspace(low_y, high_y, 40))
    x, y = (g.ravel() for g in grid)
    inside = shapely.contains_xy(pair.overlap, x, y)
    if pair.gap <= 0 or not inside.any():
        return False
    places = frame.to_world(np.c_[x[inside], y[inside], np.full(int(inside.sum()), level)])
    return float((free.votes(places) >= 2).mean()) > FREE


def put_on_plane(sheet: Sheet, face: str, normal: np.ndarray, offset: float) -> Sheet:
    """The sheet as thick as it must be for a face of it to lie on a plane; its other face stays. Unchanged where that
    would take more than DEEPEST of its thickness.
    """
    place = sheet.to_board((normal * offset)[None])[0, 2]
    thickness = place if face == "top" else sheet.thickness.value - place
    if thickness < DEEPEST * sheet.thickness.value:
        return sheet  # no board is left between its faces
    frame = sheet.world_from_board.copy()
    if face == "bottom":
        frame[:3, 3] += place * sheet.normal
    quantity = sheet.thickness.model_copy(update={"value": float(thickness), "origin": Origin.IMPLIED})
    return replace(sheet, world_from_board=frame, thickness=quantity)
