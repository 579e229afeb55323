"""The acceptance of curve fitting on a few of the synthetic outlines; benchmark_curves.py runs all."""

import sys
from pathlib import Path

import numpy as np
import pytest

from kerfwright.refine.curves import fit_curves

sys.path.insert(0, str(Path(__file__).parent))
from outlines import SHAPES, complaints, loop_nodes, make_outline, make_outlines


def test_generator_gives_the_same_outline_for_the_same_seed():
    a, b = make_outlines(3, 4), make_outlines(3, 4)
    assert all((x.loops[0].points == y.loops[0].points).all() and x.path == y.path for x, y in zip(a, b, strict=True))


def test_generated_noise_is_what_it_says():
    loop = make_outline("rectangle", np.random.default_rng(0)).loops[0]
    same = make_outline("rectangle", np.random.default_rng(0), noise=1e-9).loops[0]
    off = loop.points - same.points
    assert abs(np.sqrt((off**2).mean()) - 0.5) < 0.1
    assert abs((off * np.roll(off, 5, axis=0)).mean() / (off**2).mean() - np.exp(-1)) < 0.15


@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_nodes_and_kinds_are_right_in_most_outlines(shape):
    wrong, smooth = [], 0
    for seed in range(3):
        outline = make_outline(shape, np.random.default_rng([20, seed]))
        fit = fit_curves(outline.loops)
        wrong += complaints(outline.path, fit.path)[:1]
        smooth += sum(s for loop in (fit.path.outer, *fit.path.holes) for _, s in loop_nodes(loop))
        assert fit.chi2 < 1.6 * fit.observations
    assert len(wrong) <= 1, wrong
    assert (smooth > 0) == (shape in ("rounded_rectangle", "slot", "tray_end"))
