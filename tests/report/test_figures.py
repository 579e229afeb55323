"""The numbers of the report are those of the model."""

import math

import pytest

from kerfwright.model import Arc, Board, Circle, Contact, CutPath, Finding, Line, Loop, Model, Quantity
from kerfwright.report.figures import board_size, figures

IDENTITY = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))


def rounded(length: float, width: float) -> CutPath:
    """A rectangle whose right end is half a circle, with a round hole."""
    r = width / 2
    corners = [(0, 0), (length - r, 0), (length - r, width), (0, width)]
    outer = (
        Line(start=corners[0], end=corners[1]),
        Arc(start=corners[1], mid=(length, r), end=corners[2]),
        Line(start=corners[2], end=corners[3]),
        Line(start=corners[3], end=corners[0]),
    )
    return CutPath(outer=Loop(edges=outer), holes=(Loop(edges=(Circle(centre=(r, r), radius=5, clockwise=True),)),))


def board(name: str, thickness: float = 18.0, **more) -> Board:
    return Board(
        name=name, model_from_board=IDENTITY, thickness=Quantity(value=thickness), cut_path=rounded(300, 80), **more
    )


def contact(a: str, b: str, kind: int = 1) -> Contact:
    return Contact(
        type=kind,
        a=a,
        b=b,
        face_a="top",
        face_b="edge",
        point=(0, 0, 0),
        normal=(0, 0, 1),
        interface=(),
        area=10.0,
        angle=90.0,
    )


MODEL = Model(
    boards=(board("left"), board("right", same_as="left", mirrored=True), board("shelf", 12.0)),
    contacts=(contact("left", "shelf"), contact("right", "shelf"), contact("left", "right", 3)),
    findings=(Finding(code="K001", severity="info", message="m"), Finding(code="K100", severity="error", message="m")),
)


def test_size_of_a_board_counts_the_bulge_of_an_arc():
    assert board_size(MODEL.boards[0]) == pytest.approx((300, 80), abs=0.01)


def test_counts():
    found = figures(MODEL)
    assert (found["boards"], found["distinct_boards"], found["contacts"]) == (3, 2, 3)
    assert found["contacts_by_type"] == {"1": 2, "3": 1}
    assert found["thicknesses_mm"] == [12.0, 18.0]
    assert found["findings"] == {"error": 1, "warning": 0, "info": 1}


def test_a_board_s_own_figures():
    right = figures(MODEL)["parts"][1]
    assert (right["name"], right["same_as"], right["mirrored"], right["holes"]) == ("right", "left", True, 1)
    assert right["edges"] == {"arc": 1, "circle": 1, "line": 3}
    assert math.isclose(right["length_mm"], 300, abs_tol=0.01)


def test_of_nothing():
    assert figures(Model())["boards"] == 0
