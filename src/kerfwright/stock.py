"""Thicknesses that boards are sold in, and which of them `--stock` means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from kerfwright.errors import OptionError, shown
from kerfwright.lengths import length
from kerfwright.model import Board, Finding, Origin, Scale

__all__ = ["INCH", "METRIC", "StockSize", "labelled", "parse_stock", "scale_is_known", "unsnapped_findings"]

# Plywood, MDF, chipboard and glued panels as shops list them, then sawn and planed softwood (EN 1313-1's preferred
# thicknesses and what planing leaves of them).
_METRIC_SHEET = (3, 4, 5, 6, 6.5, 8, 9, 10, 12, 15, 16, 18, 19, 21, 22, 24, 25, 27, 28, 30, 35, 38, 40)
_METRIC_SAWN = (16, 19, 20, 22, 24, 25, 32, 38, 44, 45, 47, 48, 50, 60, 63, 70, 75, 100)
# Panels by name, sheathing by the thickness that it has (PS 1), then dressed lumber: 1x, 5/4, 2x, 4x (PS 20).
_INCH_SHEET = ("1/8", "7/32", "1/4", "11/32", "3/8", "15/32", "1/2", "19/32", "5/8", "23/32", "3/4", "1", "9/8")
_INCH_SAWN = ("3/4", "1", "3/2", "7/2")

LARGEST = 300.0  # mm; thicker is no board
SAME = 1e-6  # mm; thicknesses that were made one differ by rounding only


@dataclass(frozen=True)
class StockSize:
    """A thickness in mm, and what it is called."""

    label: str
    value: float


def _inches(text: str) -> StockSize:
    value = Fraction(text)
    whole, rest = divmod(value, 1)
    words = [str(whole)] * (whole > 0) + [str(rest)] * (rest > 0)
    return StockSize(f"{' '.join(words)} in", float(value * Fraction(254, 10)))


def _sorted(sizes: Sequence[StockSize]) -> tuple[StockSize, ...]:
    """By thickness; of two names for one thickness the first."""
    found: dict[float, StockSize] = {}
    for size in sizes:
        found.setdefault(round(size.value, 6), size)
    return tuple(found[key] for key in sorted(found))


METRIC = _sorted([StockSize(f"{t:g} mm", float(t)) for t in _METRIC_SHEET + _METRIC_SAWN])
INCH = _sorted([_inches(t) for t in _INCH_SHEET + _INCH_SAWN])
_TABLES = {"metric": METRIC, "inch": INCH}


def parse_stock(text: str) -> tuple[StockSize, ...]:
    """Sizes by thickness, from `metric`, `inch`, thicknesses such as `12,18,1/2in`, or a list of both; empty from "".

    Raises
    ------
    OptionError
        If an item is neither a table nor a thickness.
    """
    if not text:
        return ()
    return _sorted([size for item in text.split(",") for size in _parsed(item.strip())])


def _parsed(item: str) -> tuple[StockSize, ...]:
    if item in _TABLES:
        return _TABLES[item]
    try:
        value = length("--stock", item)
    except OptionError:
        value = 0.0
    if not 0 < value <= LARGEST:
        raise OptionError(
            f"--stock: {shown(item)!r}: neither a table nor a thickness: give metric, inch, or thicknesses "
            "as 12,18,1/2in"
        )
    label = item if item[-1] in 'mn"' else f"{item} mm"
    return (StockSize(label, value),)


def scale_is_known(scale: Scale, lengths: str) -> bool:
    """Whether millimetres are millimetres: not where a unit was assumed, nor where stock itself gave the scale."""
    return bool(lengths) or scale.origin in ("given", "file", "measured")


def labelled(boards: Sequence[Board], sizes: Sequence[StockSize]) -> tuple[Board, ...]:
    """The boards, those snapped to a stock size with its name and exactly its thickness.

    Boards of inferred thickness that follow a snapped one get the same number, but no name: nothing showed it.
    """
    stock = {b.thickness.value: _nearest(b, sizes) for b in boards if b.thickness.origin is Origin.SNAPPED}
    return tuple(_labelled(board, stock) for board in boards)


def _nearest(board: Board, sizes: Sequence[StockSize]) -> StockSize:
    return min(sizes, key=lambda size: abs(size.value - board.thickness.value))


def _labelled(board: Board, stock: dict[float, StockSize]) -> Board:
    size = next((s for t, s in stock.items() if abs(t - board.thickness.value) < SAME), None)
    if size is None:
        return board
    thickness = board.thickness.model_copy(update={"value": size.value})
    label = size.label if thickness.origin is Origin.SNAPPED else None
    return board.model_copy(update={"thickness": thickness, "stock": label})


def unsnapped_findings(boards: Sequence[Board], sizes: Sequence[StockSize], known: bool) -> tuple[Finding, ...]:
    """What somebody who asked for stock should know of the boards that are not of it."""
    if not sizes:
        return ()
    if not known:
        message = "the scale is not known: no thickness was compared with stock"
        return (_finding("warning", message, "give --scale, --length or --markers"),)
    left: dict[str, list[str]] = {}
    for board in boards:
        if board.thickness.origin in (Origin.MEASURED, Origin.SHARED):
            error = board.thickness.standard_error
            told = f"{board.thickness.value:.2f} mm" + (f" ± {error:.2f}" if error is not None else "")
            left.setdefault(told, []).append(board.name)
    return tuple(
        _finding("info", f"{told} is not of one stock size beyond doubt and stays as measured: {', '.join(names)}",
                 "measure the boards; or give --stock the sizes that they can have", tuple(names))
        for told, names in left.items()
    )  # fmt: skip


def _finding(severity: str, message: str, remedy: str, boards: tuple[str, ...] = ()) -> Finding:
    return Finding(code="K005", severity=severity, message=message, remedy=remedy, boards=boards)
