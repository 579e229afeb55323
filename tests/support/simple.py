"""Small models for tests of solids and exporters."""

from itertools import pairwise

import numpy as np

from kerfwright.model import Bevel, Bezier, Board, Circle, Contact, CutPath, Line, Loop, Model, Quantity
from kerfwright.model.frames import rows
from kerfwright.model.geometry import reverse_loop

Points = list[tuple[float, float]]


def polygon(points: Points) -> Loop:
    """A loop of straight edges."""
    return Loop(edges=tuple(Line(start=a, end=b) for a, b in zip(points, points[1:] + points[:1], strict=True)))


def rectangle(width: float, height: float) -> Points:
    return [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]


def hole(x: float, y: float, radius: float) -> Loop:
    return Loop(edges=(Circle(centre=(x, y), radius=radius, clockwise=True),))


def board(loop: Loop | Points, name: str = "board", thickness: float = 16.0, pose: np.ndarray | None = None, **rest):
    """A board; `holes` and other fields by name."""
    outer = loop if isinstance(loop, Loop) else polygon(loop)
    return Board(
        name=name,
        model_from_board=rows(np.eye(4) if pose is None else pose),
        thickness=Quantity(value=thickness),
        cut_path=CutPath(outer=outer, holes=rest.pop("holes", ())),
        **rest,
    )


def bevel(start, end, degrees: float, thickness: float = 16.0, depth: float | None = None, **rest) -> Bevel:
    """A bevel through the square edge's bottom (positive angle) or top (negative), or at height `depth`."""
    along = np.subtract(end, start) / np.hypot(*np.subtract(end, start))
    angle = np.radians(degrees)
    normal = (along[1] * np.cos(angle), -along[0] * np.cos(angle), np.sin(angle))
    height = (0.0 if degrees > 0 else thickness) if depth is None else depth
    return Bevel(start=start, end=end, point=(*start, height), normal=normal, angle=Quantity(value=degrees), **rest)


def placed(x=(1, 0, 0), y=(0, 1, 0), at=(0, 0, 0)) -> np.ndarray:
    """The pose of a board whose x and y axes point there."""
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, y, np.cross(x, y), at
    return pose


def stool() -> Model:
    """Two upright legs of 300 x 380 x 18 mm under a top of 400 x 300 x 18 mm."""
    top = board(rectangle(400, 300), "top", 18.0, placed(at=(0, 0, 380)))
    legs = [
        board(rectangle(380, 300), name, 18.0, placed((0, 0, 1), (0, 1, 0), (x + 18, 0, 0)))
        for name, x in (("leg left", 50.0), ("leg right", 332.0))
    ]
    contacts = tuple(
        Contact(
            type=1,
            a="top",
            b=leg.name,
            face_a="bottom",
            face_b="edge",
            point=(x + 9, 150, 380),
            normal=(0, 0, -1),
            interface=(((x, 0, 380), (x, 300, 380), (x + 18, 300, 380), (x + 18, 0, 380)),),
            area=18 * 300,
            angle=90,
        )
        for leg, x in zip(legs, (50.0, 332.0), strict=True)
    )
    return Model(name="stool", boards=(top, *legs), contacts=contacts)


def cracked(width: float) -> Loop:
    """The outline of a board of 200 x 60 mm with a crack of that width between two curves, 45 mm deep, pointed."""
    near = Bezier(start=(100, 0), control_1=(95, 15), control_2=(115, 30), end=(100, 45))
    far = Bezier(start=(100, 45), control_1=(115 - width, 30), control_2=(95 - width, 15), end=(100 - width, 0))
    points = [(100 - width, 0.0), (0.0, 0.0), (0.0, 60.0), (200.0, 60.0), (200.0, 0.0), (100.0, 0.0)]
    lines = [Line(start=a, end=b) for a, b in pairwise(points)]
    return reverse_loop(Loop(edges=(near, far, *lines)))
