"""What the programs that exporters write have in common: how numbers, points and boards are called in Python."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable
from pathlib import Path

from kerfwright.errors import ExportError
from kerfwright.model import Model
from kerfwright.model.io import write_bytes
from kerfwright_exporters.naming import file_stems

__all__ = ["exact", "identifiers", "number", "point", "write_program"]


def write_program(model: Model, path: Path, lines: Iterable[str]) -> list[Path]:
    """Write a program's lines to a file.

    Raises
    ------
    ExportError
        If the model has no boards.
    """
    if not model.boards:
        raise ExportError(f"{path}: boards: none: a program needs at least one board")
    write_bytes(path, ("\n".join(lines) + "\n").encode("utf-8"))
    return [path]


def identifiers(model: Model) -> list[str]:
    """A Python name for every board, no two the same."""
    names: list[str] = []
    for stem in file_stems(model):
        name = re.sub(r"\W+", "_", stem).strip("_").lower() or "board"
        name = f"board_{name}" if not name[0].isalpha() or keyword.iskeyword(name) or name in _TAKEN else name
        count = 2
        while name in names:
            name, count = f"{name.rstrip('0123456789')}{count}", count + 1
        names.append(name)
    return names


# functions of every program, and in capitals its dimensions and tables
_TAKEN = frozenset(
    (
        "arc", "assembly", "behind", "bezier", "board", "circle", "close", "dataclass", "depth", "drawn", "factors",
        "height", "largest", "line", "off", "on", "squared", "stretched", "width", "wire",
    )
)  # fmt: skip


def number(value: float) -> str:
    """To a millionth of a micrometre, without trailing zeros."""
    text = f"{value:.9f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def point(values: Iterable[float]) -> str:
    """A tuple of lengths, mm."""
    return "(" + ", ".join(number(v) for v in values) + ")"


def exact(values: Iterable[float]) -> str:
    """A direction: all its digits, those of rounding taken off."""
    return "(" + ", ".join(repr(round(float(v), 15) + 0.0) for v in values) + ")"
