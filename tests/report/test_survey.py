"""A capture's survey measures what is there and warns of what will not do."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.model import Scale
from kerfwright.report.survey import survey

CAMERA = Camera("SIMPLE_PINHOLE", 800, 600, (800.0, 400.0, 300.0))


def pose(azimuth: float, distance: float) -> np.ndarray:
    """Looks level from an azimuth (degrees) at the origin."""
    a = np.radians(azimuth)
    back = np.array([np.cos(a), np.sin(a), 0])
    turn = np.array([[-np.sin(a), np.cos(a), 0], [0, 0, -1], -back])
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, -turn @ (distance * back)
    return out


def make(folder: Path, azimuths, *, grain: float = 30.0, distance: float = 700.0, points: int = 30_000) -> Capture:
    """A block of 400 mm before a plain wall, its surface with `grain` grey levels of texture, noise of 2 everywhere."""
    rng = np.random.default_rng(0)
    size = round(400 * 800 / distance)
    views = []
    for k, azimuth in enumerate(azimuths):
        grey = np.full((600, 800), 150.0)
        y, x = 300 - min(size, 600) // 2, 400 - min(size, 800) // 2
        block = grey[y : 600 - y, x : 800 - x]
        block += 20 + grain * cv2.resize(rng.normal(size=(40, 40)), block.shape[::-1])
        grey += rng.normal(scale=2, size=grey.shape)
        cv2.imwrite(str(folder / f"{k}.png"), np.repeat(grey[..., None], 3, axis=2).clip(0, 255).astype(np.uint8))
        views.append(View(f"{k}.png", folder / f"{k}.png", CAMERA, pose(azimuth, distance)))
    cloud = rng.uniform(-190, 190, (points, 3))
    scale = Scale(millimetres_per_unit=1000, origin="given")
    return Capture("c", tuple(views), Cloud(cloud, cloud), scale, notes=("n",))


def codes(capture: Capture) -> list[str]:
    return [f.code for f in survey(capture).findings]


def test_a_good_capture_is_enough_and_measured(tmp_path):
    found = survey(make(tmp_path, range(0, 360, 20)))
    assert [f.code for f in found.findings] == ["K001"], "only the reader's note"
    assert (found.images, found.points, found.colours, found.image_sizes) == (18, 30_000, False, ("800x600",))
    assert found.widest_gap_deg == pytest.approx(20, abs=0.5) and found.pixel_mm == pytest.approx(0.875, rel=0.02)
    assert found.extent_mm == pytest.approx((380, 380, 380), abs=1) and found.plain_share < 0.25


def test_few_photographs_and_a_side_that_nobody_saw(tmp_path):
    capture = make(tmp_path, range(0, 200, 20))
    assert codes(capture) == ["K020", "K021", "K001"] and survey(capture).widest_gap_deg == pytest.approx(180, abs=0.5)


def test_a_painted_board_is_a_finding(tmp_path):
    assert codes(make(tmp_path, range(0, 360, 20), grain=0)) == ["K024", "K001"]


def test_too_far_away_and_too_thin_a_cloud(tmp_path):
    assert codes(make(tmp_path, range(0, 360, 20), distance=2500, points=5000)) == ["K022", "K023", "K001"]


def test_the_shipped_capture_is_enough():
    from kerfwright.capture import open_capture, prepare
    from kerfwright.demo import demo_capture

    found = survey(prepare(open_capture(demo_capture()))).findings
    warnings = [f.code for f in found if f.severity != "info"]
    assert warnings == ["K003"], "its scale is assumed, and nothing else is amiss"


def test_cameras_of_other_photographs_are_a_finding():
    from dataclasses import replace

    from kerfwright.capture import open_capture, prepare
    from kerfwright.demo import demo_capture

    capture = prepare(open_capture(demo_capture()))
    assert survey(capture).fitting_share == 1.0
    others = (*capture.views[4:], *capture.views[:4])
    mixed = tuple(replace(v, camera_from_world=o.camera_from_world) for v, o in zip(capture.views, others, strict=True))
    found = survey(replace(capture, views=mixed))
    assert found.fitting_share < 0.4 and "K025" in [f.code for f in found.findings]
