"""The report's boards: one card a kind, with its drawing and what is known of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from kerfwright.model import Board, Model
from kerfwright.report.drawing import board_svg
from kerfwright.report.figures import board_size

__all__ = ["boards_section"]

Colour = tuple[float, float, float]

_OUTLINES = {"images": "photographs", "cloud": "cloud", "inferred": "inferred"}


def boards_section(model: Model, colours: Sequence[Colour]) -> str:
    """One card a kind of board: repeats are cut from one drawing."""
    groups: dict[str, list[int]] = {}
    for k, board in enumerate(model.boards):
        groups.setdefault(board.same_as or board.name, []).append(k)
    cards = [_card(model.boards, members, colours) for members in groups.values()]
    return f'<h2>Boards</h2><div class="cards">{"".join(cards)}</div>'


def _card(boards: Sequence[Board], members: list[int], colours: Sequence[Colour]) -> str:
    first = boards[members[0]]
    red, green, blue = (round(255 * c) for c in colours[members[0]])
    rows = "".join(f"<dt>{term}</dt><dd>{escape(text)}</dd>" for term, text in _facts(boards, members))
    names = ", ".join(boards[k].name for k in members)
    return (
        f'<div class="card" data-board="{" ".join(map(str, members))}">'
        f'<h3><span class="swatch" style="background:rgb({red},{green},{blue})"></span>{escape(names)}</h3>'
        f"{board_svg(first)}<dl>{rows}</dl></div>"
    )


def _facts(boards: Sequence[Board], members: list[int]) -> Iterable[tuple[str, str]]:
    board = boards[members[0]]
    length, width = board_size(board)
    mirrored = sum(boards[k].mirrored for k in members)
    yield "quantity", f"{len(members)}" + (f", {mirrored} of them turned over" if mirrored else "")
    yield "size", f"{length:.1f} × {width:.1f} mm"
    thickness = board.thickness
    yield "thickness", f"{thickness.value:.2f} mm{_error(thickness.standard_error)}, {thickness.origin.value}"
    if board.stock:
        yield "stock", board.stock
    yield "outline from", _OUTLINES[board.outline_origin]
    yield "points", f"{sum(boards[k].points for k in members)} of the cloud"
    if board.bevels:
        yield "bevels", ", ".join(f"{b.angle.value:+.1f}°{_error(b.angle.standard_error, '°')}" for b in board.bevels)
    for note in board.notes:
        yield "note", note


def _error(standard_error: float | None, unit: str = "") -> str:
    return "" if standard_error is None else f" ± {standard_error:.2g}{unit}"
