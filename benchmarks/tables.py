"""Markdown tables, and numbers with their change."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["changed", "markdown", "ratio"]


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose first column is text and whose others are aligned right."""
    lines = [list(header), ["---", *["---:"] * (len(header) - 1)], *map(list, rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def changed(value: float | None, before: float | None, digits: int, least: float = 0.0) -> str:
    """A number, and in brackets how it moved since the last recorded run, if by more than `least`."""
    if value is None:
        return "-"
    text = f"{value:.{digits}f}"
    if before is None or abs(value - before) <= max(least, 0.5 * 10**-digits):
        return text
    return f"{text} ({value - before:+.{digits}f})"


def ratio(right: int | None, whole: int | None, before: int | None = None) -> str:
    """right/whole, with the change of right."""
    if right is None:
        return "-"
    return f"{right}/{whole}" + (f" ({right - before:+d})" if before is not None and before != right else "")
