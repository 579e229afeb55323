"""Options of assembly."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["AssembleOptions"]


@dataclass(frozen=True)
class AssembleOptions:
    """What assembly may be told; lengths are fractions of the cloud's largest side D."""

    reach: float = 1 / 30  # boards that come this near each other are connected (paper, Connections)
    square_degrees: float = 3.0  # boards further than this from parallel or square are meant to be tilted
    square_floor_degrees: float = 0.35  # poses and stereo drift by this much
    direction_sigmas: float = 3.0
    thickness_sigmas: float = 3.0
    thickness_floor: float = 1 / 1500  # least standard error of a thickness: eased edges hide part of it
    ground_reach: float = 1 / 40  # a board that comes this near the floor stands on it
    outline_error: float = 1 / 60  # how far a rough outline may be off
    unseen_reach: float = 1 / 8  # a board that fades out unseen this near another runs on to it
    far_reach: float = 1 / 2  # ... and this near when the photographs show its end at the plane
    end_score: float = 2.8  # least edge strength that confirms a far end
    end_offset: float = 1 / 200
    min_contact: float = 1 / 100  # shortest interface
    seed: int = 0
