"""The face of a board as the photographs show it, flattened and averaged into strips that run across a line looked for.

A strip is a profile of colours along `m`, averaged over a short stretch of the direction square to it. Strips of all
views lie on one grid: what does not lie in the face (things in front of it, mirror images) does not agree in them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles

__all__ = ["FaceStrips", "face_strips"]

STEP = 1 / 1000  # of D, between samples: about half a pixel of an object that fills a photograph of 1024
STRIP = 12  # steps along the line that one strip averages: fine grain goes, its wandering stays
READ = 6  # samples of them
LOOK = 1 / 60  # of D, between places whose visibility is tested
GRAZING = 0.35  # least cosine between face normal and line of sight
MOST_VIEWS = 12  # the best; more showed no joint of made panels (seeds 1000 to 1011) any better
LEAST_SEEN = 0.3  # share of the face that a view must show
RIM = 1 / 150  # of D, by which an outline may be off; colours there may be the background's
DARKEST = 2.0  # grey level; darker ones tell nothing, and their logarithm would


@dataclass(frozen=True, eq=False)
class FaceStrips:
    """Logarithms of colours (V, U, C, 3) of V views at U offsets along m and in C strips; NaN where unseen."""

    offsets: np.ndarray  # (U,) mm, board frame, along m
    middles: np.ndarray  # (C,) mm, of the strips, along the tangent (-m[1], m[0])
    colours: np.ndarray


def face_strips(
    sheet: Sheet, m: np.ndarray, face: str, photos: Photos, obstacles: Obstacles, diameter: float
) -> FaceStrips | None:
    """Strips of the views that show a face ("top" or "bottom") best; None when none does."""
    tangent = np.array([-m[1], m[0]])
    ring = np.asarray(sheet.region.exterior.coords)[:, :2]
    across, along = ring @ m, ring @ tangent
    step = STEP * diameter
    offsets = np.arange(across.min(), across.max(), step)
    count = int(np.ptp(along) / (STRIP * step))
    if not count or not len(offsets):
        return None
    middles = along.min() + (np.arange(count) + 0.5) * STRIP * step
    level = sheet.thickness.value if face == "top" else 0.0

    def places(v: np.ndarray, u: np.ndarray = offsets) -> np.ndarray:
        xy = (u[:, None, None] * m + v[None, :, None] * tangent).reshape(-1, 2)
        return sheet.to_world(np.c_[xy, np.full(len(xy), level)])

    every = max(1, round(LOOK / STEP))
    seen = _seen(sheet, face, photos, obstacles, places(middles, offsets[::every]))
    best = _best_views(sheet, face, photos, seen)
    if not best:
        return None
    fine = (middles[:, None] + (np.arange(READ) - (READ - 1) / 2) * STRIP / READ * step).ravel()
    inner = _inside(sheet, m, offsets, middles, RIM * diameter)
    world = places(fine)
    colours = []
    for k in best:
        shown = np.repeat(seen[k].reshape(-1, count), every, axis=0)[: len(offsets)]
        own = _read(photos, k, world, (len(offsets), count))
        own[~(shown & inner)] = np.nan
        colours.append(own)
    return FaceStrips(offsets, middles, np.array(colours))


def _seen(sheet: Sheet, face: str, photos: Photos, obstacles: Obstacles, places: np.ndarray) -> np.ndarray:
    """(V, N) bool."""
    outward = sheet.normal if face == "top" else -sheet.normal
    return obstacles.visible(photos.views, places, outward, GRAZING)


def _best_views(sheet: Sheet, face: str, photos: Photos, seen: np.ndarray) -> list[int]:
    """Views that show much of the face, the least slanted first."""
    middle = sheet.to_world(np.array([[*np.asarray(sheet.region.centroid.coords[0]), 0.0]]))[0]
    outward = sheet.normal if face == "top" else -sheet.normal
    sight = np.array([view.centre - middle for view in photos.views]).reshape(-1, 3)
    facing = (sight @ outward) / np.linalg.norm(sight, axis=1)
    share = seen.mean(axis=1) if seen.size else np.zeros(len(seen))
    ranked = np.argsort(-share * facing, kind="stable")
    return sorted(int(k) for k in ranked[:MOST_VIEWS] if share[k] > LEAST_SEEN)


def _inside(sheet: Sheet, m: np.ndarray, offsets: np.ndarray, middles: np.ndarray, rim: float) -> np.ndarray:
    """(U, C) bool: which places lie well inside the region."""
    core = sheet.region.buffer(-rim)
    xy = offsets[:, None, None] * m + middles[None, :, None] * np.array([-m[1], m[0]])
    return shapely.contains_xy(core, xy[..., 0], xy[..., 1])


def _read(photos: Photos, k: int, world: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """One view's strips (U, C, 3), about their own middle: exposures differ."""
    colours = photos.colours(k, world)
    strips = np.log(np.maximum(colours, DARKEST)).reshape(*shape, READ, 3).mean(axis=2)
    known = strips[np.isfinite(strips[..., 0])]
    return strips - np.median(known, axis=0) if len(known) else strips
