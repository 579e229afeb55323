"""The model drawn over a photograph: what a person checks first.

Every pixel's ray is cast at the boards, with the lens distortion of the photograph, so that the drawing lies where the
camera would have seen the boards. Outlines are where neighbouring rays meet different boards or faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.report.meshes import BoardMesh

if TYPE_CHECKING:
    from kerfwright.capture.types import View

__all__ = ["Drawing", "draw", "outlined", "shaded"]

SHADE = 0.6  # share of the drawing over the photograph
LINE_COLOUR = (255, 60, 30)  # no wood, wall or floor has it
# Faces that turn by more than this have an edge between them; facets of a curve turn less (report.meshes).
_CREASE = np.cos(np.radians(13))


@dataclass(frozen=True, eq=False)
class Drawing:
    """What the camera would see of the boards, pixel by pixel.

    Attributes
    ----------
    board_idx : (height, width) index of the board, -1 where none is.
    normals : (height, width, 3) unit, towards the camera.
    lines : (height, width) from 0 to 1, how much of the pixel an outline covers.
    """

    board_idx: np.ndarray
    normals: np.ndarray
    lines: np.ndarray


def draw(meshes: Sequence[BoardMesh], view: View, supersample: int = 2) -> Drawing:
    """Cast the rays of a view at the boards; `supersample` squared rays a pixel smooth the outlines."""
    shape = (view.camera.height, view.camera.width)
    drawing = Drawing(np.full(shape, -1, np.int32), np.zeros((*shape, 3), np.float32), np.zeros(shape))
    window = _window(meshes, view)
    board_idx, normals = _cast(meshes, _rays(view, window, supersample))
    edges = _outlines(board_idx, normals)
    height, width = (n // supersample for n in edges.shape)
    covered = edges.reshape(height, supersample, width, supersample).mean(axis=(1, 3))
    middle = slice(supersample // 2, None, supersample)
    drawing.board_idx[window], drawing.normals[window] = board_idx[middle, middle], normals[middle, middle]
    # One line covers about one ray in each row of the pixel's rays.
    drawing.lines[window] = np.clip(covered * supersample, 0, 1)
    return drawing


def shaded(photo: np.ndarray, drawing: Drawing, colours: Sequence[tuple[float, float, float]]) -> np.ndarray:
    """The boards in their colours (0 to 1), lit from above, over a (height, width, 3) uint8 photograph."""
    hit = drawing.board_idx >= 0
    light = np.array([0.3, 0.2, 1.0]) / np.linalg.norm([0.3, 0.2, 1.0])
    brightness = 0.45 + 0.55 * np.clip(drawing.normals[hit] @ light, 0, 1)
    paint = 255 * np.asarray(colours, float)[drawing.board_idx[hit]] * brightness[:, None]
    out = photo.astype(float)
    out[hit] = SHADE * paint + (1 - SHADE) * out[hit]
    return _with_lines(out, drawing, (40, 30, 25))


def outlined(photo: np.ndarray, drawing: Drawing) -> np.ndarray:
    """The outlines of the boards over a (height, width, 3) uint8 photograph."""
    return _with_lines(photo.astype(float), drawing, LINE_COLOUR)


def _with_lines(picture: np.ndarray, drawing: Drawing, colour: tuple[int, int, int]) -> np.ndarray:
    share = drawing.lines[..., None]
    return np.round(picture * (1 - share) + np.array(colour, float) * share).astype(np.uint8)


def _window(meshes: Sequence[BoardMesh], view: View) -> tuple[slice, slice]:
    """Rows and columns that can show a board; all of them when a board reaches behind the camera."""
    size = np.array([view.camera.width, view.camera.height])
    low, high = np.zeros(2), size
    if meshes:
        pixels, depth = view.project(np.concatenate([mesh.vertices for mesh in meshes]))
        if (depth > 0).all():
            low, high = pixels.min(axis=0) - 2, pixels.max(axis=0) + 2
    (left, top), (right, bottom) = np.clip(low, 0, size).astype(int), np.clip(np.ceil(high), 0, size).astype(int)
    return slice(top, bottom), slice(left, right)


def _rays(view: View, window: tuple[slice, slice], supersample: int) -> np.ndarray:
    """(rows s, columns s, 6) float32 origins and unit directions in world; s rays along a pixel's side."""
    ticks = [np.arange(w.start * supersample, w.stop * supersample) + 0.5 for w in window]
    rows, columns = (t / supersample for t in np.meshgrid(*ticks, indexing="ij"))
    rays = np.empty((rows.size, 6), np.float32)
    rays[:, :3] = view.centre
    xy = view.camera.undistort(np.stack([columns.ravel(), rows.ravel()], axis=1))
    towards = xy @ view.camera_from_world[:2, :3] + view.camera_from_world[2, :3]
    rays[:, 3:] = towards / np.sqrt(np.einsum("ij,ij->i", towards, towards))[:, None]
    return rays.reshape(*rows.shape, 6)


def _cast(meshes: Sequence[BoardMesh], rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the board that each ray meets first, -1 for none, and the normal there, towards the camera."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    for mesh in meshes:
        scene.add_triangles(
            o3d.core.Tensor(mesh.vertices.astype(np.float32)), o3d.core.Tensor(mesh.triangles.astype(np.uint32))
        )
    hits = scene.cast_rays(o3d.core.Tensor(rays))
    normals = hits["primitive_normals"].numpy()
    board_idx = np.where(np.isfinite(hits["t_hit"].numpy()), hits["geometry_ids"].numpy().astype(np.int32), -1)
    normals[np.einsum("ijk,ijk->ij", normals, rays[..., 3:]) > 0] *= -1
    return board_idx, normals


def _outlines(board_idx: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """True where a ray and the next one, to the right or below, meet different boards or faces."""
    edges = np.zeros(board_idx.shape, bool)
    for axis in (0, 1):
        a = tuple(slice(None, -1) if k == axis else slice(None) for k in (0, 1))
        b = tuple(slice(1, None) if k == axis else slice(None) for k in (0, 1))
        crease = np.einsum("ijk,ijk->ij", normals[a], normals[b]) < _CREASE
        edges[a] |= (board_idx[a] != board_idx[b]) | (crease & (board_idx[a] >= 0))
    return edges
