"""The report's cut sheets: how the boards can be laid on stock. Whoever lays them hands them over; the report draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from kerfwright.model import Loop
from kerfwright.model.geometry import sample_loop
from kerfwright.report.drawing import loop_path

__all__ = ["CutSheet", "LaidPart", "sheets_section"]


@dataclass(frozen=True)
class LaidPart:
    """A board's loops in the sheet's frame, the outline last, mm."""

    name: str
    loops: tuple[Loop, ...]


@dataclass(frozen=True)
class CutSheet:
    """A sheet of stock, lower left corner at the origin, mm; `used` is the share that becomes boards."""

    thickness: float
    length: float
    width: float
    used: float
    parts: tuple[LaidPart, ...]


def sheets_section(sheets: Sequence[CutSheet], problem: str = "") -> str:
    """A drawing a sheet; or why there is none."""
    if not sheets:
        return f"<h2>Cut sheets</h2><p>{escape(problem)}</p>" if problem else ""
    figures = "".join(_figure(sheet) for sheet in sheets)
    return (
        f'<h2>Cut sheets</h2><div class="sheets">{figures}</div>'
        '<p class="sum">Write them as DXF, SVG and PDF, for sheets of another size, kerf or grain: '
        "<code>kerfwright export model.json sheets -o DIR</code></p>"
    )


def _figure(sheet: CutSheet) -> str:
    letter = sheet.length / 60
    inside = [f'<rect class="stock" width="{sheet.length:g}" height="{sheet.width:g}"/>']
    for part in sheet.parts:
        inside.append(f'<path class="wood" fill-rule="evenodd" d="{" ".join(map(loop_path, part.loops))}"/>')
        inside.append(_name(part, letter))
    rim = letter / 2
    box = f"{-rim:g} {-sheet.width - rim:g} {sheet.length + 2 * rim:g} {sheet.width + 2 * rim:g}"
    count = f"{len(sheet.parts)} board{'s' if len(sheet.parts) != 1 else ''}"
    return (
        f'<figure><svg viewBox="{box}" role="img"><g transform="scale(1,-1)">{"".join(inside)}</g></svg>'
        f"<figcaption>{sheet.length:g} × {sheet.width:g} × {sheet.thickness:.1f} mm: {count}, "
        f"{100 * sheet.used:.0f} % used</figcaption></figure>"
    )


def _name(part: LaidPart, letter: float) -> str:
    """In the middle of the board, along its longer side."""
    points = sample_loop(part.loops[-1])
    (x, y), (width, height) = (points.min(axis=0) + points.max(axis=0)) / 2, np.ptp(points, axis=0)
    turn = " rotate(-90)" if height > width else ""
    size = min(letter, 1.5 * max(width, height) / max(1, len(part.name)), 0.8 * min(width, height))
    return (
        f'<text class="overall" transform="translate({x:.1f},{y:.1f}) scale(1,-1){turn}" font-size="{size:.1f}" '
        f'dy="{0.35 * size:.1f}">{escape(part.name)}</text>'
    )
