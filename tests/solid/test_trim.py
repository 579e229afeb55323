"""Boards trimmed to each other: slips of fits go, real overlaps stay for the checker."""

from itertools import combinations, pairwise

import numpy as np
import pytest

from kerfwright.model import Bezier, Contact, Line, Loop, Model
from kerfwright.model.clip import ConvexArea, clipped_loop
from kerfwright.model.frames import invert, model_from_board, rows
from kerfwright.model.geometry import edge_length, edge_points, loop_distance, reverse_edge, signed_area
from kerfwright.model.pieces import edge_piece
from kerfwright.model.slits import without_idle_nodes, without_slits
from kerfwright.solid import assembly_solids, check
from kerfwright.solid.faces import shape_of
from kerfwright.solid.interference import common_volume
from kerfwright.solid.trim import fitted_together
from simple import board, hole, placed, polygon, rectangle, stool

CURVE = Bezier(start=(0, 0), control_1=(20, 30), control_2=(50, -10), end=(80, 5))


def overlap(model: Model) -> float:
    shapes = [shape_of(name, solid) for name, solid in assembly_solids(model)]
    return sum(common_volume(a, b) for a, b in combinations(shapes, 2))


def longer_legs(by: float, **rest) -> Model:
    """The stool, its legs so much too long and the second a repeat of the first; the rise to the top is along x."""
    top, *legs = stool().boards
    path = board(rectangle(380 + by, 300)).cut_path
    legs = [leg.model_copy(update={"cut_path": path, "same_as": same}) for leg, same in zip(legs, (None, "leg left"),
                                                                                         strict=True)]  # fmt: skip
    return stool().model_copy(update={"boards": (top, *legs)})


def test_edges_are_put_on_the_sheet_they_end_on():
    model = longer_legs(0.03)
    assert overlap(model) == pytest.approx(2 * 0.03 * 18 * 300, rel=1e-3)
    trimmed = fitted_together(model)
    assert overlap(trimmed) == 0
    assert [len(b.cut_path.outer.edges) for b in trimmed.boards] == [4, 4, 4]
    assert trimmed.boards[1].cut_path == trimmed.boards[2].cut_path  # repeats stay repeats
    assert signed_area(trimmed.boards[1].cut_path.outer) == pytest.approx(380 * 300)
    assert not [f for f in check(trimmed) if f.code in ("K201", "K202", "K210")]


def test_an_edge_that_crosses_the_sheet_is_moved_and_not_bent():
    """Repeats at slightly different turns: the end of one lies .004 mm in the sheet here, .002 mm off it there."""
    model = longer_legs(0)
    top, left, _ = model.boards
    wedge = board([(0, 0), (380.004, 0), (379.998, 300), (0, 300)]).cut_path
    model = Model(boards=(top, left.model_copy(update={"cut_path": wedge})), contacts=model.contacts[:1])
    trimmed = fitted_together(model)
    assert overlap(model) > 1 and overlap(trimmed) == pytest.approx(0, abs=1e-6)
    assert len(trimmed.boards[1].cut_path.outer.edges) == 4
    assert trimmed.boards[1].cut_path.outer.edges[1].end == pytest.approx((379.994, 300), abs=1e-6)


def test_a_repeat_is_turned_in_its_own_plane_onto_the_sheet_that_it_ends_on():
    """The second leg stands askew by 1e-4 rad: its end is .03 mm off the top at one side, and on it at the other."""
    model = longer_legs(0)
    top, left, right = model.boards
    c, s = np.cos(1e-4), np.sin(1e-4)
    askew = model_from_board(right) @ [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    right = right.model_copy(update={"model_from_board": rows(askew)})
    model = model.model_copy(update={"boards": (top, left, right)})
    trimmed = fitted_together(model)
    assert {f.code for f in check(model)} >= {"K201"}
    assert not [f for f in check(trimmed) if f.code in ("K201", "K202", "K210")]
    assert trimmed.boards[:2] == model.boards[:2] and trimmed.boards[2].cut_path == model.boards[1].cut_path
    moved = invert(askew) @ model_from_board(trimmed.boards[2])
    assert moved[2] == pytest.approx([0, 0, 1, 0], abs=1e-12)  # its sheet planes stay where they were


def test_a_mirror_image_is_trimmed_in_the_mirror():
    """The second leg is turned over about its y axis, and only the first one is too long at the top."""
    model = longer_legs(0.03)
    top, left, right = model.boards
    flipped = placed((0, 0, -1), (0, 1, 0), (332, 0, 380.03))
    right = right.model_copy(update={"mirrored": True, "model_from_board": rows(flipped)})
    trimmed = fitted_together(model.model_copy(update={"boards": (top, left, right)}))
    assert [signed_area(b.cut_path.outer) for b in trimmed.boards] == pytest.approx([120000, 114000, 114000])
    assert trimmed.boards[2].cut_path.outer.edges[0].start[0] != trimmed.boards[1].cut_path.outer.edges[0].start[0]


def test_a_deep_overlap_is_left_for_the_checker():
    model = longer_legs(3.0)
    assert fitted_together(model).boards == model.boards
    assert "K110" in {f.code for f in check(fitted_together(model))}


def test_an_outline_that_trimming_would_lead_through_a_hole_is_left():
    """A hole .02 mm from the end that runs .03 mm into the top."""
    model = longer_legs(0.03)
    holes = (hole(380.03 - 5 - 0.02, 150, 5.0),)
    legs = [leg.model_copy(update={"cut_path": board(rectangle(380.03, 300), holes=holes).cut_path})
            for leg in model.boards[1:]]  # fmt: skip
    model = model.model_copy(update={"boards": (model.boards[0], *legs)})
    trimmed = fitted_together(model)
    assert [b.cut_path for b in trimmed.boards] == [b.cut_path for b in model.boards]
    assert not {f.code for f in check(trimmed)} & {"K105", "K106", "K109"}


def test_a_slit_into_which_something_reaches_is_not_bridged():
    """A wedge 2 mm wide at its mouth, and a fin of .02 mm from below in it: the bridge would cross the fin."""
    slit = [(99.0, 0.0), (100.0, 45.0), (101.0, 0.0)]
    fin = [(100.01, -20.0), (100.01, 43.0), (99.99, 43.0), (99.99, -20.0)]
    around = [(95.0, -20.0), (95.0, -30.0), (150.0, -30.0), (150.0, 80.0), (0.0, 80.0)]
    outline = [(0.0, 0.0), *slit, (120.0, 0.0), (120.0, -20.0), *fin, *around]
    model = Model(boards=(board(outline),))
    assert fitted_together(model).boards == model.boards
    assert not {f.code for f in check(model)} & {"K105", "K106", "K109"}
    free = Model(boards=(board([p for p in outline if p not in fin]),))
    assert len(fitted_together(free).boards[0].cut_path.outer.edges) == len(outline) - len(fin) + 1


def test_only_what_lies_in_a_neighbour_is_cut_off():
    """A curved end runs .2 mm into a post beside which the board goes on."""
    bulge = Bezier(start=(200, 0), control_1=(200.3, 30), control_2=(200.3, 70), end=(200, 100))
    sides = [(200, 100), (0, 100), (0, 0), (200, 0)]
    outline = Loop(edges=(bulge, *(Line(start=a, end=b) for a, b in pairwise(sides))))
    post = board(rectangle(40, 300), "post", 18.0, placed((0, 1, 0), (0, 0, 1), (200.1, 30, -100)))
    model = Model(boards=(board(outline, "shelf"), post))
    assert overlap(model) > 10
    shelf = fitted_together(model).boards[0]
    assert overlap(fitted_together(model)) == pytest.approx(0, abs=1e-6)
    points = np.concatenate([edge_points(e, np.linspace(0, 1, 50)) for e in shelf.cut_path.outer.edges])
    beside = (points[:, 1] < 29) | (points[:, 1] > 71)
    assert loop_distance(outline, points[beside]).max() < 0.01 and points[:, 0].max() > 200.09


def test_boards_glued_edge_to_edge_still_touch():
    left = board(rectangle(200.03, 100), "left", 16.0)
    right = board(rectangle(150, 100), "right", 16.0, placed(at=(200, 0, 0)))
    glued = Contact(
        type=4, a="left", b="right", face_a="edge", face_b="edge", point=(200, 50, 8), normal=(1, 0, 0),
        interface=(((200, 0, 0), (200, 100, 0), (200, 100, 16), (200, 0, 16)),), area=1600, angle=0,
    )  # fmt: skip
    trimmed = fitted_together(Model(boards=(left, right), contacts=(glued,)))
    assert overlap(trimmed) == pytest.approx(0, abs=1e-6)
    assert trimmed.contacts[0].area == pytest.approx(1600)
    assert not [f for f in check(trimmed) if f.code in ("K111", "K201", "K210")]


def test_contacts_tell_what_the_solids_meet_on():
    wrong = [c.model_copy(update={"area": 1.0}) for c in stool().contacts]
    model = fitted_together(stool().model_copy(update={"contacts": tuple(wrong)}))
    assert [c.area for c in model.contacts] == pytest.approx([5400.0, 5400.0])
    assert np.ptp(np.array(model.contacts[0].interface[0]), axis=0) == pytest.approx([18, 300, 0])


def test_a_loop_is_clipped_along_the_cutting_sides_only():
    corners = np.array([(80.0, 80.0), (120, 80), (120, 120), (80, 120)])
    corner = ConvexArea(corners, np.array([True, False, False, True]))
    square = polygon(rectangle(100, 100))
    notched = clipped_loop(square, corner)
    assert signed_area(notched) == pytest.approx(100 * 100 - 20 * 20) and len(notched.edges) == 6
    across = ConvexArea(corner.corners, np.array([False, False, False, True]))
    assert clipped_loop(square, across) is None
    assert clipped_loop(polygon(rectangle(50, 50)), corner) is None


def test_pieces_of_curves_run_along_them():
    piece = edge_piece(CURVE, 0.2, 0.7)
    assert edge_points(piece, np.array([0, 0.5, 1])) == pytest.approx(edge_points(CURVE, np.array([0.2, 0.45, 0.7])))
    assert edge_piece(CURVE, 0.2, 1.0).end == CURVE.end


def test_slits_are_bridged():
    """A line and a curve that doubles back beside it: a slit of 20 mm, .5 mm wide at its mouth."""
    back = Bezier(start=(50, 20), control_1=(50, 15), control_2=(49.7, 5), end=(49.0, 0))
    points = [(49.0, 0), (0, 0), (0, 50), (100, 50), (100, 0), (50, 0), (50, 20)]
    lines = (Line(start=a, end=b) for a, b in pairwise(points))
    ring = Loop(edges=tuple(_turned_round([*lines, back])))
    assert signed_area(ring) > 0
    bridged = without_slits(ring, 0.3)
    lengths = [edge_length(e) for e in bridged.edges]
    assert min(lengths) == pytest.approx(0.3, abs=0.02) and len(bridged.edges) == len(ring.edges) + 1
    assert abs(signed_area(bridged) - signed_area(ring)) < 2
    assert without_slits(polygon(rectangle(100, 100)), 0.3) == polygon(rectangle(100, 100))


def _turned_round(edges: list) -> list:
    return [reverse_edge(e) for e in reversed(edges)]


def test_lines_that_a_cut_has_parted_are_one_again():
    """A sliver of nothing, and a node in the middle of an edge; a corner of a tenth of a millimetre stays."""
    points = [(0, 0), (60, 0), (60, 0.0002), (100, 0), (100, 50), (50, 50.1), (0, 50)]
    edges = tuple(Line(start=a, end=b) for a, b in pairwise([*points, points[0]]))
    loop = without_idle_nodes(Loop(edges=edges), 1e-3)
    assert [e.start for e in loop.edges] == [(0, 0), (100, 0), (100, 50), (50, 50.1), (0, 50)]
    assert without_idle_nodes(loop, 1e-3) is loop


def test_an_edge_beside_a_shorter_board_is_moved_as_a_whole():
    """Boards glued edge to edge, .004 mm in each other, one .3 mm longer: no step of .004 mm at its end."""
    first = board(rectangle(400, 100), "first")
    second = board(rectangle(399.7, 100.004), "second", pose=placed(at=(0, -100, 0)))
    seam = Contact(
        type=3, a="first", b="second", face_a="edge", face_b="edge", point=(200, 0, 8), normal=(0, -1, 0),
        interface=(((0, 0, 0), (399.7, 0, 0), (399.7, 0, 16), (0, 0, 16)),), area=399.7 * 16, angle=0,
    )  # fmt: skip
    trimmed = fitted_together(Model(boards=(first, second), contacts=(seam,)))
    assert overlap(trimmed) == pytest.approx(0, abs=1e-6)
    assert [len(b.cut_path.outer.edges) for b in trimmed.boards] == [4, 4]
