"""What a capture holds, and whether it is enough: to know before the time is spent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.model import Finding

if TYPE_CHECKING:
    from kerfwright.capture.types import Capture, Cloud, View

__all__ = ["Survey", "survey"]

FEW_PHOTOGRAPHS = 12  # one ring at 30 degrees: less leaves sides that two photographs don't share
WIDE_GAP = 75.0  # degrees round the object; stereo does not match across more, and faces between are seen aslant
FEW_PIXELS = 400  # across the object: outlines come out to about half a pixel, a millimetre on an object of 80 cm
FEW_POINTS = 20_000
FACING = 0.3  # cosine of the angle between a point's normal and the way to a camera that sees it
# Texture of a surface whose local contrast is below this many times the photographs' noise is lost in it.
NOISE_FACTOR = 1.5
PLAIN_SHARE = 0.75  # of bare wood with a faint grain, up to half is as plain as that; of paint, nearly all
# Where cameras and cloud fit, the photographs show the cloud's colours in their places, and less so beside them.
ASIDE = 0.06  # of the object's extent in the photograph: how far beside
FIT_SHARE = 0.5  # of the photographs that must fit; all did in every capture that was tried
FEWEST_SEEN = 200  # points, for a photograph to be asked
_PATCH = 7  # pixels a side, in which contrast is measured
_SAMPLE = 4000


@dataclass(frozen=True)
class Survey:
    """Figures of a capture in millimetres, degrees and pixels, and what is to be said of them."""

    images: int
    image_sizes: tuple[str, ...]
    camera_models: tuple[str, ...]
    points: int
    colours: bool
    extent_mm: tuple[float, float, float]
    millimetres_per_unit: float
    scale_origin: str
    widest_gap_deg: float
    pixel_mm: float
    plain_share: float
    fitting_share: float | None  # of the photographs in which the cloud's colours lie where they should
    findings: tuple[Finding, ...]


def survey(capture: Capture) -> Survey:
    """Survey a prepared capture (world in millimetres, z up).

    Raises
    ------
    CaptureError when a photograph cannot be read.
    """
    points = capture.cloud.points[:: max(1, len(capture.cloud) // _SAMPLE)]
    sizes = Counter(f"{v.camera.width}x{v.camera.height}" for v in capture.views)
    figures = {
        "images": len(capture.views), "image_sizes": tuple(sorted(sizes)),
        "camera_models": tuple(sorted({v.camera.model for v in capture.views})),
        "points": len(capture.cloud), "colours": capture.cloud.colours is not None,
        "extent_mm": tuple(round(float(x), 1) for x in np.ptp(capture.cloud.points, axis=0)),
        "millimetres_per_unit": capture.scale.millimetres_per_unit, "scale_origin": capture.scale.origin,
        "widest_gap_deg": round(_widest_gap(capture.views, points), 1),
        "pixel_mm": round(_pixel_size(capture.views, points), 3),
        "plain_share": round(_plain_share(capture, points), 3),
        "fitting_share": _fitting_share(capture),
    }
    return Survey(**figures, findings=tuple(_findings(figures, capture)))


def _findings(figures: dict, capture: Capture) -> Iterator[Finding]:
    if figures["images"] < FEW_PHOTOGRAPHS:
        yield _warn("K020", f"{figures['images']} photographs are few", "take 20 to 40, all round and from above")
    if figures["widest_gap_deg"] > WIDE_GAP:
        yield _warn(
            "K021", f"{figures['widest_gap_deg']:.0f} degrees round the object without a photograph",
            "photograph that side, or expect its boards to be inferred", figures["widest_gap_deg"],
        )
    across = max(figures["extent_mm"]) / figures["pixel_mm"] if figures["pixel_mm"] else 0.0
    if across < FEW_PIXELS:
        message = f"the object is only {across:.0f} pixels large"
        yield _warn("K022", message, "go nearer, or keep full resolution", across)
    if figures["points"] < FEW_POINTS:
        yield _warn("K023", f"{figures['points']} points are few", "make the dense cloud, not the sparse one")
    if figures["plain_share"] > PLAIN_SHARE:
        yield _warn(
            "K024", f"{100 * figures['plain_share']:.0f} % of the surface shows no texture above the noise",
            "painted or glossy boards come out rough: stick on tape, or photograph in better light",
            figures["plain_share"],
        )
    if figures["fitting_share"] is not None and figures["fitting_share"] < FIT_SHARE:
        amiss = f"{100 - 100 * figures['fitting_share']:.0f} % of the photographs"
        yield _warn(
            "K025", f"{amiss} show the cloud's colours elsewhere than the cameras put them",
            "cameras, photographs and cloud do not belong together, or their axes differ: export all from one project",
            figures["fitting_share"],
        )
    if capture.scale.origin == "assumed":
        yield _warn("K003", "the scale is assumed: 1 capture unit = 1 m", "measure a board and give --scale")
    for note in capture.notes:
        yield Finding(code="K001", severity="info", message=note)


def _warn(code: str, message: str, remedy: str, value: float | None = None) -> Finding:
    return Finding(code=code, severity="warning", message=message, remedy=remedy, value=value)


def _widest_gap(views: Sequence[View], points: np.ndarray) -> float:
    """Widest angle round the vertical, degrees, between neighbouring cameras that do not look straight down."""
    away = np.array([view.centre for view in views]).reshape(-1, 3) - np.median(points, axis=0)
    slanted = np.hypot(away[:, 0], away[:, 1]) > 0.35 * np.linalg.norm(away, axis=1)
    azimuths = np.sort(np.degrees(np.arctan2(away[slanted, 1], away[slanted, 0])))
    if not len(azimuths):
        return 360.0
    return float(np.diff([*azimuths, azimuths[0] + 360]).max())


def _pixel_size(views: Sequence[View], points: np.ndarray) -> float:
    """Median over the views of what a pixel covers on the object, mm."""
    sizes = [float(np.median(view.project(points)[1])) / view.camera.focal for view in views]
    return float(np.median(sizes)) if sizes else 0.0


def _plain_share(capture: Capture, points: np.ndarray, most: int = 6) -> float:
    """Share of the surface, as photographs see it, whose contrast does not rise above their noise."""
    chosen = capture.views[:: max(1, len(capture.views) // most)]
    contrasts = [_contrast_over_noise(view, points) for view in chosen]
    seen = np.concatenate(contrasts) if contrasts else np.zeros(0)
    return float(np.mean(seen < NOISE_FACTOR)) if len(seen) else 0.0


def _fitting_share(capture: Capture, most: int = 8) -> float | None:
    """Share of the photographs that show the cloud's colours best where cameras put them; None where none can tell."""
    if capture.cloud.colours is None:
        return None
    some = capture.cloud.select(slice(None, None, max(1, len(capture.cloud) // _SAMPLE)))
    chosen = capture.views[:: max(1, len(capture.views) // most)]
    fits = [fit for fit in (_fits(view, some) for view in chosen) if fit is not None]
    return round(sum(fits) / len(fits), 3) if fits else None


def _fits(view: View, cloud: Cloud) -> bool | None:
    """Whether the colours correlate with the photograph better than when the points are moved a little aside."""
    import cv2

    grey = cv2.GaussianBlur(cv2.cvtColor(view.image(), cv2.COLOR_RGB2GRAY), None, 2).astype(float)
    colours = cv2.cvtColor(cloud.colours[None], cv2.COLOR_RGB2GRAY)[0].astype(float)
    pixels, depth = view.project(cloud.points)
    towards = view.centre - cloud.points
    facing = np.einsum("ij,ij->i", cloud.normals, towards) > FACING * np.linalg.norm(towards, axis=1)
    seen = facing & (depth > 0) & np.isfinite(pixels).all(axis=1)
    if seen.sum() < FEWEST_SEEN:
        return None
    reach = ASIDE * float(np.ptp(pixels[seen], axis=0).max())
    turns = np.arange(8) * np.pi / 4
    shifts = [np.zeros(2), *(reach * np.array([np.cos(t), np.sin(t)]) for t in turns)]
    found = [_correlation(grey, pixels[seen] + shift, colours[seen]) for shift in shifts]
    return None if np.isnan(found[0]) else bool(found[0] >= np.nanmax(found))


def _correlation(grey: np.ndarray, pixels: np.ndarray, colours: np.ndarray) -> float:
    """Between the points' grey values and the photograph's; NaN where too few are in it, or all are alike."""
    inside = ((pixels >= 0) & (pixels < grey.shape[::-1])).all(axis=1)
    columns, rows = pixels[inside].astype(int).T
    seen, own = grey[rows, columns], colours[inside]
    if inside.sum() < FEWEST_SEEN or seen.std() < 1 or own.std() < 1:
        return float("nan")
    return float(np.corrcoef(seen, own)[0, 1])


def _contrast_over_noise(view: View, points: np.ndarray) -> np.ndarray:
    """Local standard deviation of the grey values where points project, over the photograph's own noise.

    Noise is measured where the photograph is flattest: the tenth percentile of the same deviation over the whole
    picture, so that JPEG's smoothing, which acts on both, cancels.
    """
    import cv2

    grey = cv2.cvtColor(view.image(), cv2.COLOR_RGB2GRAY).astype(np.float32)
    mean, square = (cv2.blur(g, (_PATCH, _PATCH)) for g in (grey, grey * grey))
    deviation = np.sqrt(np.maximum(square - mean * mean, 0))
    noise = max(0.5, float(np.percentile(deviation, 10)))
    pixels, depth = view.project(points)
    inside = (depth > 0) & ((pixels >= 0) & (pixels < [view.camera.width, view.camera.height])).all(axis=1)
    columns, rows = pixels[inside].astype(int).T
    return deviation[rows, columns] / noise
