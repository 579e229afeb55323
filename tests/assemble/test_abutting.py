"""Ends of boards on edges of parallel ones, flush with them or not."""

import numpy as np
import pytest
from shapely.geometry import Point, Polygon, box

from clouds import pose, sheet
from kerfwright.assemble.abutting import with_abutting
from kerfwright.assemble.types import Assembly

D = 500.0
# as traced: the left leg's mask runs 7 mm out over the apron, the apron's right end stops 3 mm short at its foot
LEG = box(0, 0, 50, 400).union(Polygon([(50, 330), (55, 335), (57, 400), (50, 400)]))
APRON = Polygon([(50, 335), (297, 335), (300, 360), (300, 400), (51, 400)])
OTHER = box(300, 0, 350, 400)


def met(*sheets):
    return with_abutting(Assembly(sheets, (), tuple(() for _ in sheets)), D)


def turned_over(name: str, z: float, thickness: float, region: Polygon):
    """A board with its frame upside down: x to -x, z to -z."""
    over = Polygon([(-x, y) for x, y in region.exterior.coords])
    return sheet(name, pose((0, 0, z + thickness), (-1, 0, 0), (0, 1, 0)), thickness, over)


@pytest.mark.parametrize("apron", [
    sheet("apron", pose((0, 0, 4)), 15.0, APRON), turned_over("apron", 4, 15.0, APRON),
])  # fmt: skip
def test_an_apron_ends_on_the_edges_of_legs_that_are_not_flush_with_it(apron) -> None:
    legs = [sheet("left", np.eye(4), 22.0, LEG), sheet("right", np.eye(4), 22.0, OTHER)]
    found = met(legs[0], apron, legs[1])
    assert [(c.a, c.b) for c in found.contacts] == [("left", "apron"), ("apron", "right")]
    assert [(c.type, c.area) for c in found.contacts] == [(4, pytest.approx(65 * 15, rel=0.1))] * 2
    for k, board in enumerate(found.sheets):
        for segment in found.constraints[k]:
            ends = board.to_world(np.array([[*segment.start, 0], [*segment.end, 0]]))
            line = 50 if board.name == "left" or found.contacts[segment.contact].b == "apron" else 300
            assert ends[:, 0] == pytest.approx(line, abs=0.3)
            x, y = (segment.end - segment.start) / np.linalg.norm(segment.end - segment.start)
            left = (segment.start + segment.end) / 2 + 10 * np.array([-y, x])
            assert board.region.contains(Point(left))  # wood on the left
    assert [len(c) for c in found.constraints] == [1, 2, 1]


@pytest.mark.parametrize(("origin", "region"), [
    ((0, 0, 4), box(55, 335, 300, 400)),  # a gap of 5 mm, as between slats
    ((0, 0, 4), box(50, 385, 300, 400)),  # 15 mm of contact
    ((0, 0, 21), box(50, 335, 300, 400)),  # on it rather than beside it
    ((0, 0, 4), box(10, 335, 300, 400)),  # two finds of one board
])  # fmt: skip
def test_boards_apart_have_no_contact(origin, region) -> None:
    leg = sheet("leg", np.eye(4), 22.0, box(0, 0, 50, 400))
    assert not met(leg, sheet("other", pose(origin), 15.0, region)).contacts


def test_boards_that_are_in_contact_already_get_no_second_one() -> None:
    once = met(sheet("leg", np.eye(4), 22.0, LEG), sheet("apron", pose((0, 0, 4)), 15.0, APRON))
    assert len(with_abutting(once, D).contacts) == len(once.contacts) == 1
