"""From an assembly to a capture folder, or to a capture in memory."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kerfwright.capture import Camera, Capture, Cloud, View, write_colmap_text, write_ply
from kerfwright.errors import OutputError
from kerfwright.model import Model, Scale
from kerfwright.synthetic.cameras import camera_path, camera_rays, intrinsics
from kerfwright.synthetic.cloud import stereo_cloud
from kerfwright.synthetic.files import write_frame, write_truth
from kerfwright.synthetic.options import CaptureOptions, DatasetOptions
from kerfwright.synthetic.render import photograph
from kerfwright.synthetic.stage import Stage, build_stage

__all__ = ["MemoryView", "in_memory", "write_capture"]

# One stream of random numbers each, so that changing one part's options leaves the others' draws as they were.
STAGE, PATH, CLOUD, POSES, PHOTOS = range(5)


@dataclass(frozen=True, eq=False)
class MemoryView(View):
    """A view whose photograph is in memory; `path` names no file."""

    pixels: np.ndarray = None

    def _as_on_disk(self) -> np.ndarray:
        return self.pixels.copy()


@dataclass(frozen=True, eq=False)
class _Session:
    """What photographs and cloud of one object share."""

    stage: Stage
    camera: Camera
    poses: np.ndarray  # (V, 4, 4) camera_from_model, mm
    options: CaptureOptions

    def stream(self, *key: int) -> np.random.Generator:
        return _stream(self.options.dataset.seed, *key)

    def photographs(self):
        """The pictures in order; two are made at a time."""
        rays = camera_rays(self.camera, self.options.images.samples)
        with ThreadPoolExecutor(2) as pool:
            yield from pool.map(
                lambda k: photograph(self.stage, self.camera, self.poses[k], self.stream(PHOTOS, k), rays),
                range(len(self.poses)),
            )

    def cloud(self) -> Cloud:
        return stereo_cloud(self.stage, self.camera, self.poses, self.options.cloud, self.stream(CLOUD))


def _stream(seed: int, *key: int) -> np.random.Generator:
    return np.random.default_rng([seed, *key])


def _session(assembly: Model, options: CaptureOptions) -> _Session:
    seed = options.dataset.seed
    stage = build_stage(assembly, options.images, _stream(seed, STAGE))
    poses = camera_path(*stage.bounds, options.dataset, _stream(seed, PATH))
    return _Session(stage, intrinsics(options.dataset), poses, options)


def write_capture(assembly: Model, folder: Path | str, options: CaptureOptions | None = None) -> Path:
    """Photograph an assembly and write its capture folder with the truth.

    Parameters
    ----------
    assembly : Model
        Boards standing on the floor z = 0, millimetres.
    folder : Path
        New, or empty.
    options : CaptureOptions, optional
        A preset of `PRESETS`, or your own; the same options and assembly give the same files.

    Raises
    ------
    OutputError
        If the folder holds something already.
    """
    options, folder = options or CaptureOptions(), Path(folder)
    if folder.exists() and any(folder.iterdir()):
        raise OutputError(f"{folder}: folder: not empty: name a new one, or empty it first")
    (folder / "images").mkdir(parents=True, exist_ok=True)
    session = _session(assembly, options)
    names = [f"IMG_{k:04d}.jpg" for k in range(len(session.poses))]
    for name, picture in zip(names, session.photographs(), strict=True):
        _write_picture(folder / "images" / name, picture, options.images.quality)
    turn, capture_from_model = _frame(options.dataset)
    camera, poses = _recovered(session)
    poses = [_rescaled(pose, capture_from_model) for pose in poses]
    views = [View(n, folder / "images" / n, camera, p) for n, p in zip(names, poses, strict=True)]
    write_colmap_text(folder / "sparse" / "0", views)
    write_ply(folder / "cloud.ply", _laid(session.cloud(), capture_from_model))
    write_truth(folder / "truth", assembly)
    write_frame(folder / "truth", options.dataset.scale, turn, options.dataset.shift)
    return folder


def in_memory(assembly: Model, options: CaptureOptions, photographed: bool = True) -> Capture:
    """The same capture without files: world = model, millimetres; exact poses. Not photographed: a cloud alone."""
    session = _session(assembly, options)
    if not photographed:
        return Capture(assembly.name, (), session.cloud(), Scale(millimetres_per_unit=1.0, origin="given"))
    views = tuple(
        MemoryView(f"IMG_{k:04d}.jpg", Path(f"IMG_{k:04d}.jpg"), session.camera, pose, pixels=picture)
        for k, (pose, picture) in enumerate(zip(session.poses, session.photographs(), strict=True))
    )
    return Capture(assembly.name, views, session.cloud(), Scale(millimetres_per_unit=1.0, origin="given"))


def _write_picture(path: Path, picture: np.ndarray, quality: int) -> None:
    import cv2

    if not cv2.imwrite(str(path), picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality]):
        raise OutputError(f"{path}: photograph: cannot be written: check space and permissions")


def _frame(options: DatasetOptions) -> tuple[np.ndarray, np.ndarray]:
    """turn (3, 3) and capture_from_model (4, 4; model in mm)."""
    c, s = np.cos(np.radians(options.turn)), np.sin(np.radians(options.turn))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = turn * options.scale / 1000, options.shift
    return turn, m


def _rescaled(camera_from_model: np.ndarray, capture_from_model: np.ndarray) -> np.ndarray:
    """camera_from_capture, rigid, lengths in capture units."""
    scale = np.cbrt(np.linalg.det(capture_from_model[:3, :3]))
    out = np.eye(4)
    out[:3, :3] = camera_from_model[:3, :3] @ capture_from_model[:3, :3].T / scale
    out[:3, 3] = scale * camera_from_model[:3, 3] - out[:3, :3] @ capture_from_model[:3, 3]
    return out


def _laid(cloud: Cloud, capture_from_model: np.ndarray) -> Cloud:
    linear = capture_from_model[:3, :3]
    turn = linear / np.cbrt(np.linalg.det(linear))
    return Cloud(cloud.points @ linear.T + capture_from_model[:3, 3], cloud.normals @ turn.T, cloud.colours)


def _recovered(session: _Session) -> tuple[Camera, np.ndarray]:
    """Camera and poses as structure from motion would give them: a little wrong."""
    from scipy.spatial.transform import Rotation

    options, rng, poses = session.options.dataset, session.stream(POSES), session.poses.copy()
    for pose in poses:
        centre = -pose[:3, :3].T @ pose[:3, 3] + rng.normal(0, options.position_noise, 3)
        axis = np.radians(rng.normal(0, options.angle_noise, 3))
        pose[:3, :3] = Rotation.from_rotvec(axis).as_matrix() @ pose[:3, :3]
        pose[:3, 3] = -pose[:3, :3] @ centre
    if not options.pixel_noise:
        return session.camera, poses
    params = list(session.camera.params)
    at = 1 if session.camera.model in ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL") else 2
    for k in (at, at + 1):
        params[k] += float(rng.normal(0, options.pixel_noise))
    return replace(session.camera, params=tuple(params)), poses
