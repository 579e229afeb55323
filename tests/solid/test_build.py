"""Solids against closed formulas."""

import numpy as np
import pytest

from kerfwright.errors import ModelError
from kerfwright.model import Arc, Bezier, Line, Loop, Model
from kerfwright.model.geometry import path_area
from kerfwright.solid import assembly_solids, board_solid
from kerfwright.solid.build import solid_is_valid
from simple import bevel, board, hole, placed, polygon, rectangle

RECTANGLE = rectangle(100, 50)
FORK = [(0, 0), (100, 0), (100, 80), (60, 80), (60, 30), (40, 30), (40, 80), (0, 80)]
HEXAGON = [(0, 0), (100, 0), (140, 60), (100, 120), (0, 120), (-40, 60)]


def inset_area(points, distance: float) -> float:
    import shapely

    return shapely.Polygon(points).buffer(-distance, join_style="mitre", mitre_limit=100).area


def prismatoid(points, height: float, slope: float) -> float:
    """Volume between the outline and its inset: Simpson's rule is exact for it."""
    inset = height * np.tan(np.radians(slope))
    areas = [inset_area(points, d) for d in (0, inset / 2, inset)]
    return height / 6 * (areas[0] + 4 * areas[1] + areas[2])


def all_round(points, degrees: float, **rest):
    return tuple(bevel(a, b, degrees, **rest) for a, b in zip(points, points[1:] + points[:1], strict=True))


def assert_sound(solid, volume: float, faces: int) -> None:
    assert len(solid.shells()) == 1 and solid_is_valid(solid)
    assert solid.volume == pytest.approx(volume, rel=1e-9)
    assert len(solid.faces()) == faces


def test_lines_arcs_beziers_and_holes():
    outer = Loop(
        edges=(
            Line(start=(0, 0), end=(100, 0)),
            Arc(start=(100, 0), mid=(120, 20), end=(100, 40)),
            Bezier(start=(100, 40), control_1=(70, 60), control_2=(30, 20), end=(0, 40)),
            Line(start=(0, 40), end=(0, 0)),
        )
    )
    one = board(outer, holes=(hole(30, 15, 6), polygon([(60, 10), (60, 20), (80, 20), (80, 10)])))
    assert_sound(board_solid(one), path_area(one.cut_path) * 16, 4 + 1 + 4 + 2)


def test_a_full_circle_is_a_disc():
    disc = hole(3, 4, 50).model_copy()
    outer = Loop(edges=(disc.edges[0].model_copy(update={"clockwise": False}),))
    assert_sound(board_solid(board(outer)), np.pi * 2500 * 16, 3)


@pytest.mark.parametrize("degrees", [15, -15, 30, -30])
@pytest.mark.parametrize("points", [RECTANGLE, FORK, HEXAGON], ids=["rectangle", "fork", "hexagon"])
def test_bevels_all_round_meet_cleanly(points, degrees):
    one = board(points, bevels=all_round(points, degrees))
    assert_sound(board_solid(one), prismatoid(points, 16, abs(degrees)), len(points) + 2)


def test_pointed_all_round():
    both = (*all_round(FORK, 15, depth=8.0), *all_round(FORK, -15, depth=8.0))
    assert_sound(board_solid(board(FORK, bevels=both)), 2 * prismatoid(FORK, 8, 15), 2 * len(FORK) + 2)


def test_a_bevel_cuts_only_its_own_finger():
    one = board(FORK, bevels=(bevel((100, 80), (60, 80), 45),))
    assert_sound(board_solid(one), (8000 - 20 * 50) * 16 - 40 * 16 * 16 / 2, len(FORK) + 2)
    solid = board_solid(one)
    assert solid.is_inside((20, 79, 15)) and not solid.is_inside((80, 79, 15))


def test_a_bevel_stops_where_the_edge_goes_straight_on():
    half = board(RECTANGLE, bevels=(bevel((0, 0), (40, 0), 45),))
    assert_sound(board_solid(half), 80000 - 16 * 16 / 2 * 40, 8)
    twice = board(RECTANGLE, bevels=(bevel((0, 0), (40, 0), 45), bevel((40, 0), (100, 0), 45)))
    assert_sound(board_solid(twice), 80000 - 16 * 16 / 2 * 100, 6)


def test_a_bevel_runs_out_through_a_rounded_corner():
    r = 20 - 20 * np.cos(np.pi / 4)
    outer = Loop(
        edges=(
            Line(start=(0, 0), end=(80, 0)),
            Arc(start=(80, 0), mid=(80 + 20 * np.sin(np.pi / 4), r), end=(100, 20)),
            *polygon([(100, 20), (100, 50), (0, 50), (0, 0)]).edges[:3],
        )
    )
    solid = board_solid(board(outer, bevels=(bevel((0, 0), (80, 0), 45),)))
    assert solid_is_valid(solid) and len(solid.faces()) == 7
    assert not solid.is_inside((90, 10, 15.9)) and solid.is_inside((90, 10, 9.5))  # on the plane y = z over the round


def test_a_stretch_may_run_against_the_outline():
    there, back = bevel((0, 0), (100, 0), 30), bevel((0, 0), (100, 0), 30)
    back = back.model_copy(update={"start": there.end, "end": there.start})
    volumes = [board_solid(board(RECTANGLE, bevels=(b,))).volume for b in (there, back)]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-12)


def test_a_bevel_that_all_but_reaches_the_bottom_leaves_no_sliver():
    exact = bevel((0, 0), (100, 0), 30)
    near = exact.model_copy(update={"point": (0, 0, -5e-5)})
    solid = board_solid(board(RECTANGLE, bevels=(near,)))
    assert len(solid.faces()) == 6 and solid_is_valid(solid)


def test_bad_bevels_are_refused():
    aside = bevel((0, 10), (100, 10), 30)
    with pytest.raises(ModelError, match=r"bevels\[0\]: stretch"):
        board_solid(board(RECTANGLE, bevels=(aside,)))
    inward = bevel((0, 0), (100, 0), 30)
    inward = inward.model_copy(update={"normal": tuple(-x for x in inward.normal)})
    with pytest.raises(ModelError, match="points into the board"):
        board_solid(board(RECTANGLE, bevels=(inward,)))
    everything = bevel((0, 0), (100, 0), 80)
    with pytest.raises(ModelError, match="leave 0 pieces"):
        board_solid(board([(0, 0), (100, 0), (100, 2), (0, 2)], bevels=(everything.model_copy(
            update={"point": (0, 50, 0)}),)))  # fmt: skip


def test_zero_thickness_is_refused():
    with pytest.raises(ModelError, match="thickness: 0 mm"):
        board_solid(board(RECTANGLE, thickness=0.0))


def test_solids_stand_where_their_boards_do():
    pose = placed((0, 0, 1), (0.6, 0.8, 0), (10, 20, 30))
    ((name, solid),) = assembly_solids(Model(boards=(board(RECTANGLE, "leg", pose=pose),)))
    corners = np.array([tuple(v) for v in solid.vertices()])
    expected = np.array([(x, y, z) for x in (0, 100) for y in (0, 50) for z in (0, 16)]) @ pose[:3, :3].T + pose[:3, 3]
    assert name == "leg"
    np.testing.assert_allclose(
        corners[np.lexsort(corners.round(6).T)], expected[np.lexsort(expected.round(6).T)], atol=1e-9
    )
