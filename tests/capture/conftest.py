"""A small capture, made in memory and written to a folder by the formats' own descriptions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from kerfwright.capture import Cloud, View, write_colmap_text, write_ply
from samples import colmap_binary, look_at, ring_of_views


def box_cloud(low, high, spacing: float, generator: np.random.Generator, noise: float = 0.0) -> Cloud:
    """Points on the faces of a box, evenly at random, normals outwards."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    points, normals = [], []
    for axis in range(3):
        for sign in (-1, 1):
            area = np.prod(np.delete(high - low, axis))
            face = generator.uniform(low, high, (max(1, int(area / spacing**2)), 3))
            face[:, axis] = (high if sign > 0 else low)[axis]
            points.append(face)
            normals.append(np.tile(sign * np.eye(3)[axis], (len(face), 1)))
    points = np.concatenate(points)
    return Cloud(points + noise * generator.standard_normal(points.shape), np.concatenate(normals))


def joined(*clouds: Cloud) -> Cloud:
    return Cloud(np.concatenate([c.points for c in clouds]), np.concatenate([c.normals for c in clouds]))


def stool_cloud(generator: np.random.Generator, noise: float = 2e-4, spacing: float = 6e-3) -> Cloud:
    """A top on two sides, metres, standing on z = 0; not seen from below."""
    parts = [
        ((-0.2, -0.15, 0.38), (0.2, 0.15, 0.4)),
        ((-0.18, -0.1, 0), (-0.16, 0.13, 0.38)),
        ((0.15, -0.1, 0), (0.17, 0.1, 0.38)),
    ]
    cloud = joined(*(box_cloud(low, high, spacing, generator, noise) for low, high in parts))
    return cloud.select(cloud.points[:, 2] > 4 * noise)


def floor_cloud(generator: np.random.Generator, half: float = 0.4, noise: float = 2e-4, spacing: float = 6e-3) -> Cloud:
    """A square of the plane z = 0, seen from above, not under the stool's sides."""
    xy = generator.uniform(-half, half, (int((2 * half / spacing) ** 2), 2))
    points = np.c_[xy, noise * generator.standard_normal(len(xy))]
    return Cloud(points, np.tile([0.0, 0.0, 1.0], (len(xy), 1)))


@pytest.fixture
def generator() -> np.random.Generator:
    return np.random.default_rng(1)


@pytest.fixture(scope="session")
def shapes() -> dict[str, Callable]:
    """What the tests build captures of, by name."""
    return {
        "box": box_cloud,
        "floor": floor_cloud,
        "joined": joined,
        "look_at": look_at,
        "ring": ring_of_views,
        "stool": stool_cloud,
    }


@pytest.fixture
def capture_folder(tmp_path: Path, generator: np.random.Generator) -> Path:
    """A whole capture: eight grey photographs, a COLMAP text model and a cloud."""
    folder = tmp_path / "stool"
    views = ring_of_views(8, 0.9, 0.5, np.array([0, 0, 0.2]), folder)
    (folder / "images").mkdir(parents=True)
    for view in views:
        cv2.imwrite(str(view.path), np.full((view.camera.height, view.camera.width, 3), 128, np.uint8))
    write_colmap_text(folder / "sparse" / "0", views)
    write_ply(folder / "cloud.ply", stool_cloud(generator))
    return folder


@pytest.fixture(scope="session")
def write_binary() -> Callable[[Path, list[View]], None]:
    return colmap_binary
