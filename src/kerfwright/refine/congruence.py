"""Motions that lay one traced outline on another, mirrored or not, and whether they are then one within their errors.

Start: of two closed curves sampled evenly along themselves, the best turn for every shift of the start is one circular
correlation of complex numbers. Finish: least squares of distances across the boundary.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.spatial import cKDTree

from kerfwright.refine.types import BoundaryLoop

__all__ = ["Contour", "agree", "best_motion", "contour_of", "moved_points"]

SAMPLES = 360
STARTS = 6  # turns that are tried: a rectangle has two, a square four
STEPS = 12
LEAST_LIMIT = 0.05  # mm; what has to lie exactly is no outlier before
WINDOW = 9  # samples over which a local difference is averaged
LOCAL_SIGMAS = 3.0  # by which that average may differ: a notch that only one of two boards has
WHOLE_SIGMAS = 1.5  # ... and a stretch from corner to corner: many samples agree on it
LEAST_STRETCH = 12  # samples
CORNER = np.radians(30)


@dataclass(frozen=True, eq=False)
class Contour:
    """All loops of a board in one: points (N, 2), what is before and after each, and its standard error (N,), mm."""

    points: np.ndarray
    before: np.ndarray
    after: np.ndarray
    error: np.ndarray
    loop: np.ndarray
    tree: cKDTree

    def across(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Signed distances (M,) of points to the boundary, its outward normals there (M, 2), and vertices (M,)."""
        _, k = self.tree.query(x)
        one = _to_stretch(x, self.points[self.before[k]], self.points[k])
        two = _to_stretch(x, self.points[k], self.points[self.after[k]])
        nearer = np.abs(one[2]) <= np.abs(two[2])
        return np.where(nearer, one[0], two[0]), np.where(nearer[:, None], one[1], two[1]), k


def _to_stretch(x: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distances across straight stretches, outward normals, and true distances to them."""
    along = b - a
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-12)
    along = along / length[:, None]
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    across = np.einsum("ij,ij->i", x - a, normal)
    t = np.einsum("ij,ij->i", x - a, along)
    beside = t - np.clip(t, 0.0, length)
    return across, normal, np.hypot(across, beside)


def contour_of(loops: Sequence[BoundaryLoop]) -> Contour:
    """The loops of a board as one contour."""
    sizes = [len(loop.points) for loop in loops]
    first = np.cumsum([0, *sizes[:-1]])
    before = np.concatenate([f + np.roll(np.arange(n), 1) for f, n in zip(first, sizes, strict=True)])
    after = np.concatenate([f + np.roll(np.arange(n), -1) for f, n in zip(first, sizes, strict=True)])
    points = np.concatenate([loop.points for loop in loops])
    error = np.concatenate([loop.standard_error for loop in loops])
    return Contour(points, before, after, error, np.repeat(np.arange(len(sizes)), sizes), cKDTree(points))


def moved_points(motion: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(N, 2) points after a (2, 3) motion."""
    return x @ motion[:, :2].T + motion[:, 2]


def best_motion(a: Contour, b: Contour, error_a: np.ndarray, error_b: np.ndarray) -> np.ndarray | None:
    """The motion (2, 3) that lays b on a within their errors, without a mirror if it can; None when there is none.

    Parameters
    ----------
    error_a, error_b : (N,), (M,) errors that weigh the alignment; small where a point has to come to lie exactly.
    """
    for mirrored in (False, True):
        refined = [_refined(start, a, b, error_a, error_b) for start in _starts(a, b, mirrored)]
        fitting = [(cost, n) for n, (motion, cost) in enumerate(refined) if agree(a, b, motion)]
        if fitting:
            return refined[min(fitting)[1]][0]
    return None


def _even(contour: Contour) -> np.ndarray:
    """The outer loop as complex numbers, evenly spaced along itself."""
    ring = contour.points[contour.loop == 0]
    closed = np.vstack([ring, ring[:1]])
    place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    at = np.arange(SAMPLES) * place[-1] / SAMPLES
    return np.interp(at, place, closed[:, 0]) + 1j * np.interp(at, place, closed[:, 1])


def _starts(a: Contour, b: Contour, mirrored: bool) -> Iterator[np.ndarray]:
    """The turns that correlate best, each with the shift of its centre."""
    za, zb = _even(a), _even(b)
    zb = np.conj(zb)[::-1] if mirrored else zb
    middle_a, middle_b = za.mean(), zb.mean()
    match = np.fft.ifft(np.fft.fft(za - middle_a) * np.conj(np.fft.fft(zb - middle_b)))
    size = np.abs(match)
    peaks = np.flatnonzero((size >= np.roll(size, 1)) & (size > np.roll(size, -1)))
    for k in sorted(peaks, key=lambda k: (-size[k], k))[:STARTS]:
        turn = match[k] / size[k]
        shift = middle_a - turn * middle_b
        matrix = np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])
        yield np.column_stack([matrix @ np.diag([1.0, -1.0 if mirrored else 1.0]), [shift.real, shift.imag]])


def _refined(
    motion: np.ndarray, a: Contour, b: Contour, error_a: np.ndarray, error_b: np.ndarray
) -> tuple[np.ndarray, float]:
    """Gauss-Newton over turn and shift, far points weighted down (Huber); the motion and its cost a point."""
    centre, cost = a.points.mean(axis=0), np.inf
    for _ in range(STEPS):
        x = moved_points(motion, b.points)
        distance, normal, k = a.across(x)
        error = np.hypot(error_a[k], error_b)
        limit = np.maximum(2.0 * error, LEAST_LIMIT)
        root = np.sqrt(limit / np.maximum(np.abs(distance), limit)) / error
        cost = float(np.mean((root * distance) ** 2))
        lever = x - centre
        slope = np.column_stack([normal, normal[:, 1] * lever[:, 0] - normal[:, 0] * lever[:, 1]])
        dx, dy, turn = np.linalg.lstsq(slope * root[:, None], -distance * root, rcond=1e-9)[0]
        matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        shift = centre + np.array([dx, dy]) - matrix @ centre
        motion = np.column_stack([matrix @ motion[:, :2], matrix @ motion[:, 2] + shift])
    return motion, cost


def agree(a: Contour, b: Contour, motion: np.ndarray) -> bool:
    """Whether two boundaries are one within their standard errors: everywhere, and along each stretch as a whole."""
    distance, _, k = a.across(moved_points(motion, b.points))
    if not _is_nothing(b, distance, np.hypot(a.error[k], b.error)):
        return False
    back = np.linalg.inv(np.vstack([motion, [0, 0, 1]]))[:2]
    distance, _, k = b.across(moved_points(back, a.points))
    return _is_nothing(a, distance, np.hypot(b.error[k], a.error))


def _is_nothing(contour: Contour, distance: np.ndarray, error: np.ndarray) -> bool:
    off = distance / error
    for number in range(contour.loop.max() + 1):
        mine = np.flatnonzero(contour.loop == number)
        if np.abs(uniform_filter1d(off[mine], WINDOW, mode="wrap")).max() > LOCAL_SIGMAS:
            return False
        if any(abs(off[mine[s]].mean()) > WHOLE_SIGMAS for s in _stretches(contour.points[mine])):
            return False
    return True


def _stretches(ring: np.ndarray) -> list[np.ndarray]:
    """Samples between corners, as indices; all of them where there is no corner."""
    reach = 3
    into, out = ring - np.roll(ring, reach, axis=0), np.roll(ring, -reach, axis=0) - ring
    turn = np.abs(np.arctan2(into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0], np.einsum("ij,ij->i", into, out)))
    corner = np.flatnonzero(turn > CORNER)
    if not len(corner):
        return [np.arange(len(ring))]
    runs = [np.arange(p + 1, q) % len(ring) for p, q in zip(corner, [*corner[1:], corner[0] + len(ring)], strict=True)]
    return [run for run in runs if len(run) >= LEAST_STRETCH]
