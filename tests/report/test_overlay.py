"""The drawing lies where the camera sees the boards."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import View
from kerfwright.report.meshes import BoardMesh
from kerfwright.report.overlay import LINE_COLOUR, draw, outlined, shaded

CAMERAS = {
    "pinhole": Camera("PINHOLE", 200, 160, (220.0, 210.0, 103.0, 78.0)),
    "distorted": Camera("OPENCV", 200, 160, (220.0, 210.0, 103.0, 78.0, -0.25, 0.08, 0.004, -0.003)),
}
COLOURS = [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]


def box(name: str, low, high) -> BoardMesh:
    corners = np.array(list(product(*zip(low, high, strict=True))), float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return BoardMesh(name, corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


def view(camera: Camera) -> View:
    """Looks along +y at the origin from 500 mm away, z up in the picture."""
    camera_from_world = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 500], [0, 0, 0, 1.0]])
    return View("front", Path("front.png"), camera, camera_from_world)


MESHES = [box("near", (-90, -20, -60), (-10, 0, 60)), box("far", (-60, 50, -40), (120, 70, 40))]


@pytest.mark.parametrize("name", CAMERAS)
def test_every_pixel_shows_the_board_in_front(name):
    front = view(CAMERAS[name])
    idx = draw(MESHES, front).board_idx
    inside = {0: (-80, -20, (-50, 50), -20), 1: (5, 110, (-30, 30), 50)}
    for board, (low, high, (bottom, top), y) in inside.items():
        grid = np.array([[x, y, z] for x in np.linspace(low, high, 9) for z in np.linspace(bottom, top, 9)])
        columns, rows = np.floor(front.project(grid)[0]).astype(int).T
        assert (idx[rows, columns] == board).all()
    corners = idx[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert (corners == -1).all()


@pytest.mark.parametrize("name", CAMERAS)
def test_outlines_run_along_the_projected_edges_and_nowhere_else(name):
    front = view(CAMERAS[name])
    lines = draw(MESHES[:1], front).lines
    drawn = np.argwhere(lines > 0.2)[:, ::-1] + 0.5
    rim = [
        np.linspace(a, b, 400)
        for a, b in (((-90, -60), (-10, -60)), ((-10, -60), (-10, 60)), ((-10, 60), (-90, 60)), ((-90, 60), (-90, -60)))
    ]
    path = np.array([[x, -20, z] for side in rim for x, z in side])
    # The inner side of the board, x = -10, is seen too; its far edge is at y = 0.
    far = np.array([[-10, 0, z] for z in np.linspace(-60, 60, 400)])
    expected = front.project(np.concatenate([path, far]))[0]
    gap = np.linalg.norm(drawn[:, None] - expected[None], axis=2)
    assert gap.min(axis=1).max() < 1.5, "a line where no edge is"
    assert gap.min(axis=0).max() < 1.5, "an edge without its line"


def test_an_edge_between_two_faces_of_one_board_is_drawn():
    front = view(CAMERAS["pinhole"])
    lines = draw(MESHES[:1], front).lines
    column, row = np.floor(front.project(np.array([[-10.0, -20, 0]]))[0][0]).astype(int)
    assert lines[row, column - 1 : column + 1].max() > 0.4


def test_pictures_change_only_where_boards_are():
    front = view(CAMERAS["pinhole"])
    photo = np.full((160, 200, 3), 90, np.uint8)
    drawing = draw(MESHES, front)
    away = (drawing.board_idx < 0) & (drawing.lines == 0)
    for picture in (shaded(photo, drawing, COLOURS), outlined(photo, drawing)):
        assert picture.shape == photo.shape and picture.dtype == np.uint8
        assert (picture[away] == 90).all() and (picture != 90).any()
    colour = shaded(photo, drawing, COLOURS)
    plain = drawing.lines == 0
    assert (colour[(drawing.board_idx == 0) & plain][:, 0] > colour[(drawing.board_idx == 0) & plain][:, 2]).all()
    assert (colour[(drawing.board_idx == 1) & plain][:, 0] < colour[(drawing.board_idx == 1) & plain][:, 2]).all()
    assert (outlined(photo, drawing)[drawing.lines == 1] == LINE_COLOUR).all()


def test_nothing_to_draw():
    drawing = draw([], view(CAMERAS["pinhole"]))
    assert (drawing.board_idx == -1).all() and not drawing.lines.any()


def test_boards_that_leave_the_picture_or_reach_behind_the_camera():
    front = view(CAMERAS["pinhole"])
    partly = draw([box("wide", (0, 0, -20), (900, 10, 20))], front)
    assert (partly.board_idx[72:84, -1] == 0).all() and (partly.board_idx[:, 0] == -1).all()
    around = draw([box("room", (-400, -900, -400), (400, 900, 400))], front)
    assert (around.board_idx == 0).all()
