"""Compiled projection: from world to pixels in one pass, and photographs read there.

A lens is (15,) float64: fx, fy, cx, cy, k1 to k6, p1, p2, shear, the square of the fold, and its kind, one of PINHOLE,
POLYNOMIAL, RATIONAL, EQUIDISTANT. The functions let go of the interpreter, so that two threads run them at once.
"""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["EQUIDISTANT", "PINHOLE", "POLYNOMIAL", "RATIONAL", "bilinear", "pixel_of", "project_points", "read_points"]

PINHOLE, POLYNOMIAL, RATIONAL, EQUIDISTANT = 0.0, 1.0, 2.0, 3.0


@njit(cache=True, nogil=True, error_model="numpy")
def pixel_of(x, y, lens):
    """Pixel of a place (x, y) on the plane z = 1; NaN beyond the fold."""
    if lens[14] != PINHOLE:
        r2 = x * x + y * y
        if not r2 < lens[13]:
            return np.nan, np.nan
        k1, k2, k3, k4 = lens[4], lens[5], lens[6], lens[7]
        if lens[14] == EQUIDISTANT:
            r = np.sqrt(r2)
            angle = np.arctan(r)
            a2 = angle * angle
            radial = (angle / r if r > 1e-9 else 1.0) * (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))
        elif lens[14] == RATIONAL:
            radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (lens[8] + r2 * lens[9])))
        else:
            radial = 1 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)))
        p1, p2 = lens[10], lens[11]
        u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        x, y = u + lens[12] * v, v
    return x * lens[0] + lens[2], y * lens[1] + lens[3]


@njit(cache=True, nogil=True, error_model="numpy")
def project_points(x_in_world, pose, lens):
    """(N, 3) world to (N, 2) pixels, NaN where depth <= 0 and beyond the fold, and (N,) depth; pose (4, 4)."""
    pixels, depth = np.empty((len(x_in_world), 2)), np.empty(len(x_in_world))
    for i in range(len(x_in_world)):
        a, b, c = x_in_world[i, 0], x_in_world[i, 1], x_in_world[i, 2]
        z = pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c + pose[2, 3]
        depth[i] = z
        if z > 0:
            x = pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c + pose[0, 3]
            y = pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c + pose[1, 3]
            pixels[i, 0], pixels[i, 1] = pixel_of(x / z, y / z, lens)
        else:
            pixels[i, 0] = pixels[i, 1] = np.nan
    return pixels, depth


@njit(cache=True, nogil=True, error_model="numpy")
def bilinear(image, u, v, channel):
    """One channel of an (H, W, 3) uint8 image between the centres of its pixels; u, v inside, whole at centres."""
    column, row = int(u), int(v)
    a, b = u - column, v - row
    above = (1 - a) * image[row, column, channel] + a * image[row, column + 1, channel]
    below = (1 - a) * image[row + 1, column, channel] + a * image[row + 1, column + 1, channel]
    return (1 - b) * above + b * below


@njit(cache=True, nogil=True, error_model="numpy")
def read_points(image, x_in_world, pose, lens):
    """(N, 3) float32 RGB that an (H, W, 3) uint8 photograph shows at (N, 3) points; NaN outside of it."""
    colours = np.empty((len(x_in_world), 3), np.float32)
    height, width = image.shape[:2]
    for i in range(len(x_in_world)):
        a, b, c = x_in_world[i, 0], x_in_world[i, 1], x_in_world[i, 2]
        z = pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c + pose[2, 3]
        colours[i] = np.nan
        if not z > 0:
            continue
        x = pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c + pose[0, 3]
        y = pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c + pose[1, 3]
        u, v = pixel_of(x / z, y / z, lens)
        u, v = u - 0.5, v - 0.5  # the first pixel's centre is at .5
        if u > 0 and v > 0 and u < width - 1 and v < height - 1:
            for channel in range(3):
                colours[i, channel] = bilinear(image, u, v, channel)
    return colours
