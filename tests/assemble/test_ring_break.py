"""A step of tone among year rings, on made profiles."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from kerfwright.assemble.ring_break import REACH, step_evidence

COUNT, JOINT = 500, 260
LATE = np.array([0.05, 0.06, 0.08])  # of a ring, darker
REDDER = np.array([0.004, -0.002, -0.012])


def rings(seed: int, step: float) -> np.ndarray:
    """(U, 3) profile of two boards whose rings do not meet, the second redder by `step`; as blurred as a photograph."""
    rng = np.random.default_rng(seed)
    out = np.zeros((COUNT, 3))
    for part in (slice(0, JOINT), slice(JOINT, COUNT)):
        turns = np.cumsum(rng.uniform(0.9, 1.1, COUNT)) / rng.uniform(7, 10) + rng.random()
        out[part] = -(turns[part, None] % 1) ** 2 * LATE
    out[JOINT:] += step * REDDER
    return gaussian_filter1d(out, 1.0, axis=0) + 0.0005 * rng.standard_normal((COUNT, 3))


@pytest.mark.parametrize("seed", range(6))
def test_a_step_lies_where_it_breaks_the_rings(seed):
    evidence = step_evidence(rings(seed, 0.5))
    near = slice(JOINT - 12, JOINT + 13)
    assert abs(int(evidence[near].argmax()) - 12) <= 2
    assert evidence[near].max() > 3 * evidence[near].mean()


def test_broader_windows_put_some_of_them_a_ring_off():
    """What the other tests are about: means over 16 samples to either side are moved by rings."""
    off = []
    for seed in range(6):
        profile = rings(seed, 0.5) @ REDDER
        steps = [profile[k + 1 : k + 17].mean() - profile[k - 16 : k].mean() for k in range(JOINT - 12, JOINT + 13)]
        off.append(abs(int(np.argmax(steps)) - 12))
    assert sorted(off)[-3] >= 4


def test_a_greater_step_is_more_evident():
    small, great = (step_evidence(rings(0, step))[JOINT - 3 : JOINT + 4].max() for step in (1.0, 4.0))
    assert great > 4 * small


def test_what_is_unseen_makes_no_step():
    whole = rings(1, 1.0)
    torn = whole.copy()
    torn[100:106] = torn[:20] = torn[-30:] = np.nan
    evidence = step_evidence(torn)
    assert np.isfinite(evidence).all() and not evidence[: 20 + REACH].any() and not evidence[-30 - REACH :].any()
    assert evidence[90:117].max() < 0.5 * evidence[JOINT - 3 : JOINT + 4].max()
    assert abs(int(evidence[JOINT - 12 : JOINT + 13].argmax()) - 12) <= 2


@pytest.mark.parametrize("seen", [0, 40])
def test_too_little_tells_nothing(seen):
    profile = np.full((COUNT, 3), np.nan)
    profile[:seen] = 0.0
    assert not step_evidence(profile).any()


def test_an_even_face_tells_nothing():
    assert not step_evidence(np.zeros((COUNT, 3))).any()
