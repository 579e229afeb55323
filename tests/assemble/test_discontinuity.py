"""Where the wood of a face changes along a straight line: made strips, and strips read from made photographs."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from clouds import sheet
from kerfwright.assemble.discontinuity import discontinuity
from kerfwright.assemble.splits import LEAST_STRENGTH, SeamSearch, find_seam_lines
from kerfwright.assemble.texture import FaceStrips, face_strips

OFFSETS, MIDDLES, SEAM = np.arange(300) * 0.5, np.arange(60) * 6.0, 140
BOARD = sheet("board", np.eye(4), 18.0, (0, 0, 360, 150))


def grain(seed: int = 0, views: int = 5) -> np.ndarray:
    """(views, U, C, 3) wavy lines of a few samples' width, and a little noise of every view's own."""
    rng = np.random.default_rng(seed)
    wander = 30 * gaussian_filter(rng.standard_normal((300, 60)), 8)
    waves = 0.08 * np.sin(2 * np.pi * (np.arange(300)[:, None] + 8 * wander) / 9)
    noise = 0.004 * rng.standard_normal((views, 300, 60, 3))
    return gaussian_filter(waves, (1.5, 0))[None, ..., None] * [1.0, 1.2, 1.5] + noise


def with_step(colours: np.ndarray, lean: float = 0.0, upto: int = 60, steep: float = 1) -> np.ndarray:
    """The same with the wood beyond the seam a little darker and redder; `lean` samples from strip to strip."""
    out = colours.copy()
    for c in range(upto):
        out[:, SEAM + round(lean * (c - 30)) :, c] -= steep * np.array([0.03, 0.045, 0.05])
    return out


def change(colours: np.ndarray):
    return discontinuity(FaceStrips(OFFSETS, MIDDLES, colours))


def strongest(found) -> int:
    return int(np.nanargmax(found.strength))


def test_a_step_of_colour_stands_out_from_grain():
    found = change(with_step(grain()))
    assert abs(strongest(found) - SEAM) <= 2
    assert found.strength[strongest(found)] > 2 * LEAST_STRENGTH
    assert found.along(strongest(found)) > 0.6
    assert min(found.views(strongest(found))) > 0.6


@pytest.mark.parametrize("seed", range(3))
def test_grain_alone_does_not(seed):
    assert np.nanmax(change(grain(seed)).strength) < LEAST_STRENGTH


def test_a_line_that_ends_half_way_is_told_by_its_thirds():
    found = change(with_step(grain(), upto=36))
    assert found.along(SEAM) < 0.5


def test_a_slot_that_ends_before_the_rim_is_broken():
    colours = grain()
    colours[:, SEAM : SEAM + 8, 10:-10] -= 0.3
    found = change(colours)
    assert found.strength[strongest(found)] > LEAST_STRENGTH
    assert not found.unbroken(strongest(found))
    assert change(with_step(grain())).unbroken(SEAM)


def test_an_outline_that_is_a_little_turned_does_not_hide_a_seam():
    assert abs(strongest(change(with_step(grain(), lean=4 / 60, steep=2))) - SEAM) <= 2


def test_what_was_hardly_seen_tells_nothing():
    colours = grain()
    colours[:, :, 5:] = np.nan
    assert change(colours) is None


def made_photos(shade) -> SimpleNamespace:
    """Five cameras whose pixels are a level board's millimetres; shade (x, y) gives grey levels."""

    def project(x):
        return x[:, :2], np.ones(len(x))

    def colours(k, places):
        noise = np.random.default_rng(k).normal(0, 1.0, places.shape)
        return (shade(places[..., 0], places[..., 1])[..., None] + noise).astype(np.float32)

    views = [SimpleNamespace(centre=np.array([180.0, 75 + 20 * k, 900.0]), project=project) for k in range(5)]
    return SimpleNamespace(views=views, colours=colours)


class Nothing:
    """No obstacles, and cameras above."""

    def visible(self, views, places, outward, grazing=0.2):
        return np.full((len(views), len(places)), outward[2] > 0)


def wood(x, y):
    return 120 + 8 * np.sin((y + 6 * np.sin(x / 40) + 3 * np.sin(x / 17 + y / 9)) * 1.3)


def test_strips_know_only_what_lies_inside_and_is_seen():
    strips = face_strips(BOARD, np.array([0.0, 1.0]), "top", made_photos(wood), Nothing(), 500.0)
    assert strips.colours.shape == (5, 300, 60, 3)
    assert np.isnan(strips.colours[:, :5]).all()
    assert np.isfinite(strips.colours[:, 20:-20, 5:-5]).all()
    assert face_strips(BOARD, np.array([0.0, 1.0]), "bottom", made_photos(wood), Nothing(), 500.0) is None


def test_a_board_of_two_is_split_where_they_meet_and_a_whole_one_is_not():
    def glued(x, y):
        return np.where(y < 70, wood(x, y), wood(x + 500, y + 321) * 0.93)

    found = find_seam_lines(SeamSearch(BOARD, [], made_photos(glued), Nothing(), 500.0))
    assert [s.offset * s.m[1] for s in found] == [pytest.approx(70, abs=1.0)]
    assert not find_seam_lines(SeamSearch(BOARD, [], made_photos(wood), Nothing(), 500.0))


def test_lines_in_which_another_board_stands_are_no_seams():
    def glued(x, y):
        return np.where(y < 70, wood(x, y), wood(x + 500, y + 321) * 0.93)

    shelf = sheet("shelf", np.eye(4)[[0, 2, 1, 3]] * [[1], [-1], [1], [1]], 18.0, (0, 18, 360, 200))
    shelf.world_from_board[:3, 3] = 0, 70, 0
    assert not find_seam_lines(SeamSearch(BOARD, [shelf], made_photos(glued), Nothing(), 500.0))
