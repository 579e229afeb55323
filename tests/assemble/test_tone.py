"""Steps of tone along a straight line, on made strips: grain, and what is no joint."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from kerfwright.assemble.splits import LEAST_STRENGTH
from kerfwright.assemble.texture import STRIP, FaceStrips
from kerfwright.assemble.tone import ToneSteps, _unrest, runs_along_grain, tone_steps

COUNT, STRIPS, SEAM = 400, 80, 210
REDDER = np.array([0.002, -0.001, -0.006])  # less than a grey level


def board(seed: int = 0) -> np.ndarray:
    """(5, U, C, 3) wandering lines of grain, all of one hue, and noise of every view's own."""
    rng = np.random.default_rng(seed)
    wander = 60 * gaussian_filter(rng.standard_normal((COUNT, STRIPS)), 12)
    lines = 0.06 * np.sin(2 * np.pi * (np.arange(COUNT)[:, None] + 8 * wander) / 9)
    noise = 0.006 * rng.standard_normal((5, COUNT, STRIPS, 3))
    return lines[None, ..., None] * [1.0, 1.2, 1.5] + noise


def with_tone(share: np.ndarray, seed: int = 0) -> np.ndarray:
    """A board redder by a share that is a function of offset (U,), or of offset and strip (U, C)."""
    share = np.broadcast_to(share.reshape(COUNT, -1), (COUNT, STRIPS))
    return board(seed) + share[None, ..., None] * REDDER


def measured(colours: np.ndarray) -> tuple[ToneSteps, int]:
    found = tone_steps(FaceStrips(np.arange(COUNT) * 0.5, np.arange(STRIPS) * 6.0, colours))
    inner = np.where((np.arange(COUNT) > 60) & (np.arange(COUNT) < COUNT - 60), np.nan_to_num(found.strength), 0)
    return found, int(inner.argmax())


def stands(colours: np.ndarray) -> bool:
    found, k = measured(colours)
    return found.strength[k] > LEAST_STRENGTH and found.along(k) > 0.5 and found.unbroken(k)


U = np.arange(COUNT).astype(float)
JOINT = (U >= SEAM).astype(float)


@pytest.mark.parametrize("seed", range(3))
def test_a_board_of_another_hue_begins_at_its_joint(seed):
    colours = with_tone(JOINT, seed)
    found, k = measured(colours)
    assert stands(colours)
    assert found.located(k) == pytest.approx(0.5 * SEAM, abs=1.0)
    assert min(found.views(k)) > 0.6


@pytest.mark.parametrize("seed", range(3))
def test_grain_of_one_hue_has_no_step(seed):
    assert not stands(board(seed))


def test_a_soft_shadow_is_not_sudden():
    assert not stands(with_tone(np.clip((U - SEAM) / 44 + 0.5, 0, 1)))


def test_a_soft_shadow_is_told_from_a_joint_and_from_nothing():
    shadow, joint, nothing = (with_tone(s) for s in (np.clip((U - SEAM) / 44 + 0.5, 0, 1), JOINT, 0 * JOINT))
    assert [measured(c)[0].slopes(0.5 * SEAM) for c in (shadow, joint, nothing)] == [True, False, False]


def test_a_band_of_late_wood_does_not_last():
    band = (U >= SEAM) & (U < SEAM + 36)
    assert stands(with_tone(JOINT)) and not stands(with_tone(band.astype(float)))


def test_a_border_that_slants_is_no_joint():
    slanted = U[:, None] >= SEAM + np.linspace(-60, 60, STRIPS)
    assert not stands(with_tone(slanted.astype(float)))


def test_a_step_that_two_eighths_lack_is_no_joint():
    shares = np.ones(STRIPS)
    shares[5:14] = shares[41:50] = -0.1
    step = JOINT[:, None, None] * REDDER
    found, whole = (measured(0.05 * board() + step * s[:, None])[0] for s in (shares, np.ones(STRIPS)))
    assert found.along(SEAM) > 0.5 and not found.unbroken(SEAM)
    assert whole.unbroken(SEAM)


def test_a_step_that_varies_along_the_line_counts_for_less():
    shares = np.where(np.arange(STRIPS) // 10 % 2, 0.2, 1.8)
    varied, even = (measured(with_tone(JOINT[:, None] * s))[0] for s in (shares, np.ones(STRIPS)))
    assert varied.strength[SEAM] < 0.5 * even.strength[SEAM]


def test_smears_of_jpeg_do_not_hide_a_joint():
    assert stands(with_tone(gaussian_filter1d(JOINT, 3)))


def test_a_joint_told_by_its_broad_windows_lies_where_a_line_does():
    colours = with_tone(gaussian_filter1d(JOINT, 3))
    strips = FaceStrips(U * 0.5, np.arange(STRIPS) * 6.0, colours)
    lines = np.where(np.abs(U - SEAM - 6) < 2, 60.0, 1.0)
    plain, lined = tone_steps(strips), tone_steps(strips, lines)
    assert plain.located(SEAM) == pytest.approx(0.5 * SEAM, abs=1.0)
    assert lined.located(SEAM) > plain.located(SEAM) + 1
    assert lined.around(SEAM) == (SEAM, round(2 * lined.located(SEAM)))


def test_a_step_counts_for_less_among_restless_wood():
    """The same joint, and hue that comes and goes, once far from the joint and once beside it."""
    rng = np.random.default_rng(5)
    hue = 0.4 * gaussian_filter1d(rng.standard_normal(COUNT), 6)
    hue /= hue.std()
    apart = np.abs(U - SEAM)
    near, far = (0.5 * hue * where for where in ((apart > 40) & (apart < 110), (apart > 110)))
    beside, away = (measured(with_tone(JOINT + h))[0].strength[SEAM] for h in (near, far))
    assert beside < 0.8 * away


def test_unrest_is_what_both_sides_have():
    strength = np.where(U < 200, 1.0, 5.0)
    unrest = _unrest(strength)
    usual = np.median(strength)
    assert unrest[20] == pytest.approx(1 / usual) and unrest[380] == pytest.approx(5 / usual)
    assert unrest[199] == pytest.approx(3 / usual, rel=0.05)
    assert _unrest(np.where(U < 200, 1.0, np.nan))[180] == pytest.approx(1)  # only one side is seen


def test_tone_is_asked_for_along_the_grain_only():
    colours = board()
    strips = FaceStrips(U * 0.5, np.arange(STRIPS) * 6.0, colours)
    coarse = colours[:, : 33 * STRIP].reshape(5, 33, STRIP, STRIPS, 3).mean(axis=2)  # as strips that lie across it
    fine = np.repeat(coarse.swapaxes(1, 2), STRIP, axis=1)
    turned = FaceStrips(np.arange(STRIP * STRIPS) * 0.5, np.arange(33) * 6.0, fine)
    assert runs_along_grain(strips) and not runs_along_grain(turned)


def test_what_was_hardly_seen_tells_nothing():
    colours = board()
    colours[:, :, 5:] = np.nan
    assert tone_steps(FaceStrips(U, np.arange(STRIPS) * 6.0, colours)) is None
