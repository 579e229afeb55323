"""Outlines and assembly in turn (paper, Overview: alternate optimisation)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from shapely import union_all
from shapely.geometry import Polygon

from kerfwright.assemble import AssembleOptions, assemble
from kerfwright.assemble.abutting import with_abutting
from kerfwright.assemble.apart import kept_apart
from kerfwright.assemble.concave import find_inner_seams, inner_corners
from kerfwright.assemble.rings import find_ring_seams, split_ring
from kerfwright.assemble.splits import (
    SeamLine,
    SeamSearch,
    find_seam_lines,
    seam_contact,
    seam_segments,
    split_sheet,
)
from kerfwright.assemble.types import Assembly
from kerfwright.capture.types import Capture
from kerfwright.identify.coplanar import in_one_plane, moved_region, united, with_own_points
from kerfwright.identify.freespace import see_through
from kerfwright.identify.outlines import constrained_region, largest_piece
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.types import Parts, Sheet
from kerfwright.identify.visibility import Obstacles
from kerfwright.parallel import each
from kerfwright.refine.constrain import outline_region
from kerfwright.refine.options import RefineOptions
from kerfwright.refine.segment import SegmentOptions, segment_boards
from kerfwright.refine.types import Outline

__all__ = ["assembled_again", "traced_pieces"]

LEVEL = 1 / 250  # of D, between the faces of pieces in one plane
SHARED = 0.15  # of the smaller of two pieces in one plane, which they share when they are one board
RUN_TOGETHER = 0.005  # ... where both have inner corners
# outlines from photographs are this much better than the cloud's
EXACT = AssembleOptions(rough=False, outline_error=1 / 200, reach=1 / 60, thickness_floor=1 / 4000)


@dataclass(frozen=True, eq=False)
class Piece:
    """A board after the photographs, the outline it came from, and the seam to the piece `before` places before it."""

    sheet: Sheet
    outline: Outline
    seam: SeamLine | None = None
    before: int = 1


def traced_pieces(
    assembly: Assembly, parts: Parts, capture: Capture, options: RefineOptions
) -> tuple[Piece, ...]:
    """The boards with what the photographs show of their outlines; those with seams in them taken apart."""
    diameter = capture.cloud.diameter
    assembly = assembly if options.use_constraints else _unconstrained(assembly)
    free = see_through(capture, parts.spacing, max(5 * parts.noise, diameter / 150))
    segmenting = SegmentOptions(use_images=options.use_images, max_views=options.views_a_board)
    found = segment_boards(assembly.sheets, assembly.constraints, capture, segmenting, free)
    pieces = []
    for sheet, segments, board in zip(assembly.sheets, assembly.constraints, found, strict=True):
        known = segments if board.fallback else tuple(s for s in segments if s.origin != "photo")  # traced, and better
        for outline in board.outlines:
            region = constrained_region(outline_region(outline), known, diameter / 6, diameter / 20)
            own = replace(sheet, region=region)
            if len(board.outlines) > 1:
                own = with_own_points(own, capture.cloud.points, diameter / 200)
            pieces.append(Piece(own, outline))
    pieces = _one_where_they_overlap(pieces, diameter)
    if options.use_images and options.use_seams:
        pieces = _split(pieces, assembly, capture)
    return tuple(replace(p, sheet=replace(p.sheet, name=f"board_{k + 1:02d}")) for k, p in enumerate(pieces))


def _one_where_they_overlap(pieces: Sequence[Piece], diameter: float) -> list[Piece]:
    """The pieces, those joined that lie in one plane and share wood: two boards do not, and the photographs showed both
    that they reach there.
    """
    out: list[Piece] = []
    for piece in pieces:
        k = next((k for k, other in enumerate(out) if _share_wood(other.sheet, piece.sheet, diameter)), None)
        if k is None:
            out.append(piece)
        else:
            out[k] = _joined(out[k], piece)
    return out


def _share_wood(a: Sheet, b: Sheet, diameter: float) -> bool:
    """Whether two pieces are one board: much of one lies in the other, or both have inner corners and run together in
    the middle of what they reach out for, as two legs do for the rail between them.
    """
    if not in_one_plane(a, b, LEVEL * diameter):
        return False
    shared = a.region.intersection(moved_region(b, a)).area / min(a.region.area, b.region.area)
    bent = all(len(inner_corners(s.region, diameter)) for s in (a, b))
    return bool(shared > (RUN_TOGETHER if bent else SHARED))


def _joined(a: Piece, b: Piece) -> Piece:
    """Two pieces as one, in the frame of the first."""
    region = largest_piece(union_all([a.sheet.region, moved_region(b.sheet, a.sheet)]))
    loops = tuple(replace(loop, points=_moved(loop.points, b.sheet, a.sheet)) for loop in b.outline.loops)
    outline = replace(a.outline, loops=(*a.outline.loops, *loops))
    return Piece(united(a.sheet, b.sheet, region), outline)


def _moved(xy: np.ndarray, sheet: Sheet, to: Sheet) -> np.ndarray:
    return to.to_board(sheet.to_world(np.c_[xy, np.zeros(len(xy))]))[:, :2]


def assembled_again(
    pieces: Sequence[Piece], parts: Parts, capture: Capture, options: RefineOptions
) -> tuple[tuple[Outline, ...], Assembly]:
    """One outline a board and the assembly found with them."""
    found = replace(parts, sheets=tuple(p.sheet for p in pieces), ends=())
    again = assemble(found, capture, replace(EXACT, stock=options.stock))
    again = with_abutting(_with_seams(again, pieces), capture.cloud.diameter)
    again = kept_apart(again, capture.cloud.diameter)
    if not options.use_constraints:
        again = _unconstrained(_with_regions(again, [p.sheet.region for p in pieces]))
    return tuple(p.outline for p in pieces), again


def _unconstrained(assembly: Assembly) -> Assembly:
    """The assembly with nothing that its contacts say of cut paths."""
    return replace(assembly, constraints=tuple(() for _ in assembly.sheets))


def _with_regions(assembly: Assembly, regions: Sequence[Polygon]) -> Assembly:
    """The assembly with its boards cut to other regions: those that they had before they were run on to contacts."""
    sheets = zip(assembly.sheets, regions, strict=True)
    return replace(assembly, sheets=tuple(replace(sheet, region=region) for sheet, region in sheets))


def _split(pieces: list[Piece], assembly: Assembly, capture: Capture) -> list[Piece]:
    """Pieces with the boards that show seams taken apart."""
    diameter, photos = capture.cloud.diameter, Photos(capture)
    obstacles = Obstacles([p.sheet for p in pieces], diameter / 100)

    def taken_apart(piece: Piece) -> list[Piece]:
        ring = _ring_boards(piece, photos, obstacles, capture)
        if ring:
            return ring
        touching = _touching(piece.sheet.name, assembly)
        search = SeamSearch(piece.sheet, touching, photos, obstacles, diameter)
        seams = find_seam_lines(search) or find_inner_seams(search)
        if not seams:
            return [piece]
        sheets = split_sheet(piece.sheet, seams, capture.cloud.points)
        return [Piece(s, piece.outline, seam) for s, seam in zip(sheets, [None, *seams], strict=True)]

    return [part for parts in each(taken_apart, pieces) for part in parts]


def _ring_boards(piece: Piece, photos: Photos, obstacles: Obstacles, capture: Capture) -> list[Piece]:
    """The boards of a frame that was found as one ring; the first one's seam leads to the last."""
    diameter = capture.cloud.diameter
    seams = find_ring_seams(piece.sheet, photos, obstacles, diameter)
    sheets = split_ring(piece.sheet, seams, capture.cloud.points, diameter) if seams else []
    return [
        Piece(own, piece.outline, seam, 1 if k else 1 - len(sheets))
        for k, (own, seam) in enumerate(zip(sheets, seams, strict=False))
    ]


def _touching(name: str, assembly: Assembly) -> list[Sheet]:
    names = {c.a if c.b == name else c.b for c in assembly.contacts if name in (c.a, c.b)}
    return [s for s in assembly.sheets if s.name in names]


def _with_seams(assembly: Assembly, pieces: Sequence[Piece]) -> Assembly:
    """The assembly with constraint segments for every seam between neighbouring pieces, and a contact where they touch.
    """
    contacts, constraints = list(assembly.contacts), [list(c) for c in assembly.constraints]
    for k, piece in enumerate(pieces):
        if piece.seam is None:
            continue
        touching = piece.seam.gap == 0
        other = k - piece.before
        before, after = seam_segments(piece.seam, len(contacts) if touching else None)
        constraints[other].append(before)
        constraints[k].append(after)
        if touching:
            contacts.append(seam_contact(assembly.sheets[other], assembly.sheets[k], piece.seam))
    return replace(assembly, contacts=tuple(contacts), constraints=tuple(tuple(c) for c in constraints))
