"""Where the wood of a face changes along a straight line: dark or light lines, and steps of brightness and of hue.

Wood varies, and in some ways more than in others: between early and late wood, in brightness, but hardly in hue. What a
seam shows is therefore measured against what this very face shows everywhere else (Mahalanobis' distance). Along a
seam, line and step are the same everywhere; grain wanders, so that its mean along any straight line is small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import correlate1d, gaussian_filter1d, minimum_filter1d

from kerfwright.assemble.texture import FaceStrips

__all__ = ["Discontinuity", "discontinuity", "mean_of_views", "pressed_mean", "step_kernel"]

LINE = 1.6  # samples, of the filter for lines: a joint is about one pixel wide
STEPS = ((1, 4), (2, 10))  # samples left out beside the line, and averaged on each side
REACH = 12  # samples that the filters look to either side
BLUR = 2.0  # samples: a dark joint shows as two steps with a line between them, all of one seam
FAINTEST = 0.0004  # of brightness: smaller changes may come from the light, or from JPEG
CLIP = 4.0  # robust deviations; knots do not set the measure
SHRINK = 0.02  # of correlations: keeps combinations that hardly vary from counting for everything
LEAST_SEEN = 0.25  # share of the face that must be seen at all
LEAST_STRIPS = 0.5  # share of the strips that must show an offset
TRIM = 1.5  # deviations from the median beyond which a strip counts no more
LIKELY = 1.5  # standard errors
CENTRED = 4  # samples to either side of a peak that say where its middle lies
THIRDS = 3  # stretches of the line that must agree
EIGHTHS = 8  # short stretches, of which none may lack the change altogether: slots and grooves end before the rim
EIGHTH_SHARE = 0.5  # of the change that an eighth shows, less what chance takes
EDGE = 0.06  # of the strips at either end, left out: ends are worn and lit differently


@dataclass(frozen=True, eq=False)
class Discontinuity:
    """How much a face changes at every offset, against what it shows elsewhere; 1 is usual, NaN is unseen."""

    offsets: np.ndarray  # (U,) mm along m
    strength: np.ndarray  # (U,)
    line: np.ndarray  # (U, F) the change itself, whitened
    flat: np.ndarray  # (U, C, F) of every strip
    colours: np.ndarray  # (V, U, C, 3) of every view
    white: np.ndarray  # (3 colours of every filter, F)

    sharp: bool = True  # lines, by whose distance a gap is known
    denied: float = 2.0  # strength on the other face, below which no joint goes through

    @property
    def shown(self) -> int:
        """How many views there are."""
        return len(self.colours)

    def like(self, _other: Discontinuity, _k: int) -> np.ndarray:
        """(U,) True: on both faces a joint is a line, but not the same one, as wear and light differ."""
        return np.ones(len(self.offsets), bool)

    def along(self, k: int) -> float:
        """Least share of the change at offset k that any third of the line shows."""
        return min(_share(part, self.line[k]) for part in np.array_split(self.flat[k], THIRDS))

    def unbroken(self, k: int) -> bool:
        """Whether every eighth of the line shows the change at offset k, as far as its strength lets one tell."""
        chance = np.sqrt(EIGHTHS / (self.line.shape[1] * self.strength[k]))  # standard error of the share of an eighth
        least = EIGHTH_SHARE - LIKELY * chance
        return all(_share(part, self.line[k]) > least for part in np.array_split(self.flat[k], EIGHTHS))

    def located(self, k: int) -> float:
        """Offset of the middle of the peak at offset k, mm."""
        near = slice(max(0, k - CENTRED), k + CENTRED + 1)
        weight = np.maximum(np.nan_to_num(self.strength[near]) - 1, 1e-9)
        return float(self.offsets[near] @ weight / weight.sum())

    def around(self, k: int) -> tuple[int, ...]:
        """Where a joint that is strongest at offset k may be asked for its looks: there only, as lines are narrow."""
        return (k,)

    def views(self, k: int) -> list[float]:
        """Share of the change at offset k that each view shows; views that do not show the offset are left out."""
        low = max(0, k - REACH)
        near = self.colours[:, low : k + REACH + 1]
        single = [_filtered(own)[k - low] @ self.white for own in near]
        return [_share(own, self.line[k]) for own in single if np.isfinite(own[:, 0]).mean() >= LEAST_STRIPS]


def discontinuity(strips: FaceStrips) -> Discontinuity | None:
    """The change across lines square to m; None when hardly anything was seen."""
    edge = round(EDGE * len(strips.middles))
    colours = strips.colours[:, :, edge : len(strips.middles) - edge]
    if colours.shape[2] < EIGHTHS:
        return None
    features = _filtered(mean_of_views(colours))
    told = np.isfinite(features[..., 0])
    good = told.mean(axis=1) >= LEAST_STRIPS
    if told.mean() < LEAST_SEEN or good.sum() < 4 * REACH:
        return None
    white = _whitening(features)
    flat = features @ white
    strength, line = np.full(len(flat), np.nan), np.full((len(flat), flat.shape[2]), np.nan)
    line[good] = pressed_mean(flat[good])
    usual = 1.4826 * np.median(np.abs(line[good]), axis=0)
    usual = np.hypot(usual, FAINTEST * np.linalg.norm(white, axis=0))
    strength[good] = gaussian_filter1d(((line[good] / usual) ** 2).mean(axis=1), BLUR)
    return Discontinuity(strips.offsets, strength, line, flat, colours, white)


def mean_of_views(colours: np.ndarray) -> np.ndarray:
    """(U, C, 3) over the views that tell."""
    told = np.isfinite(colours[..., :1])
    count = told.sum(axis=0)
    return np.where(count > 0, np.where(told, colours, 0).sum(axis=0) / np.maximum(count, 1), np.nan)


def _share(strips: np.ndarray, whole: np.ndarray) -> float:
    """How much of a change (F,) some strips (C, F) show; 1 is all of it, 0 is none or strips that show nothing."""
    if not np.isfinite(strips[:, 0]).any():
        return 0.0
    return float(pressed_mean(strips[None])[0] @ whole / (whole @ whole))


def _filtered(strips: np.ndarray) -> np.ndarray:
    """(U, C, F) responses of all filters in all colours to (U, C, 3); NaN near what is unseen."""
    told = np.isfinite(strips[..., 0])
    filled = np.where(told[..., None], strips, 0.0)
    parts = [gaussian_filter1d(filled, LINE, axis=0, order=2, mode="nearest")]
    parts += [correlate1d(filled, step_kernel(*s), axis=0, mode="nearest") for s in STEPS]
    out = np.concatenate(parts, axis=2)
    out[minimum_filter1d(told, 2 * REACH + 1, axis=0, mode="constant", cval=0) == 0] = np.nan
    return out


def step_kernel(gap: int, width: int) -> np.ndarray:
    """Mean of what follows less mean of what precedes."""
    side = np.full(width, 1 / width)
    return np.concatenate([-side, np.zeros(2 * gap + 1), side])


def _whitening(features: np.ndarray) -> np.ndarray:
    """(F, F): features @ it vary by one and independently, from strip to strip and place to place on this face."""
    told = features[np.isfinite(features[..., 0])]
    scale = 1.4826 * np.median(np.abs(told), axis=0) + 1e-9
    clipped = np.clip(told / scale, -CLIP, CLIP)
    spread = np.sqrt((clipped**2).mean(axis=0))
    clipped /= spread
    correlation = (1 - SHRINK) * clipped.T @ clipped / len(clipped) + SHRINK * np.eye(clipped.shape[1])
    values, vectors = np.linalg.eigh(correlation)
    return (vectors / np.sqrt(values)) / (scale * spread)[:, None]


def pressed_mean(flat: np.ndarray) -> np.ndarray:
    """(U, F) means over the strips of (U, C, F), far ones pressed towards the median; every offset has some."""
    middle = _median(flat)[:, None]
    spread = TRIM * 1.4826 * _median(np.abs(flat - middle))[:, None]
    near = np.nan_to_num(np.clip(flat - middle, -spread, spread))
    return middle[:, 0] + near.sum(axis=1) / np.maximum(np.isfinite(flat).sum(axis=1), 1)


def _median(values: np.ndarray) -> np.ndarray:
    """Median over axis 1, NaN left out; many times faster than NumPy's own."""
    ranked = np.sort(values, axis=1)  # NaN last
    count = np.isfinite(values).sum(axis=1, keepdims=True)
    low, high = np.maximum(count - 1, 0) // 2, count // 2
    high = np.minimum(high, np.maximum(count - 1, 0))
    picked = (np.take_along_axis(ranked, i, axis=1) for i in (low, high))
    return sum(picked)[:, 0] / 2
