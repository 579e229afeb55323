"""The model that a stage alone would give: its rough boards with straight-edged outlines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from kerfwright.cache import read_kept
from kerfwright.errors import OptionError, OutputError
from kerfwright.model import Board, CutPath, Line, Loop, Model
from kerfwright.model.frames import rows
from kerfwright.model.io import read_model

if TYPE_CHECKING:
    from kerfwright.capture.types import Capture
    from kerfwright.identify.types import Sheet
    from kerfwright.model import Contact

__all__ = ["STAGES", "rough_model", "stage_model"]

STAGES = ("identify", "assemble", "refine")
OUTLINE_MM = 0.3  # rough outlines are ragged by several; thousands of edges would only slow their scoring down


def stage_model(folder: Path, stage: str | None) -> Model:
    """The finished model of an output folder, or what one of its stages knew; from .cache, which must be there then.

    Raises
    ------
    OptionError
        If there is no such stage.
    OutputError
        If the stage's result is not in the folder's cache.
    """
    if stage in (None, "refine"):
        return read_model(folder / "model.json")
    if stage not in STAGES:
        raise OptionError(f"stage: {stage}: not known: take one of {', '.join(STAGES)}")
    result, capture = (_kept(folder, name) for name in (stage, "capture"))
    return rough_model(folder.name, result.sheets, capture, getattr(result, "contacts", ()))


def rough_model(name: str, sheets: Sequence[Sheet], capture: Capture, contacts: Sequence[Contact] = ()) -> Model:
    """Rough boards as a model in the working units of the stages."""
    boards = tuple(sheet_board(sheet) for sheet in sheets)
    pose = rows(capture.capture_from_world)
    return Model(name=name, boards=boards, contacts=tuple(contacts), capture_from_model=pose)


def _kept(folder: Path, stage: str):
    found = read_kept(folder / ".cache", stage)
    if found is None:
        raise OutputError(
            f"{folder / '.cache'}: {stage}: no result kept: run reconstruct again with this output folder"
        )
    return found


def sheet_board(sheet: Sheet) -> Board:
    """A rough board with its region as cut path; of several pieces the largest."""
    polygon = max(shapely.get_parts(sheet.region), key=lambda p: p.area)
    polygon = shapely.orient_polygons(polygon.simplify(OUTLINE_MM))
    path = CutPath(outer=_loop(polygon.exterior), holes=tuple(_loop(ring) for ring in polygon.interiors))
    return Board(
        name=sheet.name,
        model_from_board=rows(sheet.world_from_board),
        thickness=sheet.thickness,
        cut_path=path,
    )


def _loop(ring: shapely.LinearRing) -> Loop:
    points = [tuple(map(float, p)) for p in np.asarray(ring.coords)[:-1]]
    return Loop(edges=tuple(Line(start=a, end=b) for a, b in zip(points, points[1:] + points[:1], strict=True)))
