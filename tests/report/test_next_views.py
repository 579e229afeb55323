"""The places proposed are those that nobody photographed from."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import View
from kerfwright.report.meshes import BoardMesh
from kerfwright.report.next_views import next_views

CAMERA = Camera("SIMPLE_PINHOLE", 800, 600, (700.0, 400.0, 300.0))


def box(name: str, low, high) -> BoardMesh:
    corners = np.array(list(product(*zip(low, high, strict=True))), float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return BoardMesh(name, corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


# A tray of 400 x 300: a floor and four sides.
TRAY = [
    box("floor", (-200, -150, 0), (200, 150, 12)),
    box("east", (188, -150, 12), (200, 150, 100)),
    box("west", (-200, -150, 12), (-188, 150, 100)),
    box("north", (-188, 138, 12), (188, 150, 100)),
    box("south", (-188, -150, 12), (188, -138, 100)),
]


def view(azimuth: float, elevation: float) -> View:
    """From a place 900 mm away, towards the tray's middle."""
    a, e = np.radians([azimuth, elevation])
    back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0])
    turn = np.stack([right, -np.cross(back, right), -back])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, -turn @ (900 * back + [0, 0, 50])
    return View(f"{azimuth}/{elevation}", Path("x"), CAMERA, pose)


def ring(azimuths) -> list[View]:
    return [view(a, e) for a in azimuths for e in (15, 50)] + [view(0, 80), view(180, 80)]


def test_nothing_is_asked_for_when_all_was_photographed():
    assert next_views(TRAY, ring(range(0, 360, 30))) == []


@pytest.mark.parametrize(("missing", "board"), [(0, "east"), (90, "north"), (180, "west"), (270, "south")])
def test_the_side_that_nobody_photographed_is_asked_for(missing, board):
    azimuths = [a for a in range(0, 360, 30) if abs((a - missing + 180) % 360 - 180) > 75]
    (first, *_) = next_views(TRAY, ring(azimuths))
    assert abs((first.azimuth - missing + 180) % 360 - 180) <= 30
    assert board in first.boards and first.share > 0.04
    near = float(first.nearest.split("/")[0])
    assert (near + first.turn - first.azimuth) % 360 == pytest.approx(0, abs=0.1)


def test_following_the_advice_settles_it():
    views = ring([a for a in range(0, 360, 30) if not -76 < (a + 180) % 360 - 180 < 76])
    asked = next_views(TRAY, views)
    followed = [view(v.azimuth + d, v.elevation) for v in asked for d in (-5, 5)]
    assert asked and next_views(TRAY, views + followed) == []


def test_what_no_photograph_can_show_is_not_asked_for():
    closed = [box("a", (-200, -150, 0), (200, 150, 50)), box("b", (-200, -150, 50), (200, 150, 100))]
    assert next_views(closed, ring(range(0, 360, 30))) == []


def test_without_boards_or_views_there_is_nothing_to_say():
    assert next_views([], ring([0])) == [] and next_views(TRAY, []) == []
