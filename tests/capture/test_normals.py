"""Normals of clouds that have none, or wrong ones."""

from __future__ import annotations

import numpy as np
import pytest

from kerfwright.capture.normals import normals_or_estimates

WALLS = (
    ((-0.2, -0.15, 0), (-0.185, 0.15, 0.1)),
    ((0.185, -0.15, 0), (0.2, 0.15, 0.1)),
    ((-0.185, -0.15, 0), (0.185, -0.135, 0.1)),
    ((-0.185, 0.135, 0), (0.185, 0.15, 0.1)),
    ((-0.185, -0.135, 0), (0.185, 0.135, 0.015)),
)


@pytest.fixture
def open_box(shapes, generator, tmp_path):
    """Walls and base of 15 mm, seen from above all round: outer, inner and upper faces, none of the underside."""
    parts = []
    for wall in WALLS:
        cloud = shapes["box"](*wall, 4e-3, generator, 2e-4)
        free = cloud.points[:, 2] > 3e-3
        for low, high in set(WALLS) - {wall}:
            free &= (np.abs(cloud.points - np.clip(cloud.points, low, high)) > 1e-3).any(axis=1)
        parts.append(cloud.select(free))
    around, above = ((10, 0.8, 0.3), (6, 0.4, 0.8))
    views = [v for ring in (around, above) for v in shapes["ring"](*ring, np.zeros(3), tmp_path, (640, 480))]
    return shapes["joined"](*parts), views


def away_from_edges(points):
    """Points where the neighbourhood lies on one face."""
    x, y, z = np.abs(points).T
    near = 0.012
    return (z < 0.1 - near) & (z > 0.015 + near) & (x < 0.185 - near) & (y < 0.135 - near) | (
        (z > near) & (z < 0.1 - near) & ((x > 0.199) & (y < 0.15 - near) | (y > 0.149) & (x < 0.2 - near))
    )


def test_estimated_normals_point_out_of_the_material_inside_and_out(open_box):
    cloud, views = open_box
    normals, notes = normals_or_estimates(cloud.points, None, views)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    agree = (normals * cloud.normals).sum(axis=1)
    clear = away_from_edges(cloud.points)
    assert clear.sum() > 500
    assert (agree > 0).mean() > 0.97 and (agree[clear] > 0.9).mean() > 0.99
    assert "no normals" in notes[0]


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_inward_normals_are_turned_round(open_box, generator, share):
    cloud, views = open_box
    inward = generator.random(len(cloud)) < share
    normals, notes = normals_or_estimates(cloud.points, np.where(inward[:, None], -cloud.normals, cloud.normals), views)
    assert ((normals * cloud.normals).sum(axis=1) > 0).mean() > 0.97
    assert "turned round" in notes[0]


def test_good_normals_are_left_alone(open_box):
    cloud, views = open_box
    normals, notes = normals_or_estimates(cloud.points, 7 * cloud.normals, views)
    np.testing.assert_allclose(normals, cloud.normals, atol=1e-12)
    assert notes == ()


@pytest.mark.parametrize(("step", "told"), [(50, "these were estimated"), (2, "all were estimated")])
def test_missing_normals_are_estimated(open_box, step, told):
    cloud, views = open_box
    broken = cloud.normals.copy()
    broken[::step], broken[1] = 0, np.nan
    normals, notes = normals_or_estimates(cloud.points, broken, views)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    assert ((normals * cloud.normals).sum(axis=1) > 0).mean() > 0.97
    assert told in notes[0]


def test_few_points_and_no_views():
    points = np.random.default_rng(0).normal(size=(5, 3))
    normals, _ = normals_or_estimates(points, None, ())
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
