"""Thicknesses snapped to stock: where the scale is known, a board that measures 17.9 ± 0.2 mm is one of 18.

This is done while boards are assembled: contacts, constraint segments and cut paths are then placed on the faces that
the boards have in the end, so that nothing overlaps or gapes by what a thickness was changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kerfwright.assemble.decided import Decided
from kerfwright.assemble.flush_ends import flush_trace
from kerfwright.assemble.mitres import mitred
from kerfwright.assemble.options import AssembleOptions
from kerfwright.errors import StageError
from kerfwright.identify.faces import with_thickness
from kerfwright.identify.joints import Joint, face_plane, trace_of
from kerfwright.identify.types import Sheet
from kerfwright.model import Origin

__all__ = ["moved_with", "snapped_to_stock"]


def snapped_to_stock(
    sheets: tuple[Sheet, ...], decided: Sequence[Decided], noise: float, options: AssembleOptions
) -> tuple[Sheet, ...]:
    """The sheets, those whose thickness can be of one stock size only with that thickness.

    Boards of inferred thickness follow those that they were inferred from. The face that other boards end on stays
    where it is; of both, or none, the top.

    Parameters
    ----------
    decided : contacts, which tell the faces that are held.
    noise : standard deviation of the cloud across its surface: no thickness is known better than a plane is, and a
        plane drifts by as much.
    """
    sizes: dict[float, float] = {}
    for sheet in sheets:
        if sheet.thickness.origin in (Origin.MEASURED, Origin.SHARED):
            size = _only_size(sheet, noise, options)
            if size is not None:
                sizes[sheet.thickness.value] = size
    held = {(d.joint.a, d.joint.face_a) for d in decided}
    return tuple(
        _snapped(sheet, sizes[sheet.thickness.value], (k, "bottom") in held and (k, "top") not in held)
        if sheet.thickness.value in sizes else sheet
        for k, sheet in enumerate(sheets)
    )


def _only_size(sheet: Sheet, noise: float, options: AssembleOptions) -> float | None:
    """The one stock size within the thickness's uncertainty, if it is one."""
    thickness, stock = sheet.thickness, options.stock
    error = max(np.hypot(thickness.standard_error or 0.0, stock.scale_error * thickness.value), noise)
    near = [size for size in stock.sizes if abs(size - thickness.value) <= options.stock_sigmas * error]
    return near[0] if len(near) == 1 else None


def _snapped(sheet: Sheet, size: float, keep_bottom: bool) -> Sheet:
    origin = Origin.INFERRED if sheet.thickness.origin is Origin.INFERRED else Origin.SNAPPED
    moved = with_thickness(sheet, sheet.thickness.model_copy(update={"value": size, "origin": origin}))
    if keep_bottom:
        moved.world_from_board[:3, 3] = sheet.world_from_board[:3, 3]
    return moved


def moved_with(sheets: tuple[Sheet, ...], decided: Sequence[Decided]) -> list[Decided]:
    """The same contacts on sheets that were moved along their normals, or made thicker or thinner, since."""
    return [
        replace(d, joint=joint, other=other, flush=_moved_end(sheets, d.flush))
        for d in decided for joint, other in [_moved_pair(sheets, d)]
    ]


def _moved_end(sheets: tuple[Sheet, ...], end: Joint | None) -> Joint | None:
    trace = None if end is None else flush_trace(sheets, end)
    return None if trace is None else replace(end, trace=trace)


def _moved_pair(sheets: tuple[Sheet, ...], d: Decided) -> tuple[Joint, Joint | None]:
    if d.kind == 4:
        return mitred(sheets, d.joint, d.other)
    return _moved(sheets, d.joint), None if d.other is None else _moved(sheets, d.other)


def _moved(sheets: tuple[Sheet, ...], joint: Joint) -> Joint:
    """Positions along a trace stay: they are in the plane of the board that ends there."""
    trace = trace_of(sheets[joint.b], *face_plane(sheets[joint.a], joint.face_a))
    if trace is None:
        raise StageError(f"{sheets[joint.b].name}: turned while it was moved: report this as a bug")
    return replace(joint, trace=trace)
