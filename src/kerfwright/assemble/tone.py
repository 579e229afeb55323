"""Where the tone of a face steps along a straight line: boards of one tree differ in hue by a grey level or less.

No pixel shows that. Means over the whole line and over broad windows beside it do, for a board hardly varies in hue
within itself. What a step is measured against is twofold: how much such means differ elsewhere on this face, and how
much they differ from stretch to stretch of this line. A joint is the same all along; grain, shadows and the border of
the heartwood wander.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import correlate1d, minimum_filter1d

from kerfwright.assemble.discontinuity import (
    EDGE,
    EIGHTHS,
    FAINTEST,
    LEAST_SEEN,
    LEAST_STRIPS,
    THIRDS,
    mean_of_views,
    pressed_mean,
    step_kernel,
)
from kerfwright.assemble.ring_break import step_evidence
from kerfwright.assemble.texture import STRIP, FaceStrips

__all__ = ["ToneSteps", "runs_along_grain", "tone_steps"]

# Samples left out beside the line (JPEG smears hue), and averaged on each side; the narrowest tells only how sudden a
# step is, and where it lies.
WINDOWS = ((3, 8), (4, 16), (4, 30))
SUDDEN = ((0.55, 1.6), (0.75, 1.6))  # of the broadest window's step that the others show; an even slope has 0.38 and
# 0.64, a dark line more than all
STEEP = 0.9  # of the second window: no slope, whatever a single ring in the narrowest does
BEYOND = (30, 26)  # samples: the narrowest board is hardly wider than both, and has one tone so far
LASTS = (0.45, 1.7)  # of the step, that must be there still; less is a band of late wood, an even slope has 2.2
NARROW = (2, 6)  # one more window that tells where a step lies
BREAK = 3.0  # how much the rings' break counts for its place, against one window
LINES = 20.0  # how much a line's strength does
FROM_PEAK = 12  # samples from the strongest place to the best one
NEAR = 8  # samples from there to what counts for its middle
MIDDLE = 0.7  # of the best place's, which others must have to count for its middle
STRETCHES = 16  # of the line, whose steps are compared
INDEPENDENT = 4.0  # of them: grain runs on from one into the next
CLIP = 2.5  # robust deviations of stretches: a knot does not set the measure
USUAL = 0.7  # share of the offsets that set the measure; at others may be seams or shadows
ROUNDS = 8
BESIDE = (36, 130)  # samples from a step, between which the wood on either side tells how much it varies there
LEAST_BESIDE = 16  # samples of them that must tell
CHI2_MEDIAN = 2.366  # of three degrees of freedom
SCALE = 7 / 23  # to the strengths of `discontinuity`; 30 made single boards (seeds from 1000) had 3.4 at most
SHADED = 4.3  # strength of a step of light worth asking whether it slopes
HALF = 0.5  # of a step: the other face of the same boards shows it, too
LEAST_EIGHTHS = 7  # that must step to the same side


@dataclass(frozen=True, eq=False)
class ToneSteps:
    """How much the tone of a face steps at every offset, against what it does elsewhere; NaN is unseen."""

    offsets: np.ndarray  # (U,) mm along m
    strength: np.ndarray  # (U,)
    line: np.ndarray  # (U, 3) the step of log brightness itself, of the broadest window
    weight: np.ndarray  # (U, 3) by which colours count for it
    flats: list[np.ndarray]  # (U, C, 3) of every window and strip
    profile: np.ndarray  # (U, 3) log brightness along m, of all views and strips
    colours: np.ndarray  # (V, U, C, 3) of every view
    place: list[tuple[np.ndarray, np.ndarray]]  # steps (U, 3) of every window that tells the place, and (3, 3) the
    # inverse of their usual covariance
    signs: np.ndarray  # (U,) what else tells the place: how much a step breaks the rings, and lines

    sharp: bool = False
    denied: float = 1.7  # strength on the other face, below which no joint goes through

    @property
    def shown(self) -> int:
        """How many views there are."""
        return len(self.colours)

    def along(self, k: int) -> float:
        """Least share of the step at offset k that any third of the line shows."""
        return min(self._share(part, k) for part in np.array_split(self.flats[-1][k], THIRDS))

    def like(self, other: ToneSteps, k: int) -> np.ndarray:
        """(U,) where this face steps to the same side as another one does at its offset k, by half as much or more."""
        return self.line @ other.weight[k] > HALF * (other.line[k] @ other.weight[k])

    def unbroken(self, k: int) -> bool:
        """Whether all eighths of the line but one step to the same side at offset k, suddenly, as shadows do not, and
        for good, as bands of late wood do not.
        """
        same = sum(self._share(part, k) > 0 for part in np.array_split(self.flats[-1][k], EIGHTHS))
        dark_line = any(share > high for share, (_, high) in zip(self._narrow(k), SUDDEN, strict=True))
        lasts = LASTS[0] < self.beyond(k) < LASTS[1]
        return same >= LEAST_EIGHTHS and lasts and not dark_line and not self._slopes_at(k)

    def slopes(self, offset: float) -> bool:
        """Whether there is a step of tone round an offset (mm) that is none: a soft shadow's border."""
        near = int(np.abs(self.offsets - offset).argmin())
        low = max(0, near - NEAR)
        k = low + int(np.nan_to_num(self.strength[low : near + NEAR + 1]).argmax())
        return bool(self.strength[k] > SHADED) and self._slopes_at(k)

    def _slopes_at(self, k: int) -> bool:
        narrowest, narrow = self._narrow(k)
        return narrow < SUDDEN[1][0] or (narrowest < SUDDEN[0][0] and narrow < STEEP)

    def _narrow(self, k: int) -> list[float]:
        """Shares of the broadest window's step that the narrower windows show."""
        return [self._share(flat[k], k) for flat in self.flats[:-1]]

    def beyond(self, k: int) -> float:
        """Share of the step at offset k that wood further away shows; 1 where none is seen there."""
        gap, width = BEYOND
        after = self.profile[k + gap + 1 : k + gap + width + 1]
        before = self.profile[max(0, k - gap - width) : max(0, k - gap)]
        if not min(np.isfinite(side[:, 0]).sum() for side in (after, before)):
            return 1.0
        step = np.nanmean(after, axis=0) - np.nanmean(before, axis=0)
        return float(step @ self.weight[k] / (self.line[k] @ self.weight[k]))

    def located(self, k: int) -> float:
        """Offset of the place near offset k that parts the two tones best, mm: by windows, narrow ones, too, each of
        which weighs colours by what they usually do over its width, by what breaks the rings, and by lines.
        """
        fit = self.signs
        for step, weigh in self.place:
            told = step @ (weigh @ self.line[k])
            fit = fit + (np.maximum(np.nan_to_num(told), 0) / _deviation(told[np.isfinite(told)])) ** 2
        low = max(0, k - FROM_PEAK)
        best = low + int(np.argmax(fit[low : k + FROM_PEAK + 1]))
        near = slice(max(0, best - NEAR), best + NEAR + 1)
        counts = np.maximum(fit[near] - MIDDLE * fit[best], 0)
        return float(self.offsets[near] @ counts / counts.sum())

    def around(self, k: int) -> tuple[int, ...]:
        """Where a joint that is strongest at offset k may be asked for its looks: broad windows put it a ring off."""
        return k, int(np.abs(self.offsets - self.located(k)).argmin())

    def views(self, k: int) -> list[float]:
        """Share of the step at offset k that each view shows; views that do not show the offset are left out."""
        gap, width = WINDOWS[-1]
        near = self.colours[:, max(0, k - gap - width) : k + gap + width + 1]
        steps = [_stepped(own, WINDOWS[-1])[min(k, gap + width)] for own in near]
        return [self._share(own, k) for own in steps if np.isfinite(own[:, 0]).mean() >= LEAST_STRIPS]

    def _share(self, strips: np.ndarray, k: int) -> float:
        """How much of the step at k some strips (C, 3) show; 1 is all of it, 0 is none or strips that show nothing."""
        if not np.isfinite(strips[:, 0]).any():
            return 0.0
        return float(pressed_mean(strips[None])[0] @ self.weight[k] / (self.line[k] @ self.weight[k]))


def tone_steps(strips: FaceStrips, lines: np.ndarray | None = None) -> ToneSteps | None:
    """The steps of tone across lines square to m; None when hardly anything was seen.

    lines : (U,) strength of lines at the same offsets, which tell better where a step lies.
    """
    edge = round(EDGE * len(strips.middles))
    colours = strips.colours[:, :, edge : len(strips.middles) - edge]
    if colours.shape[2] < STRETCHES:
        return None
    mean = mean_of_views(colours)
    flats = [_stepped(mean, window) for window in WINDOWS]
    good = np.isfinite(flats[-1][..., 0]).mean(axis=1) >= LEAST_STRIPS
    if np.isfinite(mean[..., 0]).mean() < LEAST_SEEN or good.sum() < 2 * WINDOWS[-1][1]:
        return None
    strength, line, weight = (np.full((len(good), *shape), np.nan) for shape in ((), (3,), (3,)))
    total = 0.0
    for flat in flats[1:]:
        step, counts = _weighed(flat[good])
        total = total + np.einsum("ui,ui->u", step, counts)
    strength[good], line[good], weight[good] = SCALE * total, step, counts
    strength /= 0.5 + 0.5 * _unrest(strength)
    profile = pressed_mean(mean)
    place = [_placed(pressed_mean(flat)) for flat in (_stepped(mean, NARROW), *flats)]
    signs = BREAK * step_evidence(profile) + (0.0 if lines is None else LINES * np.nan_to_num(lines))
    return ToneSteps(strips.offsets, strength, line, weight, flats, profile, colours, place, signs)


def runs_along_grain(strips: FaceStrips) -> bool:
    """Whether colours vary more across the lines than along them. Only then does tone tell: across the grain, a board's
    rings end, light falls off over a greater length, and soft shadows of upright things lie in line with a joint.
    """
    mean = mean_of_views(strips.colours)
    apart = STRIP // 2
    across = np.nanmedian(np.abs(mean[apart:] - mean[:-apart]))
    return bool(across > np.nanmedian(np.abs(mean[:, 1:] - mean[:, :-1])))


def _deviation(values: np.ndarray) -> float:
    """Robust standard deviation."""
    return float(1.4826 * np.median(np.abs(values))) + 1e-12


def _stepped(strips: np.ndarray, window: tuple[int, int]) -> np.ndarray:
    """(U, C, 3) mean of what follows less mean of what precedes; NaN near what is unseen."""
    told = np.isfinite(strips[..., 0])
    out = correlate1d(np.where(told[..., None], strips, 0.0), step_kernel(*window), axis=0, mode="nearest")
    out[minimum_filter1d(told, 2 * sum(window) + 1, axis=0, mode="constant", cval=0) == 0] = np.nan
    return out


def _weighed(flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps (U, 3) of the whole line out of its strips' (U, C, 3), and (U, 3) by what each colour's counts: their
    product is Mahalanobis' distance, squared.
    """
    step = pressed_mean(flat)
    parts = np.array_split(flat, STRETCHES, axis=1)
    stretches = np.stack([pressed_mean(part) for part in parts], axis=1)
    away = np.nan_to_num(stretches - step[:, None])
    spread = CLIP * 1.4826 * np.median(np.abs(away), axis=1, keepdims=True)
    away = np.clip(away, -spread, spread)
    between = np.einsum("usi,usj->uij", away, away) / STRETCHES / INDEPENDENT
    spread = _usual(step) + between + FAINTEST**2 * np.eye(3)
    return step, np.linalg.solve(spread, step[..., None])[..., 0]


def _unrest(strength: np.ndarray) -> np.ndarray:
    """(U,) how much the wood on both sides of every offset changes by itself, against the whole face: boards of a panel
    are not alike in that, and a board is quiet where its rings stand upright. It is known from few rings, hence only
    half believed.
    """
    near, far = BESIDE
    padded = np.pad(strength, far, constant_values=np.nan)
    windows = sliding_window_view(padded, far - near + 1)  # the k-th starts at offset k - far
    told = np.isfinite(windows).sum(axis=1) >= LEAST_BESIDE
    usual = np.full(len(windows), np.nan)
    usual[told] = np.nanmedian(windows[told], axis=1)
    sides = np.stack([usual[: len(strength)], usual[far + near :]]) / (np.nanmedian(strength) + 1e-12)
    known = np.isfinite(sides)
    return np.where(known.any(axis=0), np.nansum(sides, axis=0) / np.maximum(known.sum(axis=0), 1), 1.0)


def _placed(step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps (U, 3) of a window, and the inverse (3, 3) of what is usual for them."""
    return step, np.linalg.inv(_usual(step[np.isfinite(step[:, 0])]) + FAINTEST**2 * np.eye(3))


def _usual(step: np.ndarray) -> np.ndarray:
    """(3, 3) covariance of the steps (U, 3) at most offsets: those that step least."""
    kept, tiny = np.ones(len(step), bool), 1e-12 * np.eye(3)
    for _ in range(ROUNDS):
        covariance = step[kept].T @ step[kept] / kept.sum() + tiny
        far = np.einsum("ui,ui->u", step, np.linalg.solve(covariance, step.T).T)
        kept = far <= np.quantile(far, USUAL)
    return covariance * np.median(far) / CHI2_MEDIAN
