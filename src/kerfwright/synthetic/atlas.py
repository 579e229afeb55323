"""Every plane patch of the scene laid out in one picture, so that a photograph is one look-up a ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Atlas", "Patch", "pack", "plane_patches"]

MARGIN = 2  # texels round a patch, so that reading between texels never leaves it
WIDTH = 4096


@dataclass(frozen=True, eq=False)
class Patch:
    """A rectangle on a plane: x_in_model = origin + step * (column * u + row * v), columns and rows from 0."""

    owner: int  # board, or -1 for the room
    origin: np.ndarray
    u: np.ndarray
    v: np.ndarray
    normal: np.ndarray
    step: np.ndarray  # (2,) mm a texel along u and v
    shape: tuple[int, int]  # rows, columns, without the margin
    triangles: np.ndarray  # indices of the mesh's triangles on it

    def grid(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """(R, C, 3) points at texel coordinates."""
        along = columns[None, :, None] * self.step[0] * self.u
        return self.origin + along + rows[:, None, None] * self.step[1] * self.v


@dataclass(frozen=True, eq=False)
class Atlas:
    """Patches with the place of each in a picture of `shape`."""

    patches: list[Patch]
    corners: np.ndarray  # (P, 2) row and column of texel (0, 0)
    shape: tuple[int, int]

    def texel_from_model(self, triangles: int) -> np.ndarray:
        """(T, 2, 4): column and row in the atlas of a point (x, y, z, 1) on each triangle."""
        out = np.zeros((triangles, 2, 4))
        for patch, (row, column) in zip(self.patches, self.corners, strict=True):
            for axis, (direction, at) in enumerate(((patch.u, column), (patch.v, row))):
                line = np.append(direction, -direction @ patch.origin) / patch.step[axis]
                line[3] += at
                out[patch.triangles, axis] = line
        return out.astype(np.float32)


def plane_patches(owner: int, mesh, first_triangle: int, step: float) -> list[Patch]:
    """The patches of a closed mesh: triangles that share a plane, boxed along the plane's own axes."""
    from kerfwright.synthetic.meshes import face_normals, plane_basis

    vertices, triangles = mesh
    normals, _ = face_normals(mesh)
    offsets = np.einsum("ij,ij->i", normals, vertices[triangles[:, 0]])
    key = np.column_stack([np.round(normals, 4), np.round(offsets, 1)]) + 0.0
    _, first, group = np.unique(key, axis=0, return_index=True, return_inverse=True)
    out = []
    for g, f in enumerate(first):
        own = np.flatnonzero(group == g)
        basis = plane_basis(normals[f])
        x = vertices[triangles[own]].reshape(-1, 3)
        flat = x @ basis
        low, size = flat.min(axis=0), np.ptp(flat, axis=0)
        shape = tuple(int(n) for n in np.ceil(size[::-1] / step) + 1)
        origin = basis @ low + normals[f] * (x @ normals[f]).mean()
        out.append(
            Patch(owner, origin, basis[:, 0], basis[:, 1], normals[f], np.full(2, step), shape, own + first_triangle)
        )
    return out


def pack(patches: list[Patch]) -> Atlas:
    """Shelves of falling height: simple, and full enough."""
    order = sorted(range(len(patches)), key=lambda k: (-patches[k].shape[0], k))
    corners, x, y, shelf = np.zeros((len(patches), 2)), 0, 0, 0
    width = max(WIDTH, max(p.shape[1] for p in patches) + 2 * MARGIN)
    for k in order:
        rows, columns = (n + 2 * MARGIN for n in patches[k].shape)
        if x + columns > width:
            x, y, shelf = 0, y + shelf, 0
        corners[k] = y + MARGIN, x + MARGIN
        x, shelf = x + columns, max(shelf, rows)
    return Atlas(patches, corners, (y + shelf, width))
