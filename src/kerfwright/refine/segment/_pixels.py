"""Compiled loops over the pixels of rectified photographs. They let go of the interpreter: two boards run at once."""

from __future__ import annotations

import numpy as np
from numba import njit

from kerfwright.capture._lens import bilinear, pixel_of

__all__ = [
    "ALONG", "STEEPEST", "add_contrast", "add_seen", "apart_from_others", "channel_medians", "disagreement_of",
    "nearest_centres", "rectified",
]

STEEPEST = 8.0  # one view's contrast says no more than this: a glint must not outvote the rest
ALONG = ((0, 1), (1, 0), (1, 1), (1, -1))  # rows and columns to neighbours right, down, and both diagonals


@njit(cache=True, nogil=True, error_model="numpy")
def rectified(image, camera_from_plane, lens, shrink, origin, pixel, rows, columns):
    """A photograph on a raster: (rows, columns, 3) uint8 and what of it the photograph holds.

    camera_from_plane : (3, 3), of (x, y, 1) on the plane; image : the photograph shrunk by `shrink`, uint8 RGB.
    """
    out, held = np.empty((rows, columns, 3), np.uint8), np.empty((rows, columns), np.bool_)
    m, right, low = camera_from_plane, image.shape[1] - 1, image.shape[0] - 1
    for i in range(rows):
        y = origin[1] + (i + 0.5) * pixel
        for j in range(columns):
            x = origin[0] + (j + 0.5) * pixel
            depth = m[2, 0] * x + m[2, 1] * y + m[2, 2]
            u, v = np.nan, np.nan
            if depth > 0:
                across = (m[0, 0] * x + m[0, 1] * y + m[0, 2]) / depth
                u, v = pixel_of(across, (m[1, 0] * x + m[1, 1] * y + m[1, 2]) / depth, lens)
                u, v = u / shrink - 0.5, v / shrink - 0.5
            held[i, j] = u >= 0 and v >= 0 and u <= right and v <= low
            u = min(max(u, 0.0), right - 1e-6) if u == u else 0.0
            v = min(max(v, 0.0), low - 1e-6) if v == v else 0.0
            for channel in range(3):
                out[i, j, channel] = np.uint8(bilinear(image, u, v, channel) + 0.5)
    return out, held


@njit(cache=True, nogil=True)
def channel_medians(image, mask):
    """(3,) medians of the channels of a uint8 image inside a mask; NaN where the mask is empty."""
    counts = np.zeros((3, 256), np.int64)
    for i in range(mask.shape[0]):
        for j in range(mask.shape[1]):
            if mask[i, j]:
                for channel in range(3):
                    counts[channel, image[i, j, channel]] += 1
    total = counts[0].sum()
    medians = np.full(3, np.nan)
    for channel in range(3):
        below, lower = 0, -1
        for value in range(256):
            below += counts[channel, value]
            if lower < 0 and 2 * below >= total and total:
                lower = value
            if 2 * below > total:
                medians[channel] = (lower + value) / 2
                break
    return medians


@njit(cache=True, nogil=True, error_model="numpy")
def add_contrast(lab, seen, inside, total):
    """Add, where `seen`, the squared colour steps to each of four neighbours over those usual inside the board.

    lab (rows, columns, 3); total (4, rows, columns), changed in place.
    """
    rows, columns = seen.shape
    steps, count = 0.0, 0
    some = inside.any()
    for only_add in (False, True):
        usual = 4 * max(steps / max(count, 1), 1.0)
        for i in range(rows):
            for j in range(columns):
                if not (seen[i, j] if only_add else inside[i, j] or not some):
                    continue
                for k in range(4):
                    down, right = ALONG[k]
                    a, b = i + down, j + right
                    step = 0.0
                    if a < rows and 0 <= b < columns:
                        for channel in range(3):
                            way = lab[a, b, channel] - lab[i, j, channel]
                            step += way * way
                    if only_add:
                        total[k, i, j] += min(step / usual, STEEPEST)
                    else:
                        steps += step
                        count += 1


@njit(cache=True, nogil=True)
def add_seen(lab, seen, total, count):
    """Add a view's colours, where it sees, to the sums (rows, columns, 3) and (rows, columns) of its side, in place."""
    for i in range(seen.shape[0]):
        for j in range(seen.shape[1]):
            if seen[i, j]:
                count[i, j] += 1
                for channel in range(3):
                    total[i, j, channel] += lab[i, j, channel]


@njit(cache=True, nogil=True, error_model="numpy")
def apart_from_others(lab, seen, total, count):
    """(rows, columns, 3) mean of the other views of a side, (rows, columns) square of the colour's distance from it.

    total, count : sums over the side's views, this one's included where it sees; NaN where no other view sees a pixel.
    """
    rows, columns = seen.shape
    others, apart = np.empty((rows, columns, 3), np.float32), np.empty((rows, columns), np.float32)
    for i in range(rows):
        for j in range(columns):
            own = 1 if seen[i, j] else 0
            rest = count[i, j] - own
            square = np.float32(0.0)
            for channel in range(3):
                mean = np.float32(np.nan)
                if rest > 0:
                    mean = (total[i, j, channel] - own * lab[i, j, channel]) / rest
                others[i, j, channel] = mean
                square += (lab[i, j, channel] - mean) ** 2
            apart[i, j] = square
    return others, apart


@njit(cache=True, nogil=True, error_model="numpy")
def disagreement_of(labs, seen, sides, least):
    """See `openings.disagreement`; labs (V, rows, columns, 3), seen (V, rows, columns), sides (V,) +-1."""
    views, rows, columns = seen.shape
    out = np.full((rows, columns), np.float32(np.nan))
    for i in range(rows):
        for j in range(columns):
            total, freedom = 0.0, 0
            for side in (-1, 1):
                count = 0
                a, b, c = 0.0, 0.0, 0.0
                for v in range(views):
                    if sides[v] == side and seen[v, i, j]:
                        count += 1
                        a += labs[v, i, j, 0]
                        b += labs[v, i, j, 1]
                        c += labs[v, i, j, 2]
                if count < least:
                    continue
                a, b, c = a / count, b / count, c / count
                sum_apart, worst = 0.0, 0.0
                for v in range(views):
                    if sides[v] == side and seen[v, i, j]:
                        x, y, z = labs[v, i, j, 0] - a, labs[v, i, j, 1] - b, labs[v, i, j, 2] - c
                        apart = x * x + y * y + z * z
                        sum_apart += apart
                        worst = max(worst, apart)
                total += max(sum_apart - worst * count / (count - 1), 0.0)
                freedom += count - 2
            if freedom:
                out[i, j] = total / freedom
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_centres(colours, centres, rounds):
    """k-means: (N,) labels of (N, 3) colours after so many rounds; `centres` (k, 3) are changed in place."""
    labels, sums = np.zeros(len(colours), np.int64), np.zeros((len(centres), 4))
    for _ in range(rounds):
        sums[:] = 0
        for i in range(len(colours)):
            best = np.inf
            for k in range(len(centres)):
                square = 0.0
                for channel in range(3):
                    square += (colours[i, channel] - centres[k, channel]) ** 2
                if square < best:
                    best, labels[i] = square, k
            own = sums[labels[i]]
            own[3] += 1
            for channel in range(3):
                own[channel] += colours[i, channel]
        for k in range(len(centres)):
            if sums[k, 3]:
                centres[k] = sums[k, :3] / sums[k, 3]
    return labels
