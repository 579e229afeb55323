"""What every reader needs: one-line errors, text of known encoding, and numbers that are checked."""

from __future__ import annotations

import math
from pathlib import Path

from kerfwright.errors import CaptureError, shown

__all__ = ["capture_error", "finite_float", "read_bytes", "read_lines", "shown", "whole_number"]


LONGEST_FIELD = 120  # signs; names of elements come from the file


def capture_error(path: Path | str, field: str, found: object, remedy: str) -> CaptureError:
    """The error for a field of a file: path, field, value found, what to do."""
    return CaptureError(f"{path}: {shown(field, LONGEST_FIELD)}: {shown(found)}: {remedy}")


def finite_float(text: str, path: Path, field: str) -> float:
    """A number with a decimal point.

    Raises
    ------
    CaptureError
        If the text is not a number, is infinite or NaN.
    """
    try:
        value = float(text)
    except ValueError:
        remedy = "use a decimal point, not a comma" if "," in text else "a number belongs here: export the file again"
        raise capture_error(path, field, text, remedy) from None
    if not math.isfinite(value):
        raise capture_error(path, field, text, "a finite number belongs here: export the file again")
    return value


def whole_number(text: str, path: Path, field: str, least: int = 0) -> int:
    """A whole number of at least `least`, in ASCII digits.

    Raises
    ------
    CaptureError
        If the text is anything else.
    """
    if not (text.isascii() and text.isdigit() and len(text) < 20) or int(text) < least:
        raise capture_error(
            path, field, text, f"a whole number of at least {least} belongs here: export the file again"
        )
    return int(text)


def read_bytes(path: Path) -> bytes:
    """All of a file.

    Raises
    ------
    CaptureError
        If the file cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise capture_error(path, "file", error.strerror, "check that it exists and can be read") from error


def read_lines(path: Path) -> list[str]:
    """The lines of a UTF-8 text file, with or without a byte order mark, whatever ends them.

    Raises
    ------
    CaptureError
        If the file cannot be read or is not UTF-8.
    """
    data = read_bytes(path)
    zero = data.find(b"\0")  # in no text, but in UTF-16 without a byte order mark
    if zero >= 0:
        raise capture_error(path, f"byte {zero}", data[zero : zero + 4], "save the file as UTF-8")
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    except UnicodeDecodeError as error:
        raise capture_error(
            path, f"byte {error.start}", data[error.start : error.start + 4], "save the file as UTF-8"
        ) from None
