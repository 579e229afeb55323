"""Thickness of boards that show too little of their own: what the object's other boards say of them.

Slats side by side hide each other's cut faces, and shelves deep in a case show none. But boards come in repeats: an
edge that is faint in the photographs counts when another board shows it at the same depth, and a board as long and as
wide as one that was seen well is as thick.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from shapely.geometry import Polygon

from kerfwright.capture.types import Capture
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.options import IdentifyOptions
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.rims import Rim
from kerfwright.identify.thickness import ThicknessHypothesis, from_cut_faces, from_photos, sharpened
from kerfwright.identify.types import Neighbourhood

__all__ = ["Known", "told_by_others"]

FAINT = 2.0  # strength of an edge that counts when another board shows it too
ALIKE = 0.04  # relative difference of two thicknesses that may be one
SAME_SIZE = 0.05  # relative difference of the sides of two boards that may be twins
SAME_AREA = 0.7  # least share of a twin's area: the front edges of a case make a frame as large as its sides
THICK = 1 / 20  # of D; cut faces that go deeper are those of other boards beside
CUT_ERROR = 0.15  # relative standard error of a thickness that only cut faces in the cloud tell
TWIN_ERROR = 0.05  # relative standard error of a thickness that a twin told


@dataclass(frozen=True, eq=False)
class Known:
    """A region of a sheet plane with its rim, and the thicknesses that it may have, best evidence first."""

    top: tuple[int, ...]  # coplanar primitives
    frame: np.ndarray  # world_from_top
    piece: Polygon
    rim: Rim
    hypotheses: tuple[ThicknessHypothesis, ...]
    told: bool = False  # not by its own clear evidence: what other boards fill is none of this board's
    shown: tuple[ThicknessHypothesis, ...] = ()  # every edge that photographs show, what hides it thought away

    @property
    def best(self) -> ThicknessHypothesis | None:
        """The best supported thickness."""
        return self.hypotheses[0] if self.hypotheses else None

    @property
    def sides(self) -> np.ndarray:
        """Length and width of the smallest rectangle about the region, (2,) mm."""
        corners = np.asarray(self.piece.minimum_rotated_rectangle.exterior.coords)
        return np.sort(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1))[::-1]


class _Scene(Protocol):
    capture: Capture
    around: Neighbourhood
    photos: Photos
    free: FreeSpace
    options: IdentifyOptions
    diameter: float
    thickness_limits: tuple[float, float]

    def is_broad(self, piece: Polygon) -> bool: ...


def told_by_others(known: list[Known], scene: _Scene) -> list[Known]:
    """Regions without a thickness of their own with those that faint edges and twins give them."""
    open_ = [i for i, k in enumerate(known) if not k.hypotheses and scene.is_broad(k.piece)]
    faint = {i: _faint(known[i], scene) for i in open_}
    out = list(known)
    for i in open_:
        others = [h.value for k in known if k is not known[i] for h in k.hypotheses[:1]]
        others += [h.value for j in open_ if j != i for h in faint[j]]
        backed = [h for h in faint[i] if any(abs(h.value - v) < ALIKE * h.value for v in others)]
        if backed:
            out[i] = replace(known[i], hypotheses=tuple(backed[:1]), told=True)
    told = list(out)
    for i in open_:
        twin = None if out[i].hypotheses else _twin(out[i], out)
        if twin is not None:
            told[i] = replace(out[i], hypotheses=(twin,), told=True)
        elif not out[i].hypotheses and (seen := _by_cut_faces(out[i], scene)) is not None:
            told[i] = replace(out[i], hypotheses=(sharpened(seen, faint[i]),), told=True)
    return told


def _faint(known: Known, scene: _Scene) -> list[ThicknessHypothesis]:
    """Edges in the photographs that show the cut face itself, clear ones and faint ones; then those that other boards
    may hide, thought away.
    """
    found = from_photos(
        known.frame, known.rim, scene.photos, scene.thickness_limits,
        step=scene.diameter * scene.options.sweep_step, free=scene.free,
    )
    return [h for h in (*found, *known.shown) if h.support > FAINT]


def _by_cut_faces(known: Known, scene: _Scene) -> ThicknessHypothesis | None:
    """Where the cloud's points on the cut faces end: rough, for stereo blurs both edges, but seen."""
    found = from_cut_faces(known.frame, known.piece, scene.capture.cloud, scene.around, scene.thickness_limits)
    found = [h for h in found if h.value < THICK * scene.diameter]
    if not found:
        return None
    best = max(found, key=lambda h: h.support)
    return replace(best, standard_error=max(best.standard_error, CUT_ERROR * best.value))


def _twin(known: Known, others: list[Known]) -> ThicknessHypothesis | None:
    """The thickness of boards of the same length and width, if they agree."""
    sides = known.sides
    seen = [k for k in others if k.best is not None and k.best.evidence in ("opposite", "photos")]
    alike = [k for k in seen if (abs(k.sides / sides - 1) < SAME_SIZE).all()]
    values = [k.best.value for k in alike if k.piece.area < known.piece.area / SAME_AREA]
    if not values or np.ptp(values) > 2 * ALIKE * np.median(values):
        return None
    value = float(np.median(values))
    return ThicknessHypothesis(value, TWIN_ERROR * value, "twin", known.piece.area)
