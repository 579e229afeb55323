"""The scene of one object: geometry to cast rays at, and the light that leaves every point of it.

Wood, light and shadows do not change between photographs: they are computed once, on the atlas. What a photograph adds
is the view: which texel a ray meets, the highlight, exposure and noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.model import Model
from kerfwright.model.frames import board_from_model, transform_points
from kerfwright.synthetic.atlas import MARGIN, Atlas, Patch, pack, plane_patches
from kerfwright.synthetic.lighting import Light, draw_light, irradiance
from kerfwright.synthetic.meshes import face_normals, mesh_in_model
from kerfwright.synthetic.noise import SmoothNoise
from kerfwright.synthetic.options import ImageOptions
from kerfwright.synthetic.room import Quad, room_quads
from kerfwright.synthetic.wood import SPECIES, draw_wood

__all__ = ["Hits", "RayScene", "Stage", "build_stage"]

LIGHT_TEXELS = 5  # wood texels between two nodes of the light map: shadows indoors are soft
CURVE_TOLERANCE = 0.15  # mm; facets of curves in pictures


@dataclass(frozen=True, eq=False)
class Hits:
    """What rays meet: distance in units of the ray's direction (inf: nothing) and triangle."""

    distance: np.ndarray
    triangle: np.ndarray


class RayScene:
    """Triangles in an Embree tree; millimetres."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray) -> None:
        import open3d

        self._tensor = open3d.core.Tensor
        self._scene = open3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(self._tensor(vertices.astype(np.float32)), self._tensor(triangles.astype(np.uint32)))

    def cast(self, start: np.ndarray, toward: np.ndarray) -> Hits:
        """First hits of rays: start (N, 3) or (3,), toward (N, 3)."""
        return self.cast_laid(_laid(start, toward))

    def cast_laid(self, rays: np.ndarray) -> Hits:
        """First hits of rays (..., 6): float32 start and direction."""
        found = self._scene.cast_rays(self._tensor(rays))
        return Hits(found["t_hit"].numpy(), found["primitive_ids"].numpy().astype(np.int64))

    def distance(self, start: np.ndarray, toward: np.ndarray) -> np.ndarray:
        """Distances (N,) to the first hit."""
        return self.cast(start, toward).distance

    def blocked(self, start: np.ndarray, toward: np.ndarray, far: float = np.inf) -> np.ndarray:
        """Whether rays (N,) meet anything before `far` times their direction."""
        return self._scene.test_occlusions(self._tensor(_laid(start, toward)), tnear=0.0, tfar=float(far)).numpy()

    def within(self, x: np.ndarray) -> np.ndarray:
        """Whether points (N, 3) lie inside a closed mesh."""
        return self._scene.compute_occupancy(self._tensor(x.astype(np.float32))).numpy() > 0.5


def _laid(start: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """(..., 6) float32, as Embree wants rays."""
    rays = np.empty((*toward.shape[:-1], 6), np.float32)
    rays[..., :3], rays[..., 3:] = start, toward
    return rays


@dataclass(frozen=True, eq=False)
class Stage:
    """The scene, lit."""

    scene: RayScene
    normals: np.ndarray  # (T, 3) of the triangles
    owner: np.ndarray  # (T,) board of a triangle, -1 for the room
    texel_from_model: np.ndarray  # (T, 2, 4)
    radiance: np.ndarray  # (rows, columns, 3) float32, linear
    light: Light
    bounds: tuple[np.ndarray, np.ndarray]  # of the boards
    options: ImageOptions

    def colour(self, x: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Linear colours (N, 3) of points (N, 3) on their triangles (N,)."""
        import cv2

        m = self.texel_from_model[triangle]
        at = np.einsum("nij,nj->ni", m[:, :, :3], x.astype(np.float32)) + m[:, :, 3]
        out = np.empty((len(x), 3), np.float32)
        for low in range(0, len(x), 30_000):  # remap's pictures have under 32767 rows
            part = at[low : low + 30_000]
            picked = cv2.remap(self.radiance, part[:, None, 0], part[:, None, 1], cv2.INTER_LINEAR)
            out[low : low + 30_000] = picked[:, 0]
        return out


def build_stage(model: Model, options: ImageOptions, rng: np.random.Generator) -> Stage:
    """Geometry, wood, room and light of an object; the object's species, light and rug are drawn."""
    meshes = [mesh_in_model(b, CURVE_TOLERANCE) for b in model.boards]
    points = np.concatenate([v for v, _ in meshes])
    bounds = points.min(axis=0), points.max(axis=0)
    largest = float((bounds[1] - bounds[0]).max())
    quads = room_quads(largest, options.floor_texels, rng)
    vertices, triangles, owner = _joined(meshes, quads)
    patches = _patches(meshes, quads, options.texels * largest)
    atlas = pack(patches)
    scene, light = RayScene(vertices, triangles), draw_light(largest, options.bars, rng)
    radiance = np.zeros((*atlas.shape, 3), np.float32)
    _paint(radiance, atlas, _albedos(model, patches, quads, options, rng))
    _shine(radiance, atlas, _Bake(scene, [RayScene(*m) for m in meshes], light, options, rng))
    normals = face_normals((vertices, triangles))[0].astype(np.float32)
    return Stage(scene, normals, owner, atlas.texel_from_model(len(triangles)), radiance, light, bounds, options)


def _joined(meshes, quads: list[Quad]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One mesh of boards and room, and whose each triangle is."""
    parts = list(meshes)
    for q in quads:
        parts.append(
            (
                np.array([q.origin, q.origin + q.u, q.origin + q.u + q.v, q.origin + q.v]),
                np.array([[0, 1, 2], [0, 2, 3]]),
            )
        )
    shift = np.cumsum([0] + [len(v) for v, _ in parts])
    triangles = np.concatenate([t + s for (_, t), s in zip(parts, shift, strict=False)])
    owner = np.repeat([*range(len(meshes)), *[-1] * len(quads)], [len(t) for _, t in parts])
    return np.concatenate([v for v, _ in parts]), triangles, owner


def _patches(meshes, quads: list[Quad], step: float) -> list[Patch]:
    out, first = [], 0
    for k, mesh in enumerate(meshes):
        out += plane_patches(k, mesh, first, step)
        first += len(mesh[1])
    for q in quads:
        rows, columns = q.texture.shape[:2]
        size = np.array([np.linalg.norm(q.u), np.linalg.norm(q.v)])
        u, v = q.u / size[0], q.v / size[1]
        steps = size / (columns - 1, rows - 1)
        out.append(Patch(-1, q.origin, u, v, np.cross(u, v), steps, (rows, columns), np.arange(first, first + 2)))
        first += 2
    return out


def _albedos(model: Model, patches: list[Patch], quads: list[Quad], options: ImageOptions, rng):
    """(patch index, colours with margin) of every patch: wood of the boards, pictures of the room."""
    noise, species = SmoothNoise(rng), sorted(SPECIES)[rng.integers(len(SPECIES))]
    woods = [draw_wood(b, species, options.knots, rng) for b in model.boards]
    for k, board in enumerate(model.boards):
        own = [p for p, patch in enumerate(patches) if patch.owner == k]
        grids = [patches[p].grid(*(np.arange(-MARGIN, n + MARGIN) for n in patches[p].shape)) for p in own]
        x = transform_points(board_from_model(board), np.concatenate([g.reshape(-1, 3) for g in grids]))
        colours = woods[k].colour(x, noise, float(patches[own[0]].step[0]))
        pieces = np.split(colours, np.cumsum([g[..., 0].size for g in grids])[:-1])
        wear = rng.uniform(0.7, 1.05)
        for p, g, c in zip(own, grids, pieces, strict=True):
            yield p, c.reshape(g.shape) * _rim(patches[p], g.shape[:2], wear)[..., None]
    room = [p for p, patch in enumerate(patches) if patch.owner < 0]
    for p, q in zip(room, quads, strict=True):
        yield p, np.pad(q.texture, ((MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0)), mode="edge")


def _rim(patch: Patch, shape: tuple[int, int], wear: float) -> np.ndarray:
    """Factor on the outermost texels of a patch: eased edges catch light or dirt, and show where boards meet."""
    return _framed(shape, wear) if min(patch.shape) > 4 else np.ones(shape)


def _framed(shape: tuple[int, int], wear: float) -> np.ndarray:
    factor = np.full(shape, wear)
    factor[MARGIN + 1 : -MARGIN - 1, MARGIN + 1 : -MARGIN - 1] = 1.0
    return factor


def _paint(radiance: np.ndarray, atlas: Atlas, albedos) -> None:
    for p, colours in albedos:
        (row, column), (rows, columns) = atlas.corners[p].astype(int) - MARGIN, colours.shape[:2]
        radiance[row : row + rows, column : column + columns] = colours


@dataclass(frozen=True, eq=False)
class _Bake:
    """What the light map needs."""

    scene: RayScene
    boards: list[RayScene]
    light: Light
    options: ImageOptions
    rng: np.random.Generator


def _shine(radiance: np.ndarray, atlas: Atlas, bake: _Bake) -> None:
    """Multiply every patch by the light that falls on it."""
    import cv2

    nodes = bake.options.room_nodes
    axes = [tuple(_nodes(n, p.owner, nodes) for n in p.shape) for p in atlas.patches]
    grids = [p.grid(*a) for p, a in zip(atlas.patches, axes, strict=True)]
    x = np.concatenate([g.reshape(-1, 3) for g in grids])
    normal = np.repeat([p.normal for p in atlas.patches], [g[..., 0].size for g in grids], axis=0)
    owner = np.repeat([p.owner for p in atlas.patches], [g[..., 0].size for g in grids])
    light = irradiance(bake.scene, bake.light, x, normal, bake.options.light_rays, bake.rng)
    covered = _covered(bake.boards, x + 0.3 * normal, owner)
    ends = np.cumsum([g[..., 0].size for g in grids])[:-1]
    for patch, corner, grid, value, hidden in zip(
        atlas.patches, atlas.corners, grids, np.split(light, ends), np.split(covered, ends), strict=True
    ):
        smooth = _filled(value.reshape(grid.shape), hidden.reshape(grid.shape[:2]))
        rows, columns = (n + 2 * MARGIN for n in patch.shape)
        (row, column) = corner.astype(int) - MARGIN
        target = radiance[row : row + rows, column : column + columns]
        target *= cv2.resize(smooth.astype(np.float32), (columns, rows), interpolation=cv2.INTER_LINEAR)


def _nodes(texels: int, owner: int, room_nodes: int) -> np.ndarray:
    """Texel coordinates of the light map's nodes: a few texels apart on boards, so many across on the room."""
    count = max(2, -(-texels // LIGHT_TEXELS)) if owner >= 0 else room_nodes
    return (np.arange(count) + 0.5) / count * texels - 0.5


def _covered(boards: list[RayScene], x: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Nodes that lie inside another board, where no light is and no camera looks."""
    out = np.zeros(len(x), bool)
    for k, board in enumerate(boards):
        others = owner != k
        out[others] |= board.within(x[others])
    return out


def _filled(light: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    """The light map with hidden nodes filled from their neighbours, smoothed a little against the sampling's noise."""
    import cv2

    weight = (~hidden).astype(np.float32)
    near = [
        cv2.GaussianBlur(a.astype(np.float32), (0, 0), s)
        for s in (0.8, 3.0)
        for a in (light * weight[..., None], weight)
    ]
    soft = near[0] / np.maximum(near[1], 1e-4)[..., None]
    wide = near[2] / np.maximum(near[3], 1e-4)[..., None]
    return np.where(hidden[..., None], wide, soft)
