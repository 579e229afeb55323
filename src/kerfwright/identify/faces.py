"""Where sheet planes lie, measured in the photographs themselves.

A stereo program may put whole faces too far out: on two of the captures every face stands off by .3 to .5 mm, three
times the noise of its points. The grain of the wood tells: read in several photographs along a plane that is moved
along its normal, it agrees best where the face is, to some hundredths of a millimetre. What the well seen faces say of
the stereo points is then true of the others as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely

from kerfwright.capture.types import Cloud
from kerfwright.identify.photo_edges import Photos, refine_peak
from kerfwright.identify.types import Sheet
from kerfwright.model import Quantity
from kerfwright.parallel import each

__all__ = ["Faces", "believed", "measured_faces", "moved", "robust_mean", "stereo_bias", "with_thickness"]

WINDOW, SPACING = 1 / 31, 1 / 625  # of D: side of a window of grain, and between places that are read in it
WINDOWS, VIEWS, LEAST_VIEWS = 30, 7, 4
REACH, STEP = 1 / 300, 1 / 5000  # of D: how far a plane may be off, and between the planes that are tried
FACING = 0.35  # cosine between a view and the face's normal below which grain is too foreshortened
CONTRAST = 2.0  # grey levels of grain below which a window tells nothing
AGREEMENT = 0.5  # correlation that two views of one window must reach somewhere
LEAST_WINDOWS = 3
BEST_ERROR, WORST_ERROR = 1 / 10000, 1 / 2000  # of D: of one face; a worse measurement is none
LEAST_POINTS = 100
STEREO_SHARE = 0.5  # of the spread of a face's points, by which dim faces are shifted, whatever the number of points
ASTRAY = 4.0  # standard errors between grain and stereo beyond which the grain is not this face's
LEAST_FACES = 2  # that must agree on a bias of stereo


@dataclass(frozen=True, eq=False)
class Faces:
    """How far (B, 2) top and bottom faces lie outside the planes of their sheets, with standard errors, infinite where
    nothing tells.
    """

    offset: np.ndarray
    error: np.ndarray


def measured_faces(sheets: Sequence[Sheet], cloud: Cloud, photos: Photos, noise: float) -> Faces:
    """The faces of all boards: from photographs, and from stereo points less the bias that these show.

    Parameters
    ----------
    noise : standard deviation of the cloud across its surface: what a face's points alone are good for.
    """
    size = cloud.diameter
    seen = each(lambda s: [_grain_offset(s, side, photos, size) for side in (0, 1)], sheets)
    stereo = [[_stereo_offset(s, side, cloud) for side in (0, 1)] for s in sheets]
    bias, scatter = stereo_bias(seen, stereo, noise)
    seen = believed(seen, stereo, bias, scatter)
    offset, error = np.zeros((len(sheets), 2)), np.full((len(sheets), 2), np.inf)
    for k in range(len(sheets)):
        for side in (0, 1):
            told = [seen[k][side]] if seen[k][side] is not None else []
            if stereo[k][side] is not None:
                told.append((stereo[k][side][0] + bias, max(scatter, stereo[k][side][1])))
            if told:
                values, errors = np.array(told).T
                offset[k, side] = np.average(values, weights=errors**-2)
                error[k, side] = (errors**-2).sum() ** -0.5
    return Faces(offset, error)


def stereo_bias(seen, stereo, noise: float) -> tuple[float, float]:
    """How far faces lie outside their stereo points, and the standard error of a single face that this is said of."""
    both = [pair for rows in zip(seen, stereo, strict=True) for pair in zip(*rows, strict=True)]
    pairs = [(s[0] - d[0], np.hypot(s[1], d[1])) for s, d in both if s is not None and d is not None]
    if len(pairs) < LEAST_FACES:
        return 0.0, 2 * noise
    values, errors = np.array(pairs).T
    bias, _ = robust_mean(values, np.hypot(errors, noise))
    scatter = 1.4826 * float(np.median(np.abs(values - bias)))
    return bias, float(max(scatter, noise))


def believed(seen, stereo, bias: float, scatter: float):
    """What photographs say of faces, None where stereo points, less the others' bias, lie elsewhere: shadows and what
    stands on a board can agree between views as well as grain does.
    """
    def agrees(told, points) -> bool:
        if points is None:
            return True
        return abs(told[0] - points[0] - bias) < ASTRAY * np.linalg.norm([scatter, told[1], points[1]])

    return [
        [t if t is not None and agrees(t, p) else None for t, p in zip(*sides, strict=True)]
        for sides in zip(seen, stereo, strict=True)
    ]


def robust_mean(values: np.ndarray, errors: np.ndarray) -> tuple[float, float]:
    """Mean weighted by errors, outliers weighted down (Geman-McClure from the weighted median on); its standard error.
    """
    order = np.argsort(values, kind="stable")
    share = np.cumsum(errors[order] ** -2.0)
    mean = float(values[order][np.searchsorted(share, share[-1] / 2)])
    for _ in range(20):
        weight = errors**-2.0 / (1 + ((values - mean) / (2 * errors)) ** 2) ** 2
        mean = float(np.average(values, weights=weight))
    return mean, float(weight.sum() ** -0.5)


def _stereo_offset(sheet: Sheet, side: int, cloud: Cloud) -> tuple[float, float] | None:
    """Median distance of a face's points outside its plane; the error that their spread lets one expect."""
    idx = (sheet.top_idx, sheet.bottom_idx)[side]
    if len(idx) < LEAST_POINTS:
        return None
    z = sheet.to_board(cloud.points[idx])[:, 2]
    outside = z - sheet.thickness.value if side == 0 else -z
    middle = float(np.median(outside))
    return middle, STEREO_SHARE * 1.4826 * float(np.median(np.abs(outside - middle)))


def _grain_offset(sheet: Sheet, side: int, photos: Photos, size: float) -> tuple[float, float] | None:
    """How far a face lies outside its plane, and its standard error, where views of its grain tell."""
    if len((sheet.top_idx, sheet.bottom_idx)[side]) < LEAST_POINTS:
        return None
    places = _windows(sheet, side, size)
    normal = sheet.normal if side == 0 else -sheet.normal
    views = _facing(photos, places, normal) if len(places) else []
    if len(views) < LEAST_VIEWS:
        return None
    offsets = np.arange(-REACH * size, (REACH + STEP / 2) * size, STEP * size)
    grain = [_grain(photos, k, places, normal, offsets) for k in views]
    curves = [curve for a, b in combinations(grain, 2) if (curve := _agreement(a, b)) is not None]
    return _best_offset(curves, offsets, size)


def _windows(sheet: Sheet, side: int, size: float) -> np.ndarray:
    """(W, P, 3) places in windows spread over a face, away from its rim."""
    inner = sheet.region.buffer(-0.8 * WINDOW * size)
    if inner.is_empty:
        return np.zeros((0, 0, 3))
    low_x, low_y, high_x, high_y = inner.bounds
    step = np.sqrt(inner.area / WINDOWS)
    grid = np.stack(np.meshgrid(np.arange(low_x + step / 2, high_x, step), np.arange(low_y + step / 2, high_y, step)))
    middles = grid.reshape(2, -1).T
    middles = middles[shapely.contains_xy(inner, middles[:, 0], middles[:, 1])]
    if not len(middles):
        middles = np.array([inner.representative_point().coords[0]])
    across = (np.arange(round(WINDOW / SPACING)) + 0.5) * SPACING * size - WINDOW * size / 2
    window = np.stack(np.meshgrid(across, across)).reshape(2, -1).T
    flat = middles[:, None] + window[None]
    z = np.full((*flat.shape[:2], 1), sheet.thickness.value if side == 0 else 0.0)
    return sheet.to_world(np.concatenate([flat, z], axis=2).reshape(-1, 3)).reshape(*flat.shape[:2], 3)


def _facing(photos: Photos, places: np.ndarray, normal: np.ndarray) -> list[int]:
    """The views that look at a face most squarely, but not at a glance."""
    ray = np.array([view.centre for view in photos.views]).reshape(-1, 3) - places.mean(axis=(0, 1))
    cosine = ray @ normal / np.linalg.norm(ray, axis=1)
    order = np.argsort(-cosine, kind="stable")[:VIEWS]
    return [int(k) for k in order if cosine[k] > FACING]


def _grain(photos: Photos, k: int, places: np.ndarray, normal: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """(T, W, P) grey values of a view in each window at each offset, with mean 0 and deviation 1; NaN where flat."""
    x = places[None] + offsets[:, None, None, None] * normal
    grey = photos.colours(k, x).mean(axis=3)
    grey = grey - grey.mean(axis=2, keepdims=True)
    deviation = np.sqrt((grey**2).mean(axis=2, keepdims=True))
    return grey / np.where(deviation > CONTRAST, deviation, np.nan)


def _agreement(a: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """(T,) correlation of two views over the windows that both show."""
    each = np.einsum("twp,twp->tw", a, b) / a.shape[2]
    told = np.isfinite(each).all(axis=0)
    each = each[:, told]
    each = each[:, each.max(axis=0, initial=-1.0) > AGREEMENT]
    return each.sum(axis=1) if each.shape[1] >= LEAST_WINDOWS else None


def _best_offset(curves: Sequence[np.ndarray], offsets: np.ndarray, size: float) -> tuple[float, float] | None:
    """Where all pairs of views agree best; its error from the scatter of the pairs, of which views are independent."""
    if len(curves) < LEAST_VIEWS:
        return None
    best = _peak(np.sum(curves, axis=0), offsets)
    each = np.array([p for curve in curves if (p := _peak(curve, offsets)) is not None])
    if best is None or len(each) < LEAST_VIEWS:
        return None
    views = (1 + np.sqrt(1 + 8 * len(each))) / 2  # of which so many pairs can be made
    error = 1.4826 * float(np.median(np.abs(each - best))) / np.sqrt(views)
    return (best, float(np.hypot(error, BEST_ERROR * size))) if error < WORST_ERROR * size else None


def _peak(curve: np.ndarray, offsets: np.ndarray) -> float | None:
    k = int(curve.argmax())
    if not 0 < k < len(curve) - 1:
        return None
    return float(offsets[k] + refine_peak(curve[k - 1 : k + 2]) * (offsets[1] - offsets[0]))


def moved(sheet: Sheet, shift: float) -> Sheet:
    """The sheet moved along its normal."""
    board = sheet.world_from_board.copy()
    board[:3, 3] += shift * sheet.normal
    return replace(sheet, world_from_board=board)


def with_thickness(sheet: Sheet, thickness: Quantity) -> Sheet:
    """The sheet with another thickness; its top stays where it is."""
    board = sheet.world_from_board.copy()
    board[:3, 3] += (sheet.thickness.value - thickness.value) * sheet.normal
    return replace(sheet, world_from_board=board, thickness=thickness)
