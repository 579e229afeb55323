"""Photographs of a stage: rays, highlights, tone, blur and the sensor's noise."""

from __future__ import annotations

import numpy as np

from kerfwright.capture import Camera
from kerfwright.synthetic.cameras import camera_rays
from kerfwright.synthetic.options import ImageOptions
from kerfwright.synthetic.stage import Stage

__all__ = ["developed", "photograph"]

GAIN = 1.3  # exposes light wood in the open to about 200 of 255
BAND = 32  # rows of pixels at a time: their rays and hits stay in the processor's cache


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
    picture = np.empty((camera.height, camera.width, 3), np.float32)
    for top in range(0, camera.height, BAND):
        band = rays[top * samples : (top + BAND) * samples]
        _fill(picture[top : top + BAND], stage, band, camera_from_model)
    return _exposed(picture, stage.options, rng)


def _fill(out: np.ndarray, stage: Stage, rays: np.ndarray, camera_from_model: np.ndarray) -> None:
    """Linear colours (rows, columns, 3) of the pixels that rays (rows * samples, columns * samples, 3) pass."""
    from kerfwright.synthetic._shading import aimed, shaded

    eye = -camera_from_model[:3, :3].T @ camera_from_model[:3, 3]
    model_from_camera = np.ascontiguousarray(camera_from_model[:3, :3].T, np.float32)
    laid = aimed(rays, model_from_camera, eye.astype(np.float32))
    hits, light = stage.scene.cast_laid(laid), stage.light
    shaded(
        laid, hits.distance, hits.triangle, stage.texel_from_model, stage.radiance, stage.normals, stage.owner >= 0,
        light.windows.astype(np.float32), light.power.astype(np.float32), stage.options.gloss, out,
    )  # fmt: skip


def developed(linear: np.ndarray, gain: float | np.ndarray = GAIN) -> np.ndarray:
    """Grey levels 0 to 255 (float) of linear colours, highlights rolled off."""
    linear = linear * gain
    rolled = linear * (1 + linear / 6) / (1 + linear)  # x (1 + x / w^2) / (1 + x): Reinhard and others 2002
    return 255 * np.clip(1.25 * rolled, 0, 1) ** (1 / 2.2)


def _exposed(linear: np.ndarray, options: ImageOptions, rng: np.random.Generator) -> np.ndarray:
    """A photograph of linear colours: exposure, colour cast, blur, noise."""
    import cv2

    gain = GAIN * np.exp(rng.normal(0, options.exposure)) * (1 + rng.normal(0, options.white_balance, 3))
    picture = developed(linear, gain.astype(np.float32))
    if options.blur:
        picture = cv2.GaussianBlur(picture, (0, 0), options.blur)
    spread = np.sqrt(options.read_noise**2 + options.shot_noise**2 * picture / 255)
    picture += spread * rng.standard_normal(picture.shape, np.float32)
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)
