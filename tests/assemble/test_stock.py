import pytest

from clouds import pose, sheet
from kerfwright.assemble import AssembleOptions
from kerfwright.assemble.stock import share_thickness
from kerfwright.model import Origin, Quantity

D = 500.0


def board(thickness: float, error: float = 0.2, area: float = 1e4, seen: bool = True, at: float = 0.0, origin=None):
    quantity = Quantity(value=thickness, standard_error=error, origin=origin or Origin.MEASURED)
    return sheet("b", pose((0, 0, at)), thickness, (0, 0, area / 100, 100), quantity=quantity, thickness_seen=seen)


def shared(*boards):
    return share_thickness(boards, D, AssembleOptions())


def values(*boards) -> list[float]:
    return [s.thickness.value for s in shared(*boards)]


def test_twelve_and_eighteen_stay_apart():
    """A threshold of D/30 would be 17 mm here (method.md, trap 13)."""
    found = values(board(12.1), board(17.8), board(11.9), board(18.2))
    assert found == pytest.approx([12.0, 18.0, 12.0, 18.0])


def test_boards_of_one_stock_get_one_mean_nearer_to_the_surer():
    found = shared(board(18.0, error=0.1), board(19.0, error=0.5))
    assert found[0].thickness == found[1].thickness
    assert 18.0 < found[0].thickness.value < 18.5
    assert found[0].thickness.origin is Origin.SHARED


def test_one_board_measured_badly_does_not_move_the_others():
    """A weighted mean would be 18.2."""
    found = shared(*(board(18.0 + d) for d in (0.0, 0.02, -0.02, 0.0)), board(19.0))
    assert found[4].thickness.value == pytest.approx(18.0, abs=0.1)


def test_a_board_alone_keeps_what_was_measured():
    found = shared(board(12.0), board(18.0))
    assert [s.thickness.origin for s in found] == [Origin.MEASURED, Origin.MEASURED]


def test_an_unseen_thickness_becomes_the_one_most_wood_has():
    found = shared(board(12.0), board(12.1), board(18.0, area=9e4), board(30.0, seen=False))
    assert found[3].thickness.value == pytest.approx(18.0)
    assert found[3].thickness.origin is Origin.INFERRED
    assert found[3].thickness.standard_error > 1.0


def test_a_twin_is_of_the_stock_that_its_twin_is_of():
    found = shared(board(12.0), board(12.2), board(18.0, area=9e4), board(12.4, seen=False, origin=Origin.SHARED))
    assert found[3].thickness.value == found[0].thickness.value
    assert found[3].thickness.origin is Origin.SHARED


def test_an_unseen_thickness_pulls_nothing():
    assert values(board(18.0), board(18.4, seen=False)) == pytest.approx([18.0, 18.0])


def test_nothing_seen_changes_nothing():
    assert values(board(30.0, seen=False), board(20.0, seen=False)) == [30.0, 20.0]


def test_the_top_sheet_plane_stays_and_the_bottom_follows():
    high, low = shared(board(18.4, at=100.0), board(17.6, at=50.0))
    assert high.world_from_board[2, 3] + high.thickness.value == pytest.approx(118.4)
    assert low.world_from_board[2, 3] + low.thickness.value == pytest.approx(67.6)


def test_order_of_the_boards_does_not_matter():
    boards = [board(t) for t in (12.3, 18.3, 17.7, 11.8, 18.0, 25.0)]
    forward, backward = values(*boards), values(*boards[::-1])
    assert forward == pytest.approx(backward[::-1])
