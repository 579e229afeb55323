"""What is wrong with an option is told in one short line, whatever was typed."""

import pytest

from kerfwright.capture.markers import parse_markers
from kerfwright.capture.prepare import crop_options
from kerfwright.errors import OptionError
from kerfwright.scaling import parse_lengths
from kerfwright.stock import parse_stock


@pytest.mark.parametrize("text", ["a\nb", "x" * 9000, "\x1b[31m"])
@pytest.mark.parametrize("parse", [parse_markers, crop_options, parse_stock, lambda text: parse_lengths([text])])
def test_one_short_line(parse, text):
    with pytest.raises(OptionError) as caught:
        parse(text)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 400
