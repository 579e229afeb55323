"""Options of assembly."""

from __future__ import annotations

from dataclasses import dataclass

from kerfwright.identify.options import WholeOptions

__all__ = ["AssembleOptions", "Stock"]


@dataclass(frozen=True)
class Stock:
    """Thicknesses that boards are sold in, in the stages' units; none where the scale is not known."""

    sizes: tuple[float, ...] = ()
    scale_error: float = 0.0  # relative standard error of the scale


@dataclass(frozen=True)
class AssembleOptions(WholeOptions):
    """What assembly may be told; lengths are fractions of the cloud's largest side D."""

    most_passes: int = 5  # contacts are looked for again until none changes, but no more often than this
    rough: bool = True  # outlines are the cloud's: veils are looked for
    thickness_sigmas: float = 3.0
    stock: Stock = Stock()
    stock_sigmas: float = 2.0  # standard errors within which exactly one stock size must lie
    thickness_floor: float = 1 / 1500  # least standard error of a thickness: eased edges hide part of it
    seed: int = 0
