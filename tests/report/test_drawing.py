"""A board's drawing shows its path, its nodes and its measures."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from kerfwright.model import Arc, Bevel, Bezier, Board, Circle, CutPath, Line, Loop, Quantity
from kerfwright.model.geometry import path_area
from kerfwright.report.drawing import board_svg

IDENTITY = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
OUTER = Loop(
    edges=(
        Line(start=(0, 0), end=(200, 0)),
        Arc(start=(200, 0), mid=(240, 40), end=(200, 80)),
        Line(start=(200, 80), end=(60, 80)),
        Bezier(start=(60, 80), control_1=(40, 80), control_2=(20, 60), end=(0, 80)),
        Line(start=(0, 80), end=(0, 0)),
    )
)
HOLE = Loop(edges=(Circle(centre=(100, 40), radius=12, clockwise=True),))


def board(name: str = "seat", outer: Loop = OUTER, **more) -> Board:
    path = CutPath(outer=outer, holes=(HOLE,))
    return Board(name=name, model_from_board=IDENTITY, thickness=Quantity(value=18), cut_path=path, **more)


def tree(drawn: Board) -> ElementTree.Element:
    return ElementTree.fromstring(board_svg(drawn))


def texts(root: ElementTree.Element, kind: str) -> set[str]:
    return {t.text for t in root.iter("text") if kind in t.get("class").split()}


def filled_area(d: str) -> float:
    """Signed area of the path as a browser would fill it; arcs by SVG's own rule (SVG 1.1, F.6.5)."""
    total, here, start = 0.0, np.zeros(2), np.zeros(2)
    for kind, numbers in re.findall(r"([MLACZ])([^MLACZ]*)", d):
        v = np.array([float(x) for x in numbers.split()])
        if kind == "M":
            here = start = v
        for p in follow(kind, here, start, v):
            total += (here[0] * p[1] - p[0] * here[1]) / 2
            here = p
    return total


def follow(kind: str, here, start, v):
    """Points along one command of a path, the first left out."""
    if kind == "C":
        return cubic(here, *v.reshape(3, 2))
    if kind == "A":
        return arc(here, v)
    return [start] if kind == "Z" else [v]


def cubic(p0, p1, p2, p3):
    t = np.linspace(0, 1, 400)[1:, None]
    return (1 - t) ** 3 * p0 + 3 * (1 - t) ** 2 * t * p1 + 3 * (1 - t) * t**2 * p2 + t**3 * p3


def arc(p, v):
    radius, large, sweep, end = v[0], v[3], v[4], v[5:]
    half = (p - end) / 2
    h = np.sqrt(max(0.0, (radius**2 - half @ half) / (half @ half))) * (-1 if large == sweep else 1)
    centre = h * np.array([half[1], -half[0]]) + (p + end) / 2
    a, b = (np.arctan2(*(q - centre)[::-1]) for q in (p, end))
    turn = (b - a) % (2 * np.pi) if sweep else -((a - b) % (2 * np.pi))
    angles = a + np.linspace(0, turn, 400)[1:]
    return centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def test_the_filled_shape_is_the_board():
    path = tree(board()).find(".//path[@class='wood']").get("d")
    assert filled_area(path) == pytest.approx(path_area(board().cut_path), rel=1e-4)


@pytest.mark.parametrize("mid", [(240, 40), (205, 40), (290, 40)])
def test_arcs_bulge_as_they_should(mid):
    edges = (OUTER.edges[0], Arc(start=(200, 0), mid=mid, end=(200, 80)), *OUTER.edges[2:])
    drawn = board(outer=Loop(edges=edges))
    path = tree(drawn).find(".//path[@class='wood']").get("d")
    assert filled_area(path) == pytest.approx(path_area(drawn.cut_path), rel=1e-4)


def test_measures():
    root = tree(board())
    assert texts(root, "overall") == {"240.0", "80.0"}
    assert texts(root, "size") == {"200.0", "R40.0", "140.0", "80.0", "⌀24.0"}


def test_nodes_are_sharp_or_smooth():
    root = tree(board())
    titles = [n.find("title").text for n in root.iter() if n.get("class") == "node"]
    assert titles == [
        "200.0, 0.0 mm, smooth",
        "200.0, 80.0 mm, smooth",
        "60.0, 80.0 mm, smooth",
        "0.0, 80.0 mm, sharp",
        "0.0, 0.0 mm, sharp",
    ]


def test_bevels_are_coloured_by_their_lean():
    bevel = Bevel(start=(0, 0), end=(200, 0), point=(0, 0, 0), normal=(0, -1, 0), angle=Quantity(value=12))
    other = bevel.model_copy(update={"start": (200, 80), "end": (60, 80), "angle": Quantity(value=-7.5)})
    root = tree(board(bevels=(bevel, other)))
    assert texts(root, "top-shorter") == {"12.0°"} and texts(root, "top-longer") == {"7.5°"}


def test_a_name_cannot_break_out_of_the_drawing():
    root = tree(board("</title><script>alert(1)</script>"))
    assert not list(root.iter("script")) and root.find("title").text.startswith("</title>")


def test_everything_lies_inside_the_frame():
    root = tree(board())
    x, y, width, height = map(float, root.get("viewBox").split())
    for text in root.iter("text"):
        tx, ty = map(float, re.match(r"translate\(([-\d.]+),([-\d.]+)\)", text.get("transform")).groups())
        assert x <= tx <= x + width and y <= -ty <= y + height
