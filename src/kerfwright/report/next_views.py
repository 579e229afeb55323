"""Where to photograph next: places from which one would see most of what too few photographs show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.report.meshes import BoardMesh

if TYPE_CHECKING:
    from kerfwright.capture.types import View

__all__ = ["NextView", "next_views"]

ENOUGH = 2  # photographs that must show a point for stereo to measure it
GRAZING = np.cos(np.radians(75))  # flatter than this a face shows too few pixels
WORTH = 0.01  # of the whole surface: what a new photograph must show to be asked for
AZIMUTHS = np.arange(0, 360, 15)
ELEVATIONS = (10, 30, 50, 75)
_SAMPLES = 4000
_LIFT = 0.5  # mm off the surface, so that a ray does not meet the face that it starts on


@dataclass(frozen=True)
class NextView:
    """A place to photograph from: degrees round the object and above the horizon, mm from its middle.

    `nearest` is the photograph taken closest to it, `turn` the degrees to go round from there, positive to the right as
    one faces the object. `share` of the whole surface would be newly shown, most of it on `boards`.
    """

    azimuth: float
    elevation: float
    distance: float
    share: float
    boards: tuple[str, ...]
    nearest: str
    turn: float


def next_views(meshes: Sequence[BoardMesh], views: Sequence[View], most: int = 3) -> list[NextView]:
    """The places that show most, the best first; each counts what those before it leave."""
    if not meshes or not views:
        return []
    points, normals, owner = _surface(meshes)
    scene = _scene(meshes)
    unseen = np.sum([_in_frame(v, points) & _faces(scene, points, normals, v.centre) for v in views], axis=0) < ENOUGH
    places = _places(points, views)
    shown = np.array([_faces(scene, points, normals, place) for _, _, place in places])
    found = []
    for _ in range(most):
        gain = (shown & unseen).mean(axis=1)
        best = int(gain.argmax())
        if gain[best] < WORTH:
            break
        new = shown[best] & unseen
        found.append(_described(places[best], float(gain[best]), owner[new], meshes, views, points))
        unseen &= ~new
    return found


def _described(place, gain: float, owner: np.ndarray, meshes, views: Sequence[View], points: np.ndarray) -> NextView:
    azimuth, elevation, position = place
    middle = _middle(points)
    counts = np.bincount(owner, minlength=len(meshes))
    boards = tuple(meshes[k].name for k in np.argsort(-counts, kind="stable")[:3] if counts[k] >= 0.2 * counts.max())
    nearest = min(views, key=lambda v: float(np.linalg.norm(v.centre - position)))
    there = nearest.centre - middle
    turn = (azimuth - np.degrees(np.arctan2(there[1], there[0])) + 180) % 360 - 180
    distance = float(np.linalg.norm(position - middle))
    return NextView(float(azimuth), float(elevation), distance, gain, boards, nearest.name, float(turn))


def _places(points: np.ndarray, views: Sequence[View]) -> list[tuple[float, float, np.ndarray]]:
    """Azimuth, elevation and position of the places to try: on a dome as far away as the photographs were."""
    middle = _middle(points)
    radius = float(np.median([np.linalg.norm(v.centre - middle) for v in views]))
    out = []
    for elevation in ELEVATIONS:
        for azimuth in AZIMUTHS:
            a, e = np.radians([azimuth, elevation])
            offset = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
            out.append((float(azimuth), float(elevation), middle + radius * offset))
    return out


def _middle(points: np.ndarray) -> np.ndarray:
    return (points.min(axis=0) + points.max(axis=0)) / 2


def _surface(meshes: Sequence[BoardMesh]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points spread evenly over the boards, their outward normals, and the index of their board."""
    corners = np.concatenate([mesh.vertices[mesh.triangles] for mesh in meshes])
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.triangles) for mesh in meshes])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice_area = np.linalg.norm(normal, axis=1)
    rng = np.random.default_rng(0)
    k = rng.choice(len(corners), _SAMPLES, p=twice_area / twice_area.sum())
    u, v = rng.random((2, _SAMPLES))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = corners[k].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), normal[k] / twice_area[k, None], owner[k]


def _scene(meshes: Sequence[BoardMesh]):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    for mesh in meshes:
        scene.add_triangles(
            o3d.core.Tensor(mesh.vertices.astype(np.float32)), o3d.core.Tensor(mesh.triangles.astype(np.uint32))
        )
    return scene


def _faces(scene, points: np.ndarray, normals: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Which points look towards a place, with no board between."""
    import open3d as o3d

    towards = place - points
    distance = np.linalg.norm(towards, axis=1, keepdims=True)
    facing = (normals * towards / distance).sum(axis=1) > GRAZING
    rays = np.concatenate([points + _LIFT * normals, towards / distance], axis=1).astype(np.float32)
    hidden = scene.test_occlusions(o3d.core.Tensor(rays), tfar=float(distance.min())).numpy()
    return facing & ~hidden


def _in_frame(view: View, points: np.ndarray) -> np.ndarray:
    pixels, depth = view.project(points)
    return (depth > 0) & ((pixels >= 0) & (pixels < [view.camera.width, view.camera.height])).all(axis=1)
