"""Lengths and sizes as people write them: 6, 6mm, 0.25in, 1/4in, 2440x1220, 96x48in."""

from __future__ import annotations

import re
from fractions import Fraction

from kerfwright.errors import OptionError, shown

__all__ = ["length", "size"]

_NUMBER = r"(?:(\d+)[ -](?=\d+/))?(\d+/\d+|\d*\.?\d+)"
_LENGTH = re.compile(_NUMBER + r"\s*(mm|in|\")?")
_SIZE = re.compile(r"(.+?)(mm|in|\")?\s*[x\u00d7*]\s*(.+?)(mm|in|\")?")
_LONGEST = 1e6  # mm; a kilometre of board is a slip of the pen


def length(option: str, text: str) -> float:
    """Millimetres of a length; inches when it says so.

    Raises
    ------
    OptionError
        If it is none: one line with option, value and remedy.
    """
    found = _LENGTH.fullmatch(text.strip())
    try:
        value = float(Fraction(found[1] or 0) + Fraction(found[2])) if found else -1.0
    except ZeroDivisionError:
        value = -1.0
    value *= 25.4 if found and found[3] in ("in", '"') else 1.0
    if not 0 <= value <= _LONGEST:
        raise OptionError(f"{option}: {shown(text)!r}: not a length: write millimetres, as 6, or inches, as 1/4in")
    return value


def size(option: str, text: str) -> tuple[float, float]:
    """Length and width, mm.

    Raises
    ------
    OptionError
        If it is no size.
    """
    found = _SIZE.fullmatch(text.strip())
    if not found:
        raise OptionError(f"{option}: {shown(text)!r}: not a size: write length x width, as 2440x1220 or 96x48in")
    unit = found[4] or found[2] or ""
    return length(option, found[1] + (found[2] or unit)), length(option, found[3] + unit)
