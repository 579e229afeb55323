"""Turns between directions, and captures moved as a whole."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kerfwright.capture.frame import rotation_between

DIRECTIONS = st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 0.1)


def unit(v):
    return np.array(v) / np.linalg.norm(v)


def assert_smallest_turn(turn, source, target):
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1)
    np.testing.assert_allclose(turn @ source, target, atol=1e-12)
    assert np.trace(turn) == pytest.approx(1 + 2 * source @ target, abs=1e-9)  # of a turn by the angle between them


@given(DIRECTIONS, DIRECTIONS)
def test_rotation_between(a, b):
    assert_smallest_turn(rotation_between(unit(a), unit(b)), unit(a), unit(b))


@pytest.mark.parametrize("off", [0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("sign", [1, -1])
def test_nearly_the_same_and_nearly_opposite(off, sign):
    source = unit([off, -0.5 * off, sign])
    assert_smallest_turn(rotation_between(source, np.array([0.0, 0.0, 1.0])), source, np.array([0.0, 0.0, 1.0]))
