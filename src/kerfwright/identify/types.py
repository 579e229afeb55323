"""What identification finds: rough boards with their evidence in the cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from kerfwright.model import Quantity

__all__ = ["Parts", "Primitive", "Sheet"]


@dataclass(frozen=True, eq=False)
class Primitive:
    """A patch of the cloud on a plane n.x = offset (n outward, world) or on a cylinder."""

    kind: str  # "plane" or "cylinder"
    normal: np.ndarray  # (3,) outward unit normal of a plane; axis of a cylinder
    offset: float  # mm along the normal
    point_idx: np.ndarray  # indices into the cloud
    centroid: np.ndarray  # (3,)
    sigma: float  # robust noise of its points across it, mm
    radius: float | None = None  # of a cylinder


@dataclass(frozen=True, eq=False)
class Sheet:
    """A rough board: the slab between z = 0 and z = thickness of its board frame, inside `region`.

    x_in_world = world_from_board @ x_in_board (4x4, rigid, millimetres).
    """

    name: str
    world_from_board: np.ndarray
    thickness: Quantity
    thickness_seen: bool
    region: Polygon  # board frame, mm, holes included
    top_idx: np.ndarray  # cloud points on z = thickness, normals +z
    bottom_idx: np.ndarray  # cloud points on z = 0, normals -z
    cut_idx: np.ndarray  # cloud points on its cut faces

    @property
    def normal(self) -> np.ndarray:
        """Unit normal of the top sheet plane, world."""
        return self.world_from_board[:3, 2]

    def to_board(self, x_in_world: np.ndarray) -> np.ndarray:
        """(N, 3) world to (N, 3) board frame."""
        return (x_in_world - self.world_from_board[:3, 3]) @ self.world_from_board[:3, :3]

    def to_world(self, x_in_board: np.ndarray) -> np.ndarray:
        """(N, 3) board frame to (N, 3) world."""
        return x_in_board @ self.world_from_board[:3, :3].T + self.world_from_board[:3, 3]


@dataclass(frozen=True, eq=False)
class Parts:
    """The selected rough boards, the planes they were found in, and what the selection said.

    `sheets` go as far as the cloud shows them, two that stereo joined still as one; `identify.whole_boards` has them as
    far as they go.
    """

    sheets: tuple[Sheet, ...]
    primitives: tuple[Primitive, ...]
    noise: float  # robust standard deviation of the cloud across its surface, mm
    spacing: float = 1.0  # median distance to the third nearest point, mm
    notes: tuple[str, ...] = ()
    selection: dict | None = None  # objective, bound, gap, candidates: for the report
