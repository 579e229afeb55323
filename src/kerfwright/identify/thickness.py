"""How thick a board is: from its opposite sheet plane, or from where its cut faces end (paper, Initial Sheet Thickness
Estimation).

The evidence is found coarsely and then fitted: an opposite plane by its own least squares fit, a far end by the edge of
the density of cut-face points along the depth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy.ndimage import gaussian_filter1d
from shapely.geometry import MultiPoint, Polygon

from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.photo_edges import Photos, SweepResult, refine_peak, sweep_edge
from kerfwright.identify.rims import Rim, cut_points, outline_samples
from kerfwright.identify.types import Neighbourhood, Primitive

__all__ = [
    "ThicknessHypothesis", "from_cut_faces", "from_opposite", "from_photos", "looking_at", "reaches_ground",
    "sharpened",
]


GROUND_SHARE = 0.25  # cut-face points in the lower half of a board on the floor, of those in the upper half
LEAST_GROUND = 0.05  # share of the outline below which such points must be seen
STRAYS = 0.15  # of the points that a face seen well has
BESIDE = 0.5  # density of points above a board, of that below its top: more, and the face is another board's
STEREO_BIAS = 2.0  # standard error of a stereo plane, in units of the noise of its points


@dataclass(frozen=True)
class ThicknessHypothesis:
    """A thickness in mm with its standard error and what it rests on."""

    value: float
    standard_error: float
    evidence: str  # "opposite", "photos", "cut", "ground", "ends", "twin" or "inferred"
    support: float  # mm2 of overlap, edge strength, or share of the outline

    def near(self, value: float) -> bool:
        """Whether a value is this thickness as stereo's fringe might give it."""
        return 0.6 * self.value < value < 1.7 * self.value


def from_opposite(
    frame: np.ndarray,
    piece: Polygon,
    planes: list[Primitive],
    points: np.ndarray,
    limits: tuple[float, float],
    degrees: float,
) -> list[ThicknessHypothesis]:
    """One hypothesis an opposite plane that overlaps the region; distances are taken at the overlap's middle."""
    found: list[ThicknessHypothesis] = []
    normal, origin = frame[:3, 2], frame[:3, 3]
    for plane in planes:
        if plane.normal @ normal > -np.cos(np.radians(degrees)):
            continue
        depth = (origin - plane.centroid) @ normal
        if not limits[0] < depth < limits[1]:
            continue
        x = (points[plane.point_idx] - origin) @ frame[:3, :3]
        inside = shapely.contains_xy(piece, x[:, 0], x[:, 1])
        if inside.sum() < 30 or inside.sum() < 0.1 * min(len(x), 2000):
            continue
        value = -float(np.median(x[inside, 2]))
        error = STEREO_BIAS * plane.sigma  # a dim face is not only noisy but shifted, and more points don't help
        area = MultiPoint(x[inside][:: max(1, int(inside.sum()) // 500), :2]).convex_hull.area
        found.append(ThicknessHypothesis(value, error, "opposite", float(area)))
    return _merge(found)


def _merge(found: list[ThicknessHypothesis]) -> list[ThicknessHypothesis]:
    """Drop hypotheses near a better supported one: stray pieces of the same opposite plane."""
    out: list[ThicknessHypothesis] = []
    for h in sorted(found, key=lambda h: -h.support):
        if not any(abs(h.value - o.value) < (0.1 if h.support > o.support / 3 else 0.3) * o.value for o in out):
            out.append(h)
    return out


def from_cut_faces(
    frame: np.ndarray, piece: Polygon, cloud: Cloud, around: Neighbourhood, limits: tuple[float, float]
) -> list[ThicknessHypothesis]:
    """Depths at which the cut faces along the outline end, best supported first (at most three)."""
    depth, along, length = _cut_columns(frame, piece, cloud, around, limits[1])
    if len(depth) < 30:
        return []
    step = max(2 * around.spacing, limits[1] / 60)
    ends = _column_ends(depth, along, step, 8 * around.spacing, limits[1] / 6)
    if not len(ends):
        return []
    histogram = np.bincount(np.round(ends[:, 1] / step).astype(int), minlength=3).astype(float)
    smooth = gaussian_filter1d(histogram, 0.7)
    found = []
    for k in np.argsort(-smooth, kind="stable")[:3]:
        share = smooth[k] * 8 * around.spacing / length
        if smooth[k] >= 0.25 * smooth.max() and share > 0.04 and limits[0] < k * step < limits[1]:
            value, error = _far_end(depth, along, ends, k * step, step)
            found.append(ThicknessHypothesis(value, error, "cut", float(share)))
    return found


def _cut_columns(
    frame: np.ndarray, piece: Polygon, cloud: Cloud, around: Neighbourhood, deepest: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Depth and position along the outline of points that face away from it; and the outline's length."""
    width = max(4 * around.spacing, cloud.diameter / 60)  # the stereo fringe widens a region by some mm
    samples = outline_samples(piece, around.spacing)
    cut = cut_points(frame, samples, cloud, around, 1.2 * deepest, width)
    position = (np.arange(len(samples[0])) + 1000 * samples[2]) * around.spacing
    return cut.depth, position[cut.sample], len(samples[0]) * around.spacing


def _column_ends(
    depth: np.ndarray, along: np.ndarray, step: float, bin_length: float, latest_start: float
) -> np.ndarray:
    """For each stretch of the outline: (stretch, depth of the first gap); stretches that start too deep say nothing."""
    stretch = np.floor(along / bin_length).astype(int)
    level = np.floor(depth / step).astype(int)
    ends = []
    for s in np.unique(stretch):
        filled = np.zeros(200, bool)
        own = level[(stretch == s) & (level >= 0)]
        filled[own[own < 200]] = True
        first = int(np.argmax(filled))
        if filled.sum() < 2 or first * step > latest_start:
            continue
        gap = np.flatnonzero(~filled[first:])
        ends.append((s, (first + gap[0]) * step))
    return np.array(ends).reshape(-1, 2)


def _far_end(depth: np.ndarray, along: np.ndarray, ends: np.ndarray, coarse: float, step: float) -> tuple[float, float]:
    """Sub-step position of the density's far edge over the stretches that end at about `coarse`."""
    own = depth[(depth > coarse - 3 * step) & (depth < coarse + 3 * step)]
    fine = step / 12
    histogram, edges = np.histogram(own, bins=np.arange(coarse - 3 * step, coarse + 3 * step + fine, fine))
    slope = gaussian_filter1d(histogram.astype(float), 3, order=1)
    inner = slice(6, len(slope) - 6)
    k = 6 + int(np.argmin(slope[inner]))
    return float(edges[k] + fine / 2), float(max(step / 4, fine))


def from_photos(
    frame: np.ndarray,
    rim: Rim,
    photos: Photos,
    limits: tuple[float, float],
    *,
    most_places: int = 250,
    most_views: int = 10,
    step: float,
    free: FreeSpace | None = None,
) -> list[ThicknessHypothesis]:
    """Depths below the sheet plane at which the photographs show an edge that follows the rim, strongest first.

    Only places that cut-face points back are swept, in views that look at the cut face. The sheet plane's own edge at
    depth zero calibrates the measure: a small offset of the plane cancels in the difference. free: where other boards
    hide the cut face is left out; without it they are thought away.
    """
    keep = np.flatnonzero(rim.seen)
    if len(keep) < 20:
        return []
    keep = keep[:: max(1, len(keep) // most_places)]
    places = np.c_[rim.places[keep], np.zeros(len(keep))] @ frame[:3, :3].T + frame[:3, 3]
    outward = np.c_[rim.outward[keep], np.zeros(len(keep))] @ frame[:3, :3].T
    normal = frame[:3, 2]
    offsets = np.arange(-4 * limits[0], limits[1], step)
    visible = looking_at(photos, places, outward, normal, most_views)
    if free is not None:
        visible = _unhidden(visible, free, places, normal, offsets)
    sweep = sweep_edge(photos, places, -normal, offsets, visible, smoothing=1.5 * step)
    return [] if sweep is None else _peaks(sweep, limits)


def _unhidden(
    visible: np.ndarray, free: FreeSpace, places: np.ndarray, normal: np.ndarray, offsets: np.ndarray, every: int = 8
) -> np.ndarray:
    """(V, N, T) which views look at a place with nothing in front of it that the cloud knows, tested at some offsets.
    """
    tested = np.minimum(np.arange(len(offsets)) // every * every + every // 2, len(offsets) - 1)
    distinct, back = np.unique(tested, return_inverse=True)
    grid = places[:, None] - offsets[None, distinct, None] * normal
    out = np.zeros((*visible.shape, len(offsets)), bool)
    for k in np.flatnonzero(visible.any(axis=1)):
        own = np.flatnonzero(visible[k])
        clear = ~free.hidden(k, grid[own].reshape(-1, 3)).reshape(len(own), len(distinct))
        out[k, own] = clear[:, back]
    return out


def reaches_ground(
    frame: np.ndarray, piece: Polygon, cloud: Cloud, around: Neighbourhood, height: float
) -> bool:
    """Whether a level board's cut faces go on in the lower half of its height: a shelf near the floor has air there.

    Faces that go on above the board as well are those of others that stand right beside it, and strays are none.
    """
    depth, along, length = _cut_columns(frame, piece, cloud, around, height)
    margin, step = 3 * around.noise, 8 * around.spacing
    _, stretch = np.unique(np.floor(along / step), return_inverse=True)
    bins = int(stretch.max()) + 1 if len(stretch) else 0
    above = np.bincount(stretch[depth < -margin], minlength=bins) / max(-float(depth.min(initial=0.0)) - margin, margin)
    below = np.bincount(stretch[depth > 0.1 * height], minlength=bins) / height
    own = (above < BESIDE * below)[stretch]
    low, high = (own & (depth > a * height) & (depth < b * height) for a, b in ((0.5, 0.9), (0.1, 0.5)))
    seen = np.bincount(stretch[low], minlength=bins) > STRAYS * 0.4 * height * step / around.spacing**2
    return bool(low.sum() > GROUND_SHARE * high.sum() and seen.sum() * step > LEAST_GROUND * length)


def looking_at(
    photos: Photos, places: np.ndarray, outward: np.ndarray, normal: np.ndarray, most_views: int
) -> np.ndarray:
    """(V, N) which views look at the cut face, neither grazing it nor along the sweep; the best views only."""
    visible = np.zeros((len(photos.views), len(places)), bool)
    for k, view in enumerate(photos.views):
        ray = view.centre - places
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        visible[k] = ((ray * outward).sum(axis=1) > 0.3) & (np.abs(ray @ normal) < 0.9)
    for place_group in np.array_split(np.arange(len(places)), 8):
        count = visible[:, place_group].sum(axis=1)
        visible[np.ix_(np.argsort(-count, kind="stable")[most_views:], place_group)] = False
    return visible


def _peaks(sweep: SweepResult, limits: tuple[float, float]) -> list[ThicknessHypothesis]:
    """Offsets that stand out, strongest first. An eased edge shows as two steps close together: the outer one is the
    board's.
    """
    s, t = sweep.strength / np.median(sweep.strength), sweep.offsets
    local = np.flatnonzero((s[1:-1] >= s[:-2]) & (s[1:-1] > s[2:]) & (s[1:-1] > 2.0)) + 1
    zero = [k for k in local if abs(t[k]) < limits[0]]
    step = t[1] - t[0]
    at = {k: float(t[k] + refine_peak(s[k - 1 : k + 2]) * step) for k in local}
    start = at[max(zero, key=lambda k: s[k])] if zero else 0.0
    error = float(max(sweep.standard_error, 0.3 * step))
    found: list[ThicknessHypothesis] = []
    for k in sorted((k for k in local if at[k] - start > limits[0]), key=lambda k: -s[k]):
        outer = [j for j in local if 0 < t[j] - t[k] < limits[0] and s[j] > 0.7 * s[k]]
        value = at[outer[-1] if outer else k] - start
        if not any(abs(value - h.value) < limits[0] for h in found):
            found.append(ThicknessHypothesis(value, error, "photos", float(s[k])))
    return found


def sharpened(coarse: ThicknessHypothesis, photos: list[ThicknessHypothesis]) -> ThicknessHypothesis:
    """The hypothesis with its value from the photographs, where they show an edge near it; an opposite face seen dimly
    is biased.
    """
    reach = 0.08 * coarse.value + 3 * coarse.standard_error
    near = [p for p in photos if abs(p.value - coarse.value) < reach and p.support > 2.5]
    if not near:
        return coarse
    best = min(near, key=lambda p: abs(p.value - coarse.value))
    weight = np.array([coarse.standard_error, best.standard_error]) ** -2.0
    value = float(np.average([coarse.value, best.value], weights=weight))
    return replace(coarse, value=value, standard_error=float(weight.sum() ** -0.5))
