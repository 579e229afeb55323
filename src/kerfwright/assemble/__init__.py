"""How the boards meet, and what follows for their shapes (paper, Assembly Refinement)."""

from __future__ import annotations

from kerfwright.assemble.options import AssembleOptions
from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.capture.types import Capture
from kerfwright.identify.types import Parts

__all__ = ["AssembleOptions", "Assembly", "ConstraintSegment", "assemble"]


def assemble(parts: Parts, capture: Capture, options: AssembleOptions | None = None) -> Assembly:
    """Align the boards, find their contacts and derive constraint segments.

    Raises StageError when the alignment does not converge.
    """
    from kerfwright.assemble.align import align_sheets
    from kerfwright.assemble.constraints import constraint_segments
    from kerfwright.assemble.contacts import find_contacts, to_contact
    from kerfwright.assemble.stock import share_thickness
    from kerfwright.identify.freespace import see_through
    from kerfwright.identify.photo_edges import Photos

    options = options or AssembleOptions()
    diameter = capture.cloud.diameter
    sheets, _ = align_sheets(parts.sheets, capture.cloud, options)
    sheets = share_thickness(sheets, diameter, options)
    free = see_through(capture, parts.spacing, max(5 * parts.noise, diameter / 150))
    decided = find_contacts(sheets, capture.cloud, Photos(capture), free, options)
    contacts = tuple(to_contact(d, sheets) for d in decided)
    return Assembly(sheets, contacts, constraint_segments(sheets, decided, diameter, options))
