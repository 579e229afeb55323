"""Soft indoor light: what arrives at points of the scene from windows, walls, floor and the boards themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from kerfwright.synthetic.stage import RayScene

__all__ = ["Light", "draw_light", "irradiance"]

OFF_SURFACE = 0.3  # mm; rays start beyond what float32 mistakes for the surface itself
RAYS_A_WINDOW = 6  # rays into the room for each ray towards a window


@dataclass(frozen=True, eq=False)
class Light:
    """Windows as squares, and how bright the room is in itself."""

    windows: np.ndarray  # (W, 3) middles, mm
    size: float  # half side, mm
    power: np.ndarray  # (W, 3) linear colours of what a window sends to a surface that faces it
    ambient: np.ndarray  # (3,)
    depth: float  # mm of free space in front of a point that give it the room's full light
    bars: float | None  # mm from one bar of the windows' blinds to the next; none without blinds


def draw_light(largest: float, bars: bool, rng: np.random.Generator) -> Light:
    """Two windows, one stronger; with blinds, they are small enough for shadows with edges."""
    around = rng.uniform(0, 2 * np.pi) + np.array([0, rng.uniform(1.6, 3.0)])
    reach, height = 3.1 * largest, rng.uniform(1.5, 2.4, 2) * largest
    windows = np.column_stack([reach * np.cos(around), reach * np.sin(around), height])
    power = np.array([[1.0, 0.97, 0.92], [0.5, 0.5, 0.52]]) * rng.uniform(0.45, 0.75)
    size, ambient = (0.06, 0.35) if bars else (0.9, 0.52)
    gap = rng.uniform(0.2, 0.4) * largest if bars else None
    return Light(windows, size * largest, power, np.full(3, ambient), 1.2 * largest, gap)


def irradiance(
    scene: RayScene, light: Light, x: np.ndarray, normal: np.ndarray, rays: int, rng: np.random.Generator
) -> np.ndarray:
    """Light (N, 3) at points (N, 3) with normals (N, 3); about 1 on a white surface in the open.

    Parameters
    ----------
    rays : int
        Into the room, a point; the windows get their share besides.
    """
    start = (x + OFF_SURFACE * normal).astype(np.float32)
    facing = normal.astype(np.float32)
    ambient = sum(_ambient(scene, light, start, facing, rng) for _ in range(rays)) / rays
    looks = max(1, rays // RAYS_A_WINDOW)
    return ambient + sum(_windows(scene, light, start, facing, rng) for _ in range(looks)) / looks


def _ambient(scene: RayScene, light: Light, x, normal, rng) -> np.ndarray:
    """One ray a point, drawn with the cosine: what it meets near by is dimly lit."""
    toward = rng.standard_normal(x.shape, np.float32)
    toward /= _length(toward)
    toward += 1.0001 * normal
    toward /= _length(toward)
    reach = np.clip(scene.distance(x, toward) / light.depth, 0, 1)  # from dark in a corner to full in the open
    return ((0.28 + 0.72 * reach) * (0.75 + 0.25 * toward[:, 2]))[:, None] * light.ambient


def _windows(scene: RayScene, light: Light, x, normal, rng) -> np.ndarray:
    """One ray a point and window, somewhere into it."""
    total = np.zeros((len(x), 3), np.float32)
    for middle, power in zip(light.windows, light.power, strict=True):
        reach = (middle + rng.uniform(-light.size, light.size, x.shape) - x).astype(np.float32)
        toward = reach / _length(reach)
        facing = np.einsum("ij,ij->i", toward, normal)
        ahead = np.flatnonzero(facing > 0)
        if light.bars:
            ahead = ahead[_between_bars(light.bars, x[ahead], toward[ahead])]
        lit = ahead[~scene.blocked(x[ahead], reach[ahead], far=1.0)]  # no further: behind the window stands the wall
        total[lit] += facing[lit, None] * power.astype(np.float32)
    return total


def _between_bars(gap: float, x: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Which rays pass a blind that hangs a few gaps away; the bars slant, so that they cross boards at any angle."""
    at = x + 3 * gap * toward
    return (at @ np.array([0.55, 0.25, 0.8], np.float32)) % gap > 0.35 * gap


def _length(v: np.ndarray) -> np.ndarray:
    """(N, 1); several times faster than linalg.norm on three columns."""
    return np.sqrt(np.einsum("ij,ij->i", v, v))[:, None]
