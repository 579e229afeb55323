"""Lengths and sizes on the command line."""

import pytest

from kerfwright.errors import OptionError
from kerfwright.lengths import length, size


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("6", 6),
        ("6mm", 6),
        ("6.35 mm", 6.35),
        (".5", 0.5),
        ("1/4in", 6.35),
        ('1 1/2"', 38.1),
        ("1-1/2in", 38.1),
        ("0", 0),
    ],
)
def test_lengths(text, value):
    assert length("--tool", text) == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2440x1220", (2440, 1220)),
        ("96x48in", (2438.4, 1219.2)),
        ('96" x 48"', (2438.4, 1219.2)),
        ("60in × 1525mm", (1524, 1525)),
    ],
)
def test_sizes(text, value):
    assert size("--sheet", text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["", "six", "-3", "1/0in", "nan", "inf", "1e9", "6cm", "6 7"])
def test_what_is_no_length(text):
    with pytest.raises(OptionError, match=r"^--tool: .*: not a length: write millimetres"):
        length("--tool", text)


@pytest.mark.parametrize("text", ["", "2440", "x", "2440x", "axb", "1x2x3"])
def test_what_is_no_size(text):
    with pytest.raises(OptionError, match=r"^--sheet: .*: not a (size|length)"):
        size("--sheet", text)
