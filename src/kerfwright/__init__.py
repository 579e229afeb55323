"""From photographs of a piece of carpentry to the plans to build it again.

>>> import kerfwright
>>> model = kerfwright.reconstruct("my-stool")      # doctest: +SKIP
>>> [board.name for board in model.boards]          # doctest: +SKIP
['board_01', 'board_02', 'board_03', 'board_04']
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from kerfwright.model import Model

__all__ = ["__version__", "reconstruct"]

__version__ = "0.1.0"


def reconstruct(
    capture: Path | str,
    *,
    up: str = "z",
    millimetres_per_unit: float | None = None,
    lengths: Sequence[str] = (),
    markers: str = "",
    stock: str = "",
    crop: str = "auto",
    ground: float | None = None,
    seed: int = 0,
) -> Model:
    """Reconstruct the boards of a capture; reads the folder, writes and prints nothing.

    Parameters
    ----------
    capture : folder with images, cameras and a cloud.
    up : axis of the capture that points up: x, y, z, -x, -y or -z.
    millimetres_per_unit : of the capture; None takes a unit for a metre.
    lengths : measured lengths that give the scale instead, such as "top:x=420mm".
    markers : markers in the photographs that give the scale instead, such as "4x4_50:40mm".
    stock : thicknesses to snap to where the scale is given: "metric", "inch", or a list such as "12,18,1/2in".
    crop : "auto", "none", or the box to keep in the cloud's coordinates: "X0,Y0,Z0,X1,Y1,Z1".
    ground : height of the floor along the up axis, capture units; None looks for it.
    seed : of the random generator.

    Raises
    ------
    kerfwright.errors.KerfwrightError when the capture cannot be used, or shows nothing that could be a board.
    """
    from kerfwright.pipeline import ReconstructOptions
    from kerfwright.pipeline import reconstruct as run

    options = ReconstructOptions(
        up=up, millimetres_per_unit=millimetres_per_unit, seed=seed, crop=crop, ground=ground, length=";".join(lengths),
        markers=markers, stock=stock,
    )  # fmt: skip
    return run(capture, options).model
