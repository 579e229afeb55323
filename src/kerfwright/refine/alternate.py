"""Outlines and assembly in turn, until no contact changes (paper, Overview: alternate optimisation)."""

from __future__ import annotations

from dataclasses import replace

from kerfwright.assemble import AssembleOptions, assemble
from kerfwright.assemble.types import Assembly
from kerfwright.capture.types import Capture
from kerfwright.identify.types import Parts
from kerfwright.refine.constrain import constrained_region, outline_region
from kerfwright.refine.options import RefineOptions
from kerfwright.refine.segment import SegmentOptions, segment_boards
from kerfwright.refine.types import Outline

__all__ = ["refined_assembly"]


def refined_assembly(
    assembly: Assembly, parts: Parts, capture: Capture, options: RefineOptions
) -> tuple[tuple[Outline, ...], Assembly]:
    """One outline a board and the assembly found with them."""
    diameter = capture.cloud.diameter
    found = segment_boards(assembly.sheets, assembly.constraints, capture, SegmentOptions(use_images=options.use_images))
    pieces = [
        (sheet, segments, outline)
        for sheet, segments, board in zip(assembly.sheets, assembly.constraints, found, strict=True)
        for outline in board.outlines
    ]
    outlines = tuple(outline for _, _, outline in pieces)
    sheets = []
    for number, (sheet, segments, outline) in enumerate(pieces):
        region = constrained_region(outline_region(outline), segments, diameter / 6, diameter / 20)
        sheets.append(replace(sheet, name=f"board_{number + 1:02d}", region=region))
    exact = AssembleOptions(outline_error=1 / 200, reach=1 / 60)
    again = assemble(replace(parts, sheets=tuple(sheets)), capture, exact)
    return outlines, again


