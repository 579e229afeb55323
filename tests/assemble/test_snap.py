"""Thicknesses snapped to stock: when, by how much, and which face moves."""

from types import SimpleNamespace

import numpy as np
import pytest

from clouds import pose, sheet, shelf_capture, shelf_parts
from kerfwright.assemble import AssembleOptions, Stock, assemble
from kerfwright.assemble.snap import snapped_to_stock
from kerfwright.model import Origin, Quantity


def board(thickness: float, error: float = 0.1, origin: Origin = Origin.MEASURED):
    quantity = Quantity(value=thickness, standard_error=error, origin=origin)
    return sheet("b", pose((0, 0, 100)), thickness, (0, 0, 200, 100), quantity=quantity)


def snapped(*boards, sizes=(12.0, 18.0, 19.0), held=(), noise=0.0, scale_error=0.0):
    decided = [SimpleNamespace(joint=SimpleNamespace(a=a, face_a=face)) for a, face in held]
    return snapped_to_stock(boards, decided, noise, AssembleOptions(stock=Stock(sizes, scale_error)))


def value(thickness: float, **rest) -> float:
    return snapped(board(thickness, rest.pop("error", 0.1)), **rest)[0].thickness.value


def test_one_size_within_two_standard_errors_is_taken():
    (found,) = snapped(board(17.81))
    assert found.thickness == Quantity(value=18.0, standard_error=0.1, origin=Origin.SNAPPED)


def test_a_size_beyond_two_standard_errors_is_not():
    start = board(17.79)
    assert snapped(start)[0] is start


def test_of_two_sizes_within_the_uncertainty_neither_is_taken():
    assert value(18.4, error=0.35) == 18.4
    assert value(18.4, error=0.35, sizes=(12.0, 18.0)) == 18.0


def test_no_thickness_is_known_better_than_a_plane():
    assert value(17.7) == 17.7
    assert value(17.7, noise=0.2) == 18.0


def test_the_scale_may_be_wrong_as_well():
    assert value(17.6) == 17.6
    assert value(17.6, scale_error=0.02) == 18.0


def test_the_size_of_the_object_has_no_say():
    """Ten times as large with the same errors: the same distance from stock is refused."""
    assert value(179.79, sizes=(180.0,)) == 179.79


def test_inferred_thickness_follows_but_is_never_measured_against_stock():
    guess = board(17.9, 5.0, Origin.INFERRED)
    alone = snapped(guess)[0]
    assert alone is guess
    both = snapped(board(17.9), guess)
    assert [s.thickness.value for s in both] == [18.0, 18.0]
    assert both[1].thickness.origin is Origin.INFERRED


@pytest.mark.parametrize(
    ("held", "bottom", "top"),
    [
        ((), 99.9, 117.9),
        (((0, "top"),), 99.9, 117.9),
        (((0, "bottom"),), 100.0, 118.0),
        (((0, "top"), (0, "bottom")), 99.9, 117.9),
        (((1, "bottom"),), 99.9, 117.9),
    ],
)
def test_the_face_that_boards_end_on_stays(held, bottom, top):
    found = snapped(board(17.9), board(12.0), held=held)[0]
    low = found.world_from_board[2, 3]
    assert (low, low + found.thickness.value) == pytest.approx((bottom, top), abs=1e-12)


@pytest.fixture(scope="module")
def shelves():
    """The shelf as measured (18 and 15 mm), and with stock of 18.5 and 14.7 mm, which it can be told to be of."""
    options = AssembleOptions(stock=Stock((14.7, 18.5)), stock_sigmas=6.0)
    return assemble(shelf_parts(), shelf_capture()), assemble(shelf_parts(), shelf_capture(), options)


def test_boards_still_end_on_each_other_when_all_are_of_another_thickness(shelves):
    _, stock = shelves
    assert sorted(s.thickness.value for s in stock.sheets) == pytest.approx([14.7, 14.7, 18.5])
    kinds = [[(c.type, c.a, c.b, c.face_a) for c in found.contacts] for found in shelves]
    assert kinds[0] == kinds[1] and len(kinds[0]) == 2
    sheets = {s.name: s for s in stock.sheets}
    for contact in stock.contacts:
        height = sheets[contact.a].to_board(np.array([contact.point]))[0, 2]
        assert height == pytest.approx(0.0 if contact.face_a == "bottom" else 18.5, abs=1e-9)
    for one, segments in zip(stock.sheets, stock.constraints, strict=True):
        for segment in (s for s in segments if s.origin == "contact"):
            ends = one.to_world(np.array([[*segment.start, segment.depth], [*segment.end, segment.depth]]))
            host = sheets[stock.contacts[segment.contact].a]
            assert host.to_board(ends)[:, 2] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_the_underside_that_the_uprights_hold_to_stays(shelves):
    low = [next(s for s in found.sheets if abs(s.normal[2]) > 0.99).world_from_board[2, 3] for found in shelves]
    assert low[0] == pytest.approx(low[1], abs=1e-9)


def test_stock_that_fits_nothing_changes_nothing(shelves):
    """Not even by running outlines on once more: that leaves slivers that no cut path fits."""
    other = assemble(shelf_parts(), shelf_capture(), AssembleOptions(stock=Stock((99.0,))))
    for one, same in zip(shelves[0].sheets, other.sheets, strict=True):
        assert one.region.equals(same.region) and one.thickness == same.thickness
        assert np.array_equal(one.world_from_board, same.world_from_board)
