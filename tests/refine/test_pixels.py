"""Compiled loops against the same in NumPy."""

import numpy as np
import pytest

from kerfwright.capture.camera import Camera
from kerfwright.refine.segment._pixels import (
    ALONG,
    STEEPEST,
    add_contrast,
    add_seen,
    apart_from_others,
    channel_medians,
    disagreement_of,
    nearest_centres,
    rectified,
)

SHAPE = (17, 23)


@pytest.fixture
def rng():
    return np.random.default_rng(3)


@pytest.fixture
def labs(rng):
    return rng.normal(50, 10, (5, *SHAPE, 3)).astype(np.float32)


@pytest.fixture
def seen(rng):
    return rng.random((5, *SHAPE)) < 0.7


@pytest.mark.parametrize("count", [0, 1, 2, 7, 100])
def test_medians_are_those_inside_the_mask(rng, count):
    image = rng.integers(0, 256, (*SHAPE, 3)).astype(np.uint8)
    mask = np.zeros(SHAPE, bool)
    mask.flat[rng.choice(mask.size, count, replace=False)] = True
    expected = np.median(image[mask], axis=0) if count else np.full(3, np.nan)
    assert channel_medians(image, mask) == pytest.approx(expected, nan_ok=True)


def test_contrast_compares_neighbours_with_those_inside(labs, rng):
    lab, shown, inside = labs[0], rng.random(SHAPE) < 0.8, rng.random(SHAPE) < 0.3
    steps = np.zeros((4, *SHAPE))
    for k, (down, right) in enumerate(ALONG):
        for i in range(SHAPE[0] - down):
            for j in range(max(0, -right), SHAPE[1] - max(0, right)):
                steps[k, i, j] = ((lab[i + down, j + right] - lab[i, j]) ** 2).sum()
    total = np.ones((4, *SHAPE), np.float32)
    add_contrast(lab, shown, inside, total)
    expected = 1 + np.minimum(steps / (4 * steps[:, inside].mean()), STEEPEST) * shown
    assert total == pytest.approx(expected, rel=1e-4)


def test_others_are_the_views_of_the_side_that_see_a_pixel(labs, seen):
    total, count = np.zeros((*SHAPE, 3), np.float32), np.zeros(SHAPE, np.float32)
    for lab, shown in zip(labs, seen, strict=True):
        add_seen(lab, shown, total, count)
    others, apart = apart_from_others(labs[1], seen[1], total, count)
    rest = np.delete(np.arange(5), 1)
    with np.errstate(invalid="ignore"):
        mean = np.where(seen[rest, ..., None], labs[rest], 0).sum(0) / seen[rest].sum(0)[..., None]
    assert others == pytest.approx(mean, rel=1e-4, nan_ok=True)
    assert apart == pytest.approx(((labs[1] - mean) ** 2).sum(2), rel=1e-3, abs=1e-3, nan_ok=True)


def test_disagreement_leaves_out_the_most_deviant_view(labs, seen):
    seen[3, 0, 0] = seen[4, 0, 0] = False
    seen[:3, 0, 0] = True
    labs[2, 0, 0] = labs[0, 0, 0] + 80  # the third sees something else
    labs[1, 0, 0] = labs[0, 0, 0]
    apart = [3 * (80 / 3) ** 2] * 2 + [3 * (160 / 3) ** 2]
    found = disagreement_of(labs, seen, np.ones(5, int), 3)
    assert found[0, 0] == pytest.approx(max(sum(apart) - max(apart) * 3 / 2, 0) / 1, abs=1e-2)
    few = seen.sum(0) < 3
    assert few.any()
    assert (np.isnan(found) == few).all()


def test_a_photograph_is_read_where_the_plane_projects():
    rows, columns = np.indices((240, 320))
    image = np.stack([columns / 2, rows / 2, 0 * rows], -1).astype(np.uint8)
    camera = Camera("OPENCV", 320, 240, (300.0, 310.0, 161.0, 118.0, -0.1, 0.02, 1e-3, -1e-3))
    turn = np.array([[0.96, 0.02, 3.0], [-0.03, 0.93, -5.0], [0.2, 0.1, 400.0]])
    origin, pixel = np.array([-320.0, -60.0]), 2.5
    found, held = rectified(image, turn, camera.lens, 1, origin, pixel, 60, 200)
    xy = origin + (np.stack(np.indices((60, 200))[::-1], -1) + 0.5) * pixel
    pixels = camera.project(np.concatenate([xy, np.ones((60, 200, 1))], 2).reshape(-1, 3) @ turn.T).reshape(60, 200, 2)
    inside = ((pixels >= 0.5) & (pixels <= [319.5, 239.5])).all(2)
    assert (held == inside).all()
    assert held.any()
    assert not held.all()
    assert abs(found[held][:, :2] - (pixels[held] - 0.5) / 2).max() < 1.1  # whole numbers, and halves cut off before


def test_k_means_parts_two_heaps(rng):
    heaps = np.concatenate([rng.normal(0, 1, (40, 3)), rng.normal(30, 1, (60, 3))]).astype(np.float32)
    centres = np.array([[10.0, 10, 10], [12.0, 12, 12]])
    labels = nearest_centres(heaps, centres, 8)
    assert (labels == np.repeat([0, 1], [40, 60])).all()
    assert centres[1] == pytest.approx(heaps[40:].mean(0), abs=1e-3)
