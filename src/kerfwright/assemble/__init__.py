"""How the boards meet, and what follows for their shapes (paper, Assembly Refinement)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from kerfwright.assemble.options import AssembleOptions, Stock
from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.capture.types import Capture, Cloud
from kerfwright.identify.types import Parts, Sheet

if TYPE_CHECKING:
    from kerfwright.assemble.decided import Decided
    from kerfwright.identify.freespace import FreeSpace
    from kerfwright.identify.photo_edges import Photos
    from kerfwright.model import Finding

__all__ = ["AssembleOptions", "Assembly", "ConstraintSegment", "Stock", "assemble"]


def assemble(parts: Parts, capture: Capture, options: AssembleOptions | None = None) -> Assembly:
    """Find the boards' contacts and derive constraint segments.

    Boards that were traced in photographs are aligned first, as identification has aligned rough ones; raises
    StageError when that does not converge.
    """
    from kerfwright.assemble.contacts import to_contact
    from kerfwright.assemble.inferred import told
    from kerfwright.assemble.laid import laid_contacts
    from kerfwright.assemble.veils import still_open, unveiled
    from kerfwright.identify.align import align_sheets
    from kerfwright.identify.depths import remeasured
    from kerfwright.identify.freespace import see_through
    from kerfwright.identify.photo_edges import Photos

    options = options or AssembleOptions()
    diameter = capture.cloud.diameter
    free = see_through(capture, parts.spacing, max(5 * parts.noise, diameter / 150))
    photos = Photos(capture)
    if options.rough:
        sheets, edges = unveiled(parts.sheets, capture.cloud, photos, options)
    else:
        sheets, _ = align_sheets(parts.sheets, capture.cloud, options)
        sheets, edges = remeasured(sheets, capture.cloud, photos, parts.noise), tuple(() for _ in sheets)
    sheets = _with_hidden_faces(sheets, capture.cloud, photos, free, options)
    sheets, decided, segments, findings = _met(sheets, parts.ends, capture.cloud, photos, free, options)
    sheets, decided, segments = _held(sheets, decided, segments, capture.cloud, photos, free, options)
    if options.stock.sizes:
        sheets, decided, segments = _snapped(sheets, decided, capture.cloud, free, parts.noise, options)
    laid = laid_contacts(sheets, options.min_contact * diameter)
    contacts = (*(to_contact(d, sheets) for d in decided), *laid)
    edges = still_open(edges, segments)
    findings = (*findings, *told(contacts))
    return Assembly(sheets, contacts, tuple(a + b for a, b in zip(segments, edges, strict=True)), findings)


def _with_hidden_faces(
    sheets: tuple[Sheet, ...], cloud: Cloud, photos: Photos, free: FreeSpace, options: AssembleOptions
) -> tuple[Sheet, ...]:
    """The boards with gaps of the cloud filled, thicknesses shared, and faces where others hide them."""
    from kerfwright.assemble.backs import measured_backs
    from kerfwright.assemble.flush import flush_neighbours
    from kerfwright.assemble.stock import share_thickness
    from kerfwright.identify.covered import backed_by_ends
    from kerfwright.identify.gaps import mended
    from kerfwright.identify.laid import laid_on

    sheets = measured_backs(sheets, cloud, photos, free, options)
    sheets = backed_by_ends(mended(sheets, cloud, free, options), cloud.diameter, options)
    sheets = flush_neighbours(share_thickness(sheets, cloud.diameter, options), cloud.diameter, options)
    return laid_on(sheets, cloud, free, options)


def _held(
    sheets: tuple[Sheet, ...], decided: list[Decided], segments: tuple[tuple[ConstraintSegment, ...], ...],
    cloud: Cloud, photos: Photos, free: FreeSpace, options: AssembleOptions,
) -> tuple[tuple[Sheet, ...], list[Decided], tuple[tuple[ConstraintSegment, ...], ...]]:
    """The boards with those that nothing holds joined to the others, where nothing contradicts it."""
    from kerfwright.assemble.constraints import constraint_segments
    from kerfwright.assemble.inferred import joined_up, marked
    from kerfwright.identify.reaching import Scene
    from kerfwright.identify.visibility import Obstacles

    obstacles = Obstacles(sheets, options.outline_error * cloud.diameter)
    held, joined = joined_up(Scene(sheets, cloud, photos, obstacles, free, options), decided)
    joined = marked(joined, held, cloud.diameter)
    if all(one is other for one, other in zip(held, sheets, strict=True)):
        return sheets, joined, segments
    segments = constraint_segments(held, joined, cloud.diameter, options)
    return _run_on(held, segments, options.far_reach * cloud.diameter), joined, segments


def _snapped(
    sheets: tuple[Sheet, ...], decided: list[Decided], cloud: Cloud, free: FreeSpace, noise: float,
    options: AssembleOptions,
) -> tuple[tuple[Sheet, ...], list[Decided], tuple[tuple[ConstraintSegment, ...], ...]]:
    """The boards of stock thicknesses, with their contacts and segments on the faces that they then have."""
    from kerfwright.assemble.constraints import constraint_segments
    from kerfwright.assemble.flush import flush_neighbours
    from kerfwright.assemble.snap import moved_with, snapped_to_stock
    from kerfwright.identify.laid import laid_on

    sheets = flush_neighbours(snapped_to_stock(sheets, decided, noise, options), cloud.diameter, options)
    sheets = laid_on(sheets, cloud, free, options)
    decided = moved_with(sheets, decided)  # last of all: segments lie on the faces that the boards have in the end
    return sheets, decided, constraint_segments(sheets, decided, cloud.diameter, options)


def _met(
    sheets: tuple[Sheet, ...], ends: tuple[tuple[str, str], ...], cloud: Cloud, photos: Photos, free: FreeSpace,
    options: AssembleOptions,
) -> tuple[tuple[Sheet, ...], list[Decided], tuple[tuple[ConstraintSegment, ...], ...], tuple[Finding, ...]]:
    """Contacts and constraint segments, looked for again once boards were run on to what they end on, until no contact
    changes; and the boards. Findings tell of contacts that had not come to rest after as many passes as there may be.
    """
    from kerfwright.assemble.constraints import constraint_segments
    from kerfwright.assemble.contacts import find_contacts
    from kerfwright.assemble.settled import unsettled

    decided: list[Decided] = []
    changed: tuple[Finding, ...] = ()
    for number in range(options.most_passes):
        before, decided = decided, find_contacts(sheets, cloud, photos, free, options, decided, ends)
        segments = constraint_segments(sheets, decided, cloud.diameter, options)
        filled = _run_on(sheets, segments, options.far_reach * cloud.diameter)
        if all(a.region.equals(b.region) for a, b in zip(sheets, filled, strict=True)):
            return sheets, decided, segments, ()
        sheets, changed = filled, unsettled(before, decided, sheets)
        if number and not changed:
            break
    return sheets, decided, segments, changed


def _run_on(
    sheets: tuple[Sheet, ...], constraints: tuple[tuple[ConstraintSegment, ...], ...], reach: float
) -> tuple[Sheet, ...]:
    """The sheets with their regions run on to what they end on: what stereo lost in the dark between them comes back.
    """
    from kerfwright.identify.outlines import filled_region

    known = [tuple(s for s in segments if s.origin in ("contact", "ground")) for segments in constraints]
    return tuple(
        replace(sheet, region=filled_region(sheet.region, segments, reach))
        for sheet, segments in zip(sheets, known, strict=True)
    )
