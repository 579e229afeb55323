"""The same bytes from every run, although OCCT's booleans and imports leave rounding noise that differs.

OCCT keeps shapes in tables ordered by memory address, so that sums come in another order each time: what should be 0 is
now 7.1054e-15 and now 7.1012e-15. Nothing that small is geometry.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

__all__ = ["NOISE", "without_noise", "wrapped_records"]

NOISE = 1e-12  # mm, or of a direction; a thousandth of the diameter of an atom
_TINY = re.compile(r"(?<![\w.#'])(?:-?\d+\.?\d*[eE]-(?:1[3-9]|[2-9]\d|\d{3})(?!\w)|-0\.?(?![\w.]))")
_WIDTH = 78


def without_noise(text: str, zero: str) -> str:
    """Minus zero, and numbers in exponential form below NOISE, replaced by a format's way to write 0."""
    return _TINY.sub(zero, text)


def wrapped_records(text: str) -> str:
    """A STEP file's records broken at commas only, whatever the length of the numbers that were there before."""
    joined = re.sub(r"\n[ \t]+", "", text)
    return "\n".join(part for line in joined.split("\n") for part in _wrapped(line))


def _wrapped(line: str) -> Iterator[str]:
    """Lines of at most _WIDTH characters where strings allow it."""
    pieces = re.findall(r"(?:'[^']*'|[^',])+,?|,", line) if len(line) > _WIDTH else [line]
    current = ""
    for piece in pieces:
        if current and len(current) + len(piece) > _WIDTH:
            yield current
            current = " "
        current += piece
    yield current
