"""A cloud as multi-view stereo leaves it: seen surfaces only, noisy along the rays, ragged round silhouettes.

No stereo is run. Each point is a pixel of some view; it survives if enough views see it, and is wrong in the ways that
patch matching is wrong: white noise and slow drift in depth, more at a grazing look, surfaces that run on past their
silhouette by a few pixels, blobs without points where wood shows no texture, normals averaged across edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.capture import Camera, Cloud
from kerfwright.synthetic.cameras import camera_rays
from kerfwright.synthetic.noise import SmoothNoise
from kerfwright.synthetic.options import CloudOptions
from kerfwright.synthetic.render import developed
from kerfwright.synthetic.stage import Stage

__all__ = ["stereo_cloud"]

SURPLUS = 2.0  # candidates a point that is wanted: the rest fails some test
REFERENCE_PIXEL = 0.68  # mm a pixel covers in the shared captures, where the noise was measured
JUMP = 0.02  # relative step in depth that makes a silhouette
SURE_VIEWS = 7  # that make a point certain to be kept


@dataclass(frozen=True, eq=False)
class _Samples:
    """Points as pixels of views."""

    x: np.ndarray  # (N, 3) mm
    triangle: np.ndarray  # (N,)
    toward: np.ndarray  # (N, 3) unit ray of the view they come from
    pixel: np.ndarray  # (N,) mm that a pixel covers there
    fringe: np.ndarray  # (N,) bool

    def select(self, keep: np.ndarray) -> _Samples:
        return _Samples(self.x[keep], self.triangle[keep], self.toward[keep], self.pixel[keep], self.fringe[keep])


def stereo_cloud(
    stage: Stage, camera: Camera, poses: np.ndarray, options: CloudOptions, rng: np.random.Generator
) -> Cloud:
    """Oriented, coloured points of the boards (and the floor, if asked for), model frame, mm.

    Parameters
    ----------
    poses : (V, 4, 4)
        camera_from_model of the views that look.
    """
    rays = camera_rays(camera)
    quota = int(SURPLUS * options.points / len(poses))
    samples = _concatenated([_pixels(stage, camera, pose, rays, quota, options, rng) for pose in poses])
    samples = samples.select(_kept(stage, camera, poses, samples, options, rng))
    if len(samples.x) > options.points:
        samples = samples.select(np.sort(rng.choice(len(samples.x), options.points, replace=False)))
    colours = developed(stage.colour(samples.x, samples.triangle)).round().astype(np.uint8)
    moved = _moved(stage, samples, options, rng)
    return Cloud(moved, _normals(stage, samples, moved, options, rng), colours)


def _concatenated(parts: list[_Samples]) -> _Samples:
    fields = ("x", "triangle", "toward", "pixel", "fringe")
    return _Samples(*(np.concatenate([getattr(p, f) for p in parts]) for f in fields))


def _pixels(
    stage, camera: Camera, pose: np.ndarray, rays: np.ndarray, quota: int, options: CloudOptions, rng
) -> _Samples:
    """Some pixels of a view that show wood, and some just beside it."""
    toward = rays @ pose[:3, :3].astype(np.float32)
    eye = -pose[:3, :3].T @ pose[:3, 3]
    hits = stage.scene.cast(eye, toward)
    met = np.isfinite(hits.distance)
    triangle = np.where(met, hits.triangle, 0)
    wanted = met & (stage.owner >= 0)[triangle]
    shown = np.flatnonzero(wanted | (met & (stage.normals[:, 2] > 0.9)[triangle]) if options.floor else wanted)
    pick = rng.choice(shown, min(quota, len(shown)), replace=False)
    d = toward.reshape(-1, 3)
    body = (eye + hits.distance.ravel()[pick, None] * d[pick], hits.triangle.ravel()[pick], d[pick])
    count = int(len(pick) * options.fringe)
    edge = _fringe(stage, hits, wanted, eye, toward, count, options.fringe_width, rng)
    x, triangle, ray = (np.concatenate(pair) for pair in zip(body, edge, strict=True))
    depth = np.linalg.norm(x - eye, axis=1)
    is_fringe = np.arange(len(x)) >= len(pick)
    unit = ray / np.linalg.norm(ray, axis=1, keepdims=True)
    return _Samples(x, triangle, unit, depth / camera.focal, is_fringe)


def _fringe(stage, hits, wanted, eye, toward, count: int, width: float, rng):
    """Points on the prolonged surface of silhouette pixels, as seen through pixels up to `width` further out."""
    import cv2

    rows, columns = wanted.shape
    depth = np.where(np.isfinite(hits.distance), hits.distance, 1e6).astype(np.float32)
    far = cv2.dilate(depth, np.ones((3, 3), np.uint8))
    rim = np.flatnonzero(wanted & (far > depth * (1 + JUMP)))
    if not len(rim) or not count:
        empty = np.zeros((0, 3), np.float32)
        return empty, np.zeros(0, np.int64), empty
    pick = rng.choice(rim, 4 * count)
    reach, around = rng.exponential(width / 2, len(pick)).clip(0.5, 2 * width), rng.uniform(0, 2 * np.pi, len(pick))
    row = np.clip(pick // columns + np.round(reach * np.sin(around)), 0, rows - 1).astype(int)
    column = np.clip(pick % columns + np.round(reach * np.cos(around)), 0, columns - 1).astype(int)
    beyond = depth[row, column] > depth.ravel()[pick] * (1 + JUMP)
    pick, row, column = (a[beyond][:count] for a in (pick, row, column))
    triangle, d = hits.triangle.ravel()[pick], toward[row, column]
    anchor = eye + depth.ravel()[pick, None] * toward.reshape(-1, 3)[pick]
    normal = stage.normals[triangle]
    slant = np.einsum("ij,ij->i", normal, d)
    onto = np.einsum("ij,ij->i", normal, anchor - eye) / np.where(np.abs(slant) > 0.2, slant, np.inf)
    flat = depth.ravel()[pick]
    along = np.where(np.abs(onto / flat - 1) < 0.01, onto, flat)  # a face seen on edge has no plane to run on in
    bent = along * (1 + np.abs(rng.normal(0, 0.004, len(along))) * (rng.random(len(along)) < 0.4))
    return (eye + bent[:, None] * d).astype(np.float32), triangle, d


def _kept(stage, camera: Camera, poses: np.ndarray, samples: _Samples, options: CloudOptions, rng) -> np.ndarray:
    """Mask of points that enough views see well and that lie in no blob without texture."""
    views = _views_seeing(stage, camera, poses, samples, np.cos(np.radians(options.grazing)))
    chance = np.clip((views - options.views + 1) / (SURE_VIEWS - options.views + 1), 0, 1)
    keep = (rng.random(len(chance)) < chance) & (views >= options.views)
    blobs = SmoothNoise(rng)(samples.x / 22) + 0.4 * SmoothNoise(rng)(samples.x / 6)
    keep &= blobs < np.quantile(blobs, 1 - options.dropout)
    return keep | (samples.fringe & (rng.random(len(keep)) < 0.5))


def _views_seeing(stage, camera: Camera, poses, samples: _Samples, least_cosine: float) -> np.ndarray:
    """(N,) how many views see each point, unhidden and not too much from the side."""
    from kerfwright.synthetic._shading import looked_at

    normal = stage.normals[samples.triangle]
    start = (samples.x + 0.05 * normal).astype(np.float32)
    out = np.zeros(len(start), int)
    size = np.array([camera.width, camera.height])
    for pose in poses:
        eye = -pose[:3, :3].T @ pose[:3, 3]
        idx = np.flatnonzero(looked_at(start, normal, eye, least_cosine))
        x = samples.x[idx] @ pose[:3, :3].T + pose[:3, 3]
        with np.errstate(invalid="ignore"):
            pixels = camera.project(x)
            idx = idx[((pixels > 0) & (pixels < size)).all(axis=1)]
        toward = (eye - start[idx]).astype(np.float32)
        out[idx] += ~stage.scene.blocked(start[idx], toward, far=1.0)
    return out


def _moved(stage, samples: _Samples, options: CloudOptions, rng) -> np.ndarray:
    """Points with their error in depth, mm."""
    normal = stage.normals[samples.triangle].astype(float)
    pixel = samples.pixel / REFERENCE_PIXEL
    cosine = np.abs(np.einsum("ij,ij->i", normal, samples.toward)).clip(0.2)
    near, wide = (SmoothNoise(rng)(samples.x / (k * options.drift_length)) for k in (1, 3))
    drift = (0.85 * near + 0.5 * wide) * options.drift
    white = rng.normal(size=len(pixel)) * options.noise
    rough = SmoothNoise(rng)(samples.x / 9) + rng.normal(0, 0.7, len(pixel))
    tail = rough > np.quantile(rough, 1 - options.tail) if options.tail else np.zeros(len(pixel), bool)
    spread = (drift + white) * np.where(tail, options.tail_factor, 1.0) * pixel / cosine
    return samples.x + samples.toward * spread[:, None] + normal * options.bias


def _normals(stage, samples: _Samples, moved: np.ndarray, options: CloudOptions, rng) -> np.ndarray:
    """Unit normals: true ones averaged over neighbours, turned a little, some turned round."""
    normal = stage.normals[samples.triangle].astype(float)
    if options.normal_radius:
        normal = _averaged(moved, normal, options.normal_radius)
    turn = np.radians(options.normal_noise)
    if turn:
        slow = np.stack([SmoothNoise(rng)(samples.x / 8) for _ in range(3)], axis=1)
        normal = normal + turn * (
            0.7 * slow + 0.7 * rng.normal(size=normal.shape) * rng.exponential(1, (len(normal), 1))
        )
    flipped = rng.random(len(normal)) < options.normal_flips
    normal[flipped] *= -1
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _averaged(x: np.ndarray, normal: np.ndarray, radius: float, neighbours: int = 10) -> np.ndarray:
    from scipy.spatial import cKDTree

    _, idx = cKDTree(x).query(x, neighbours, distance_upper_bound=radius, workers=-1)
    padded = np.concatenate([normal, np.zeros((1, 3))])
    total = sum(padded[idx[:, k]] for k in range(neighbours))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 1e-6, total / np.maximum(length, 1e-6), normal)
