"""The scale from markers: photographs of printed ones, drawn by their homography, tell it to a part in a thousand."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from kerfwright.capture import Camera, View
from kerfwright.capture.markers import marker_scale, parse_markers
from kerfwright.errors import CaptureError, OptionError

UNIT = 0.37  # of the capture, per true metre
SIDE = 0.04  # metres
SHEET = 1000  # pixels a side of the printed sheet, 0.3 m wide
LENS = (-0.1, 0.03, 0.0005, -0.0003)


def sheet(family=cv2.aruco.DICT_4X4_50) -> tuple[np.ndarray, float]:
    """A white page with three markers, and metres a pixel."""
    page = np.full((SHEET, SHEET), 255, np.uint8)
    pixels = round(SIDE / 0.3 * SHEET)
    for number, (x, y) in {3: (100, 120), 7: (650, 200), 11: (400, 700)}.items():
        marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(family), number, pixels)
        page[y : y + pixels, x : x + pixels] = marker
    return page, SIDE / pixels


@pytest.fixture(scope="module")
def photographs(tmp_path_factory, shapes):
    """Six views of the page, which lies on z = 0 about the origin, through a lens; and two that do not show it."""
    folder = tmp_path_factory.mktemp("photos")
    page, pixel = sheet()
    camera = Camera("OPENCV", 1200, 900, (1100, 1100, 605, 447, *LENS))
    rows, columns = np.indices((900, 1200))
    ideal = camera.undistort(np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5)
    views = []
    for k in range(8):
        a = 2 * np.pi * k / 8
        target = np.array([0, 0, 0.0]) if k < 6 else np.array([9.0, 0, 0])
        centre = UNIT * (np.array([0.35 * np.cos(a), 0.35 * np.sin(a), 0.4]) + target)
        pose = shapes["look_at"](centre, UNIT * target)
        view = View(f"{k}.png", folder / f"{k}.png", camera, pose)
        rays = np.c_[ideal, np.ones(len(ideal))] @ pose[:3, :3]
        on_page = centre[:2] + rays[:, :2] * (-centre[2] / rays[:, 2])[:, None]
        on_page = on_page * [1, -1]  # a page has y downwards
        maps = (on_page / UNIT / pixel + SHEET / 2 - 0.5).astype(np.float32).reshape(900, 1200, 2)
        picture = cv2.remap(page, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderValue=200)
        cv2.imwrite(str(view.path), cv2.GaussianBlur(picture, None, 0.8))
        views.append(view)
    return views


def test_the_scale_is_found(photographs):
    scale = marker_scale(photographs, parse_markers("4x4_50:40mm"))
    assert scale.millimetres_per_unit == pytest.approx(1000 / UNIT, rel=1e-3)
    assert scale.origin == "measured" and scale.standard_error < 0.002 * scale.millimetres_per_unit
    assert "3 markers of 4x4_50 (3, 7, 11), 40 mm: sides differ by 0." in scale.note


def test_a_marker_that_moved_between_photographs_is_no_measure(photographs):
    first = photographs[0]
    moved = View(first.name, first.path, first.camera, photographs[1].camera_from_world)
    with pytest.raises(CaptureError, match="3 markers found, none of them square"):
        marker_scale([moved, photographs[3], *photographs[6:]], parse_markers("4x4_50:40mm"))


def test_no_marker_is_told(photographs):
    with pytest.raises(CaptureError, match=r"--markers: apriltag36h11: 0 markers found, .*check the family"):
        marker_scale(photographs[:3], parse_markers("apriltag36h11:4cm"))


@pytest.mark.parametrize("text", ["", "40mm", "4x4_50", "4x4_50:", "4x4_50:0", "9x9_50:40", "4x4_50:1.2.3mm", "x:4mm"])
def test_what_is_no_family_and_side_is_told(text):
    with pytest.raises(OptionError, match=r"--markers: .*such as 4x4_50:40mm"):
        parse_markers(text)


def test_units():
    assert parse_markers("AprilTag36h11: 1.5 in").side == pytest.approx(38.1)
    assert parse_markers("aruco:0.05m").side == 50 and parse_markers("5x5_100:60").side == 60
