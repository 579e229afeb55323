"""Photographs of a stage: rays, highlights, tone, blur and the sensor's noise."""

from __future__ import annotations

import numpy as np

from kerfwright.capture import Camera
from kerfwright.synthetic.cameras import camera_rays
from kerfwright.synthetic.options import ImageOptions
from kerfwright.synthetic.stage import Stage

__all__ = ["developed", "photograph"]

GAIN = 1.3  # exposes light wood in the open to about 200 of 255
GLOSS_POWER = 60  # exponent of the highlight's lobe: satin lacquer


def photograph(
    stage: Stage,
    camera: Camera,
    camera_from_model: np.ndarray,
    rng: np.random.Generator,
    rays: np.ndarray | None = None,
) -> np.ndarray:
    """(height, width, 3) uint8 RGB.

    Parameters
    ----------
    rays : (height * samples, width * samples, 3), optional
        `camera_rays` of the camera, when many pictures share it.
    """
    samples = stage.options.samples
    rays = camera_rays(camera, samples) if rays is None else rays
    toward = rays @ camera_from_model[:3, :3].astype(np.float32)
    eye = -camera_from_model[:3, :3].T @ camera_from_model[:3, 3]
    hits = stage.scene.cast(eye, toward)
    linear = _linear(stage, eye.astype(np.float32), toward, hits)
    picture = linear.reshape(camera.height, samples, camera.width, samples, 3).mean(axis=(1, 3))
    return _exposed(picture, stage.options, rng)


def _linear(stage: Stage, eye: np.ndarray, toward: np.ndarray, hits) -> np.ndarray:
    """Linear colours of rays (rows, columns, 3)."""
    seen = np.isfinite(hits.distance)
    out = np.full((*hits.distance.shape, 3), 1.6, np.float32)  # beyond the walls: a bright ceiling
    triangle, d = hits.triangle[seen], toward[seen]
    x = eye + hits.distance[seen][:, None] * d
    colour = stage.colour(x, triangle)
    wood = np.flatnonzero(stage.owner[triangle] >= 0)
    if stage.options.gloss and len(wood):
        colour[wood] += _gloss(stage, x[wood], d[wood], stage.normals[triangle[wood]])
    out[seen] = colour
    return out


def _gloss(stage: Stage, x: np.ndarray, toward: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Mirror images of the windows, spread by a satin surface; stronger at a grazing look (Schlick 1994)."""
    d = toward / np.linalg.norm(toward, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", d, normal)
    mirrored = d - 2 * cosine[:, None] * normal
    strength = stage.options.gloss * (0.04 + 0.96 * (1 - np.abs(cosine).clip(0, 1)) ** 5)
    out = np.zeros_like(x)
    for middle, power in zip(stage.light.windows, stage.light.power, strict=True):
        to_window = middle.astype(np.float32) - x
        to_window /= np.linalg.norm(to_window, axis=1, keepdims=True)
        lobe = np.einsum("ij,ij->i", mirrored, to_window).clip(0) ** GLOSS_POWER
        out += (8 * strength * lobe)[:, None] * power.astype(np.float32)
    return out


def developed(linear: np.ndarray, gain: float | np.ndarray = GAIN) -> np.ndarray:
    """Grey levels 0 to 255 (float) of linear colours, highlights rolled off."""
    linear = linear * gain
    rolled = linear * (1 + linear / 6) / (1 + linear)  # x (1 + x / w^2) / (1 + x): Reinhard and others 2002
    return 255 * np.clip(1.25 * rolled, 0, 1) ** (1 / 2.2)


def _exposed(linear: np.ndarray, options: ImageOptions, rng: np.random.Generator) -> np.ndarray:
    """A photograph of linear colours: exposure, colour cast, blur, noise."""
    import cv2

    gain = GAIN * np.exp(rng.normal(0, options.exposure)) * (1 + rng.normal(0, options.white_balance, 3))
    picture = developed(linear, gain).astype(np.float32)
    if options.blur:
        picture = cv2.GaussianBlur(picture, (0, 0), options.blur)
    spread = np.sqrt(options.read_noise**2 + options.shot_noise**2 * picture / 255)
    picture += spread * rng.standard_normal(picture.shape, np.float32)
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)
