"""Inner loops of photographs and clouds, compiled: rays of a band of rows, the mean colour of a pixel's rays."""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["aimed", "looked_at", "shaded"]

BEYOND = np.float32(1.6)  # beyond the walls: a bright ceiling


@njit(cache=True, nogil=True)
def aimed(rays, model_from_camera, eye):
    """(rows, columns, 6) starts and directions in the model of rays (rows, columns, 3) of a camera at `eye`."""
    rows, columns, _ = rays.shape
    out = np.empty((rows, columns, 6), np.float32)
    for r in range(rows):
        for c in range(columns):
            for k in range(3):
                out[r, c, k] = eye[k]
                out[r, c, 3 + k] = (
                    model_from_camera[k, 0] * rays[r, c, 0]
                    + model_from_camera[k, 1] * rays[r, c, 1]
                    + model_from_camera[k, 2] * rays[r, c, 2]
                )
    return out


@njit(cache=True, nogil=True)
def shaded(rays, distance, triangle, texel_from_model, radiance, normals, is_wood, windows, power, gloss, out):
    """Fill `out` (rows, columns, 3) with linear colours: the mean of each pixel's rays (rows * s, columns * s, 6)."""
    rows, columns, _ = out.shape
    samples = rays.shape[0] // rows
    x, total = np.empty(3, np.float32), np.empty(3, np.float32)
    for r in range(rows):
        for c in range(columns):
            total[:] = 0
            for i in range(r * samples, (r + 1) * samples):
                for j in range(c * samples, (c + 1) * samples):
                    far, t = distance[i, j], triangle[i, j]
                    if not np.isfinite(far):
                        total += BEYOND
                        continue
                    for k in range(3):
                        x[k] = rays[i, j, k] + far * rays[i, j, 3 + k]
                    _add_texel(radiance, texel_from_model[t], x, total)
                    if gloss > 0 and is_wood[t]:
                        _add_gloss(x, rays[i, j, 3:], normals[t], windows, power, gloss, total)
            for k in range(3):
                out[r, c, k] = total[k] / np.float32(samples * samples)


@njit(cache=True, nogil=True)
def _add_texel(radiance, texel_from_model, x, total):
    """The atlas's colour at x, read between its texels."""
    m = texel_from_model
    column = m[0, 0] * x[0] + m[0, 1] * x[1] + m[0, 2] * x[2] + m[0, 3]
    row = m[1, 0] * x[0] + m[1, 1] * x[1] + m[1, 2] * x[2] + m[1, 3]
    column = min(max(column, np.float32(0)), np.float32(radiance.shape[1] - 1.001))
    row = min(max(row, np.float32(0)), np.float32(radiance.shape[0] - 1.001))
    a, b = int(row), int(column)
    v, u = row - np.float32(a), column - np.float32(b)
    for k in range(3):
        above = radiance[a, b, k] + u * (radiance[a, b + 1, k] - radiance[a, b, k])
        below = radiance[a + 1, b, k] + u * (radiance[a + 1, b + 1, k] - radiance[a + 1, b, k])
        total[k] += above + v * (below - above)


@njit(cache=True, nogil=True)
def _add_gloss(x, toward, normal, windows, power, gloss, total):
    """Mirror images of the windows, spread by a satin surface; stronger at a grazing look (Schlick 1994)."""
    length = np.sqrt(toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2])
    cosine = (toward[0] * normal[0] + toward[1] * normal[1] + toward[2] * normal[2]) / length
    missing = 1 - min(abs(cosine), np.float32(1))
    strength = 8 * gloss * (0.04 + 0.96 * missing**5)
    for w in range(len(windows)):
        along = square = np.float32(0)
        for k in range(3):
            to_window = windows[w, k] - x[k]
            along += (toward[k] / length - 2 * cosine * normal[k]) * to_window
            square += to_window * to_window
        if along > 0:
            a2 = along * along / square
            a4 = a2 * a2
            a8 = a4 * a4
            a16 = a8 * a8
            lobe = a4 * a8 * a16 * a16 * a16  # to the 60th: satin lacquer
            for k in range(3):
                total[k] += np.float32(strength * lobe) * power[w, k]


@njit(cache=True, nogil=True)
def looked_at(x, normal, eye, least_cosine):
    """(N,) whether `eye` looks at points (N, 3) with normals (N, 3) from less than an angle off the normal."""
    out = np.empty(len(x), np.bool_)
    for n in range(len(x)):
        along = square = 0.0
        for k in range(3):
            toward = np.float32(eye[k] - x[n, k])
            along += toward * normal[n, k]
            square += toward * toward
        out[n] = along > least_cosine * np.sqrt(square)
    return out
