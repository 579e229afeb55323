"""Options of assembly."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["AssembleOptions", "Stock"]


@dataclass(frozen=True)
class Stock:
    """Thicknesses that boards are sold in, in the stages' units; none where the scale is not known."""

    sizes: tuple[float, ...] = ()
    scale_error: float = 0.0  # relative standard error of the scale


@dataclass(frozen=True)
class AssembleOptions:
    """What assembly may be told; lengths are fractions of the cloud's largest side D."""

    rough: bool = True  # outlines are the cloud's: veils are looked for
    reach: float = 1 / 30  # boards that come this near each other are connected (paper, Connections)
    square_degrees: float = 3.0  # boards further than this from parallel or square are meant to be tilted
    square_floor_degrees: float = 0.35  # poses and stereo drift by this much
    direction_sigmas: float = 3.0
    thickness_sigmas: float = 3.0
    stock: Stock = Stock()
    stock_sigmas: float = 2.0  # standard errors within which exactly one stock size must lie
    thickness_floor: float = 1 / 1500  # least standard error of a thickness: eased edges hide part of it
    flush: float = 1 / 1000  # sheet planes of neighbours that differ by less are one
    ground_reach: float = 1 / 40  # a board that comes this near the floor stands on it
    outline_error: float = 1 / 60  # how far a rough outline may be off
    ragged: float = 1 / 60  # ... in the dark, also after it was traced in photographs
    unseen_reach: float = 1 / 8  # a board that fades out unseen this near another runs on to it
    far_reach: float = 1 / 2  # ... and this near when the photographs show its end at the plane
    end_score: float = 2.8  # least edge strength of a clear end
    rival_score: float = 2.0  # ... of one that lies before the plane and is clearer than the one at it
    end_excess: float = 0.2  # least share of stretches and views, beyond the usual, that show an end
    veil: float = 1 / 20  # by which stereo may have run a board on over a dark opening
    end_offset: float = 1 / 200
    passes: int = 2  # contacts are looked for again once boards were run on to those found
    min_contact: float = 1 / 100  # shortest interface
    seed: int = 0
