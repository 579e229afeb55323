"""What identification finds: rough boards with their evidence in the cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from kerfwright.model import Quantity

__all__ = ["INFERRED_FACES", "Neighbourhood", "Parts", "Planes", "Primitive", "Sheet"]

INFERRED_FACES = {"top": (0.0, 0.0, 1.0), "bottom": (0.0, 0.0, -1.0)}


@dataclass(frozen=True, eq=False)
class Primitive:
    """A patch of the cloud on a plane n.x = offset (n outward, world)."""

    normal: np.ndarray  # (3,) outward unit normal
    offset: float  # mm along the normal
    point_idx: np.ndarray  # indices into the cloud
    centroid: np.ndarray  # (3,)
    sigma: float  # robust noise of its points across it, mm


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """Local geometry of a cloud: neighbour indices (N, K), smoothed normals (N, 3), residual (N,) mm, noise mm."""

    neighbour_idx: np.ndarray
    normals: np.ndarray
    residual: np.ndarray
    noise: float
    spacing: float  # median distance to the third nearest point, mm


@dataclass(frozen=True, eq=False)
class Planes:
    """The connected plane patches of a cloud, largest first, and its local geometry."""

    around: Neighbourhood
    patches: tuple[Primitive, ...]


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
    # ends m.xy = offset that nothing showed, as (mx, my, offset), and such faces (`INFERRED_FACES`)
    inferred: tuple[tuple[float, float, float], ...] = ()

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

    What `identify` gives has `sheets` aligned to each other and as far as they go, which may be beyond what the cloud
    shows; what `choose` gives has them as they were seen.
    """

    sheets: tuple[Sheet, ...]
    primitives: tuple[Primitive, ...]
    noise: float  # robust standard deviation of the cloud across its surface, mm
    spacing: float = 1.0  # median distance to the third nearest point, mm
    notes: tuple[str, ...] = ()
    selection: dict | None = None  # objective, bound, gap, candidates: for the report
    ends: tuple[tuple[str, str], ...] = ()  # names a, b: board b was run on to a
