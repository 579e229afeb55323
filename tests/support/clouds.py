"""Clouds of boxes, and one small photographed shelf, for tests of the stages."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from shapely.geometry import Polygon, box

from kerfwright.capture.types import Capture, Cloud
from kerfwright.identify import IdentifyOptions, Sheet, identify
from kerfwright.identify.slabs import Slab
from kerfwright.identify.thickness import ThicknessHypothesis
from kerfwright.model import Quantity, Scale
from kerfwright.synthetic import DatasetOptions, in_memory, tiny_assembly
from kerfwright.synthetic.tiny import TINY

Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def box_cloud(*boxes: Box, spacing: float = 4.0, noise: float = 0.1, seed: int = 0) -> Cloud:
    """Points spread at random over the faces of boxes, where no other box covers them, with outward normals."""
    rng = np.random.default_rng(seed)
    faces = [_face(lohi, axis, side, spacing, rng) for lohi in boxes for axis in range(3) for side in (0, 1)]
    points, normals = (np.concatenate(parts) for parts in zip(*faces, strict=True))
    outside = points + 0.5 * normals
    covered = np.zeros(len(points), bool)
    for low, high in boxes:
        covered |= ((outside > np.array(low) - 0.1) & (outside < np.array(high) + 0.1)).all(axis=1)
    points = points[~covered] + noise * rng.standard_normal((int((~covered).sum()), 3))
    return Cloud(points, normals[~covered])


def _face(lohi: Box, axis: int, side: int, spacing: float, rng) -> tuple[np.ndarray, np.ndarray]:
    low, high = np.array(lohi, float)
    area = np.prod(np.delete(high - low, axis))
    points = rng.uniform(low, high, (max(4, int(area / spacing**2)), 3))
    points[:, axis] = (low, high)[side][axis]
    normals = np.zeros_like(points)
    normals[:, axis] = 2 * side - 1
    return points, normals


def cloud_only(cloud: Cloud) -> Capture:
    """A capture without photographs."""
    return Capture("made", (), cloud, Scale(millimetres_per_unit=1.0))


def with_flipped(cloud: Cloud, share: float, seed: int = 0) -> Cloud:
    """The cloud with a share of its normals turned round."""
    flip = np.random.default_rng(seed).random(len(cloud)) < share
    return Cloud(cloud.points, np.where(flip[:, None], -cloud.normals, cloud.normals))


def pose(origin=(0, 0, 0), x=(1, 0, 0), y=(0, 1, 0)) -> np.ndarray:
    """4x4 frame from its origin and its x and y axes."""
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3] = x, y, np.cross(x, y), origin
    return frame


def turned(axis: str, degrees: float) -> np.ndarray:
    """4x4 rotation about an axis of the world."""
    from scipy.spatial.transform import Rotation

    frame = np.eye(4)
    frame[:3, :3] = Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
    return frame


def sheet(name: str, frame: np.ndarray, thickness: float, region: Polygon | tuple, **rest) -> Sheet:
    """A rough board without points, or with those given; region as a polygon or (x0, y0, x1, y1)."""
    none = np.zeros(0, int)
    quantity = rest.pop("quantity", Quantity(value=thickness, standard_error=0.2))
    indices = {"top_idx": none, "bottom_idx": none, "cut_idx": none, "thickness_seen": True} | rest
    region = region if isinstance(region, Polygon) else box(*region)
    return Sheet(name, frame, thickness=quantity, region=region, **indices)


def candidate(frame: np.ndarray, region: Polygon, thickness: float, evidence="opposite", free=0.0) -> Slab:
    """A candidate board that selection may choose."""
    return Slab(frame, ThicknessHypothesis(thickness, 0.2, evidence, 1.0), region, (), (), free)


@lru_cache(maxsize=1)
def shelf_capture() -> Capture:
    """The tiny assembly with enough photographs and points for the stages that look for boards."""
    cloud = replace(TINY.cloud, points=20_000, views=2)
    dataset = DatasetOptions(images=16, width=320, height=240)
    return in_memory(tiny_assembly(), replace(TINY, dataset=dataset, cloud=cloud))


@lru_cache(maxsize=1)
def shelf_parts():
    """What identification finds in it."""
    return identify(shelf_capture(), IdentifyOptions())
