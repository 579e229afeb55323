"""What each photograph says about each pixel of a board's plane: inside or outside, in nats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.types import Sheet
from kerfwright.refine.segment._pixels import add_seen, apart_from_others
from kerfwright.refine.segment.appearance import Mixture, fit_mixture, same_surface, with_shade
from kerfwright.refine.segment.grid import Grid
from kerfwright.refine.segment.options import SegmentOptions
from kerfwright.refine.segment.scene import BOARD, CLEAR, Occluders
from kerfwright.refine.segment.views import BoardView

__all__ = [
    "Bounds", "Seeds", "ViewEvidence", "average", "backed_pixels", "behind_cut_faces", "classes_on_grid",
    "cut_face_band", "free_pixels", "gather", "grown", "seeds_of", "side_sums", "signed_distance",
]

STRIDE = 3  # rays are cast for every third pixel: outlines of occluders are no better than that
OCCLUDER_ERROR = 0.5  # share of the outline error by which occluders are grown
PRIOR = 0.5  # nats for each outline error that a pixel lies inside the outline so far
PRIOR_REACH = 3.0  # outline errors
LEAST_TRUST = 0.15
NEAR_OUTLINE = 40.0  # mm
BACKING = 4  # cut-face points by a place on the outline that back it
WALLED = 8  # cut-face points that show where a board ends, whatever the photographs say
TONGUE = 12.0  # mm; stereo's fringe makes tongues narrower than twice this
MOSTLY = 0.7  # share of the cut-face points about that must lie on the outline
PARALLAX_CAP = 1.5  # nats from colours that agree, or not, between views
LEAST_PARALLAX = 500  # pixels to learn that from


@dataclass(frozen=True, eq=False)
class Bounds:
    """How far, mm, the outline so far may be off inwards (`error`) and outwards (`margin`): numbers or (rows, cols)."""

    error: np.ndarray | float
    margin: np.ndarray | float

    @property
    def least_error(self) -> float:
        return float(np.min(self.error))


@dataclass(frozen=True, eq=False)
class Seeds:
    """What is settled before the photographs are asked, and the distance to the outline so far."""

    inside: np.ndarray  # bool (rows, cols)
    outside: np.ndarray
    beyond: np.ndarray  # so far out that its colours are those of what lies outside
    distance: np.ndarray  # mm, positive inside the outline so far
    belief: np.ndarray  # how far inside, in errors of the outline


@dataclass(frozen=True, eq=False)
class ViewEvidence:
    """One photograph's say: nats for inside, and the weight of each pixel's say (0: not seen)."""

    nats: np.ndarray
    weight: np.ndarray
    seen: np.ndarray  # bool: not occluded


def signed_distance(mask: np.ndarray, pixel: float) -> np.ndarray:
    """Distance to the mask's boundary in mm, positive inside."""
    import cv2

    inner, outer = (cv2.distanceTransform(m.astype(np.uint8), cv2.DIST_L2, 5) for m in (mask, ~mask))
    return np.where(mask, inner - 0.5, 0.5 - outer) * pixel


def grown(mask: np.ndarray, by: float, pixel: float) -> np.ndarray:
    """The mask dilated by `by` mm (eroded when negative)."""
    import cv2

    if not mask.any():
        return mask
    distance = cv2.distanceTransform((mask if by < 0 else ~mask).astype(np.uint8), cv2.DIST_L2, 5)
    return (distance - 0.5) * pixel > -by if by < 0 else (0.5 - distance) * pixel > -by


def backed_pixels(
    mask: np.ndarray, beyond: np.ndarray, cut_points: np.ndarray, grid: Grid, error: float
) -> np.ndarray:
    """Pixels whose nearest place on the mask's outline is backed: cut-face points lie by it, or a contact (`beyond`).

    cut_points (N, 2) mm in the board's plane.
    """
    from scipy.ndimage import distance_transform_edt
    from scipy.spatial import cKDTree

    if not mask.any():
        return np.ones(mask.shape, bool)
    backed = grown(beyond, error / 2, grid.pixel)
    if len(cut_points):
        edge = np.argwhere(abs(signed_distance(mask, grid.pixel)) < 1.5 * grid.pixel)
        near = cKDTree(cut_points).query_ball_point(grid.to_xy(edge[:, ::-1]), error, return_length=True)
        backed[tuple(edge[near >= BACKING].T)] = True
    nearest = np.where(mask, *(distance_transform_edt(m, return_indices=True)[1] for m in (mask, ~mask)))
    return backed[tuple(nearest)]


def behind_cut_faces(mask: np.ndarray, cut_points: np.ndarray, grid: Grid, within: float) -> np.ndarray:
    """Pixels of the mask more than `within` mm behind places of its outline on which cut-face points lie, nearly all of
    those about: what stereo saw from outside is wood right up to there, however the light falls on it.

    cut_points (N, 2) mm in the board's plane.
    """
    from scipy.ndimage import distance_transform_edt
    from scipy.spatial import cKDTree

    walled = np.zeros(mask.shape, bool)
    if not mask.any() or len(cut_points) < WALLED:
        return walled
    distance = signed_distance(mask, grid.pixel)
    exact = np.abs(grid.lookup(distance, cut_points, np.inf)) < within
    edge = np.argwhere(abs(distance) < 1.5 * grid.pixel)
    places = grid.to_xy(edge[:, ::-1])
    about, on = (
        cKDTree(points).query_ball_point(places, 3 * within, return_length=True) if len(points) else np.zeros(len(edge))
        for points in (cut_points, cut_points[exact])
    )
    walled[tuple(edge[(on >= WALLED) & (on >= MOSTLY * about)].T)] = True
    nearest = distance_transform_edt(mask, return_indices=True)[1]
    broad = grown(grown(mask, -TONGUE, grid.pixel), TONGUE, grid.pixel)
    return mask & broad & (distance > within) & walled[tuple(nearest)]


def free_pixels(sheet: Sheet, grid: Grid, free: FreeSpace) -> np.ndarray:
    """Pixels whose place half way through the board two cameras saw through."""
    import cv2

    coarse = grid.centres()[::STRIDE, ::STRIDE]
    middle = np.full((*coarse.shape[:2], 1), sheet.thickness.value / 2)
    places = sheet.to_world(np.concatenate([coarse, middle], axis=2).reshape(-1, 3))
    seen = (free.votes(places) >= 2).reshape(coarse.shape[:2]).astype(np.uint8)
    return cv2.resize(seen, grid.shape[::-1], interpolation=cv2.INTER_NEAREST).astype(bool)


def seeds_of(
    mask: np.ndarray, beyond: np.ndarray, forbidden: np.ndarray, bounds: Bounds, pixel: float
) -> Seeds:
    """Hard seeds: the eroded outline is inside; what is far out, or taken by constraints or other boards, is outside.

    `beyond` counts as inside for the erosion: the outline stops there for certain.
    """
    distance = signed_distance(mask, pixel)
    settled = signed_distance(mask | beyond, pixel)
    depth = np.minimum(bounds.error, 0.5 * float(distance.max()))
    hull = _hull(mask)
    outside = (distance < -bounds.margin) & ~hull
    outside[[0, -1]], outside[:, [0, -1]] = True, True
    sure = outside | (distance < -bounds.error) & (bounds.margin < 4 * bounds.least_error)
    return Seeds((settled > depth) & mask & ~forbidden, outside | forbidden, sure, distance,
                 _belief(distance, mask, bounds, pixel))


def _hull(mask: np.ndarray) -> np.ndarray:
    import cv2

    points = np.argwhere(mask)[:, ::-1].astype(np.int32)
    canvas = np.zeros(mask.shape, np.uint8)
    cv2.fillConvexPoly(canvas, cv2.convexHull(points), 1)
    return canvas.astype(bool)


def classes_on_grid(
    sheet: Sheet, board_idx: int, board_view: BoardView, grid: Grid, occluders: Occluders, error: float
) -> np.ndarray:
    """CLEAR, BOARD or OCCLUDED for every pixel; occluders and boards behind are grown by what is not known of them."""
    import cv2

    coarse = grid.centres()[::STRIDE, ::STRIDE]
    points = np.concatenate([coarse, np.full((*coarse.shape[:2], 1), board_view.near)], axis=2).reshape(-1, 3)
    kinds = occluders.classify(board_idx, board_view.view, sheet.to_world(points)).reshape(coarse.shape[:2])
    radius = max(1, round(OCCLUDER_ERROR * error / (STRIDE * grid.pixel)))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1,) * 2)
    grown_kinds = cv2.dilate(kinds, disc)  # OCCLUDED > BOARD > CLEAR: the larger wins
    return cv2.resize(grown_kinds, grid.shape[::-1], interpolation=cv2.INTER_NEAREST)


def cut_face_band(mask: np.ndarray, board_view: BoardView, grid: Grid) -> np.ndarray:
    """Where the board's own cut faces would show: the slab's shadow on its near plane, less the face itself."""
    import cv2

    height, thickness = abs(board_view.eye[2] - board_view.near), abs(board_view.near - board_view.far)
    eye = grid.to_index(board_view.eye[:2])
    least = height / (height + thickness)
    rows, columns = mask.shape
    reach = max(np.linalg.norm(eye - c) for c in ((0, 0), (columns, 0), (0, rows), (columns, rows))) * (1 - least)
    doublings = int(np.ceil(np.log2(2 + min(reach, 60) / 2)))
    band = mask.astype(np.uint8)
    for k in range(doublings):  # what lies on the way by now, and all of it once more as far again
        scale = least ** (2**k / (2**doublings - 1))
        turn = np.array([[scale, 0, eye[0] * (1 - scale)], [0, scale, eye[1] * (1 - scale)]])
        band |= cv2.warpAffine(band, turn, (columns, rows), flags=cv2.INTER_NEAREST)
    return band.astype(bool) & ~mask


def gather(
    lab: np.ndarray, sums: tuple[np.ndarray, np.ndarray], seen: np.ndarray, kinds: np.ndarray, band: np.ndarray,
    seeds: Seeds, options: SegmentOptions, rng: np.random.Generator,
) -> ViewEvidence | None:
    """One view's evidence; None when it shows too little of the inside to learn its colours.

    `sums` are those of its side, as `side_sums` gives them.
    """
    beyond = seen & seeds.beyond & ~band
    inside = _learn(lab, _balanced(seen & seeds.inside, seeds.distance), options, rng)
    outside = {kind: _learn(lab, np.flatnonzero(beyond & (kinds == kind)), options, rng) for kind in (CLEAR, BOARD)}
    if inside is None:
        return None
    inside = with_shade(inside)
    ask = seen & ~seeds.outside & ~seeds.inside
    others, apart = apart_from_others(lab, seen, *sums)
    nats, weight = np.zeros(seen.shape, np.float32), np.zeros(seen.shape, np.float32)
    for kind, other in ((CLEAR, BOARD), (BOARD, CLEAR)):
        model = outside[kind] or outside[other]
        pixels = ask & (kinds == kind)
        share = 1.0 if kind == CLEAR else options.wood_share
        told = _log_ratio(inside, model, lab[pixels], options.evidence_cap, others[pixels])
        same = _parallax_ratio(apart[pixels], apart[seen & seeds.inside], apart[beyond & (kinds == kind)])
        nats[pixels], weight[pixels] = share * told + same, 1.0
    # where the board's own cut face would show, wood says nothing; anything else still says outside
    weight[band & (nats > 0)] = 0
    trust = _trust(inside, outside[CLEAR] or outside[BOARD], lab, seen & seeds.inside, beyond, options.evidence_cap)
    return ViewEvidence(nats * trust, weight, seen)


def _parallax_ratio(apart: np.ndarray, inside: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """Nats for inside from how far a pixel's colour is from the other views', learnt where in and out are known."""
    bins = np.r_[-1, 2.0 ** np.arange(0, 10), np.inf]  # LAB units squared
    counts = [np.histogram(a[np.isfinite(a)], bins)[0] for a in (inside, outside)]
    if min(c.sum() for c in counts) < LEAST_PARALLAX:
        return np.zeros(len(apart), np.float32)
    shares = [(c + 0.02 * c.sum()) / c.sum() for c in counts]
    ratio = np.clip(np.log(shares[0] / shares[1]), -PARALLAX_CAP, PARALLAX_CAP)
    known = np.isfinite(apart)
    return np.where(known, ratio[np.digitize(np.where(known, apart, 0), bins) - 1], 0).astype(np.float32)


def _balanced(mask: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Pixels inside, flat indices, those near the outline as many as all others: light changes over a board, and there
    it counts.
    """
    near = np.flatnonzero(mask & (distance < NEAR_OUTLINE))
    rest = np.flatnonzero(mask & (distance >= NEAR_OUTLINE))
    if not len(near) or not len(rest):
        return np.flatnonzero(mask)
    few = max(1, len(rest) // len(near)), max(1, len(near) // len(rest))
    return np.concatenate([near[:: few[1]], rest[:: few[0]]])


def _learn(lab: np.ndarray, pixels: np.ndarray, options: SegmentOptions, rng: np.random.Generator) -> Mixture | None:
    """A mixture of the colours of some pixels, given by flat indices."""
    return fit_mixture(lab.reshape(-1, 3), options.components, options.samples, rng, pixels)


def _log_ratio(
    inside: Mixture, outside: Mixture | None, colours: np.ndarray, cap: float, others: np.ndarray | None = None
) -> np.ndarray:
    if outside is None:
        return np.zeros(len(colours), np.float32)
    within = inside.log_density(colours)
    if others is not None:
        within = np.logaddexp(within, same_surface(colours, others))
    return np.clip(within - outside.log_density(colours), -cap, cap)


def side_sums(labs: np.ndarray, seen: np.ndarray, sides: Sequence[int]) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """For each side its views' colours, summed where they see, (rows, cols, 3), and how many see a pixel, (rows, cols).
    """
    sums = {s: (np.zeros(labs.shape[1:], np.float32), np.zeros(seen.shape[1:], np.float32)) for s in sorted(set(sides))}
    for lab, shown, side in zip(labs, seen, sides, strict=True):
        add_seen(lab, shown, *sums[side])
    return sums


def _trust(
    inside: Mixture, outside: Mixture | None, lab: np.ndarray, core: np.ndarray, beyond: np.ndarray, cap: float
) -> float:
    """How well a view tells its training pixels apart, 0 to 1: a shadowed or glossy view must not outvote the rest."""
    if outside is None:
        return LEAST_TRUST
    flat, some = lab.reshape(-1, 3), [np.flatnonzero(m) for m in (core, beyond)]
    means = [_log_ratio(inside, outside, flat[k[:: max(1, len(k) // 2000)]], cap).mean() if len(k) else 0.0
             for k in some]
    return float(np.clip((means[0] - means[1]) / cap, LEAST_TRUST, 1.0))


def average(evidences: Sequence[ViewEvidence], seeds: Seeds) -> np.ndarray:
    """Nats for inside over all views, and what the outline so far says."""
    total = sum(e.nats * e.weight for e in evidences)
    weight = sum(e.weight for e in evidences)
    return np.where(weight > 0, total / np.maximum(weight, 1e-6), 0) + PRIOR * seeds.belief


def _belief(distance: np.ndarray, mask: np.ndarray, bounds: Bounds, pixel: float) -> np.ndarray:
    """Outline errors inside the outline so far, capped; 0 in bays and holes that may just be missing from the cloud."""
    from scipy.ndimage import binary_fill_holes

    reach = float(np.min(bounds.margin))
    closed = binary_fill_holes(grown(grown(mask, reach, pixel), -reach, pixel))
    believed = np.clip(distance / bounds.error, -PRIOR_REACH, PRIOR_REACH)
    return np.where(closed & ~mask, 0, believed).astype(np.float32)
