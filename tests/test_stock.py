"""Thicknesses that are sold: tables, what --stock may say, and what is told of boards that are of none."""

import pytest

from kerfwright.errors import OptionError
from kerfwright.model import Origin, Quantity, Scale
from kerfwright.stock import INCH, METRIC, labelled, parse_stock, scale_is_known, unsnapped_findings
from simple import board, rectangle


def measured(value: float, origin: Origin, name: str = "board", error: float | None = 0.2):
    made = board(rectangle(100, 50), name)
    return made.model_copy(update={"thickness": Quantity(value=value, standard_error=error, origin=origin)})


def test_the_tables_hold_what_shops_sell_once_each():
    metric, inch = ({size.label: size.value for size in table} for table in (METRIC, INCH))
    assert {"12 mm", "18 mm", "19 mm", "38 mm"} <= set(metric)
    assert (inch["1/2 in"], inch["3/4 in"], inch["23/32 in"]) == pytest.approx((12.7, 19.05, 18.25625))
    assert inch["1 1/8 in"] == pytest.approx(28.575) and inch["1 1/2 in"] == pytest.approx(38.1)
    for table in (METRIC, INCH):
        values = [size.value for size in table]
        assert values == sorted(set(values))


def test_own_thicknesses_in_either_unit_and_with_a_table():
    assert [(s.label, s.value) for s in parse_stock("18, 12mm,1/2in")] == [
        ("12mm", 12.0), ("1/2in", pytest.approx(12.7)), ("18 mm", 18.0),
    ]  # fmt: skip
    assert parse_stock("metric") == METRIC
    assert {s.value for s in parse_stock("metric,17.3")} == {s.value for s in METRIC} | {17.3}
    assert parse_stock("") == ()


@pytest.mark.parametrize("text", ["imperial", "12,", "0", "12;18", "-3", "301", "1/0in", "metric inch"])
def test_what_is_no_stock_is_refused(text):
    with pytest.raises(OptionError, match=r"^--stock: .*neither a table nor a thickness: give metric, inch"):
        parse_stock(text)


def test_a_scale_that_was_guessed_is_not_known():
    known = {origin: scale_is_known(Scale(millimetres_per_unit=1, origin=origin), "")
             for origin in ("assumed", "inferred", "given", "file", "measured")}
    assert known == {"assumed": False, "inferred": False, "given": True, "file": True, "measured": True}
    assert scale_is_known(Scale(millimetres_per_unit=1, origin="assumed"), "top:x=4mm")


def test_snapped_boards_get_the_name_and_the_very_number():
    near = {18 + 1e-12: Origin.SNAPPED, 18 - 1e-12: Origin.INFERRED, 12.2: Origin.SHARED}
    boards = [measured(value, origin) for value, origin in near.items()]
    snapped, follows, other = labelled(boards, METRIC)
    assert (snapped.thickness.value, snapped.stock, snapped.thickness.origin) == (18.0, "18 mm", Origin.SNAPPED)
    assert (follows.thickness.value, follows.stock, follows.thickness.origin) == (18.0, None, Origin.INFERRED)
    assert other == boards[2]


def test_boards_that_stay_as_measured_are_told():
    shared = [measured(12.4, Origin.SHARED, name) for name in "bc"]
    boards = [measured(18.0, Origin.SNAPPED, "a"), *shared, measured(18.0, Origin.INFERRED, "d")]
    (told,) = unsnapped_findings(boards, METRIC, known=True)
    assert (told.code, told.severity, told.boards) == ("K005", "info", ("b", "c"))
    assert "12.40 mm ± 0.20" in told.message
    (told,) = unsnapped_findings(boards, METRIC, known=False)
    assert told.severity == "warning" and "scale is not known" in told.message and "--length" in told.remedy
    assert unsnapped_findings(boards, (), known=False) == ()
