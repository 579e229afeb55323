"""Cameras from photographs alone, by COLMAP's Python package, which is installed on wish: the extra `poses`.

Schönberger and Frahm, Structure-from-Motion Revisited, CVPR 2016. What is left is stereo: the cloud. COLMAP's own needs
an NVIDIA card; docs/tutorial.md has the commands for it and for other programs.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

from kerfwright.capture.images import SUFFIXES
from kerfwright.errors import CaptureError, OptionError, OutputError

__all__ = ["Recovered", "recover_cameras"]

FEWEST = 3  # photographs
PARTS = ("images", "sparse", "stereo")  # the last tells COLMAP which photographs its stereo is to compare
INSTALL = "needs pycolmap: run `pip install 'pycolmap>=3.11,<5'`"


@dataclass(frozen=True)
class Recovered:
    """Photographs placed and all there were, points, and by how many pixels these are missed, on average."""

    placed: int
    photographs: int
    points: int
    error: float


def recover_cameras(
    photographs: Path,
    capture: Path,
    *,
    one_camera: bool = True,
    seed: int = 0,
    say: Callable[[str], None] = lambda text: None,
) -> Recovered:
    """Write a capture's images/, undistorted, sparse/, a COLMAP model of pinhole cameras, and stereo/ for its stereo.

    Parameters
    ----------
    photographs : folder of JPEG, PNG or TIFF files
    capture : folder to be made; what is in it must not be overwritten
    one_camera : all photographs are of one camera and focal length, which makes the lens known better
    say : told of every step

    Raises
    ------
    CaptureError
        If there are too few photographs, or they cannot be placed with each other.
    OutputError
        If the capture has images or cameras already.
    """
    names = _names(photographs)
    for name in PARTS:
        if (capture / name).exists():
            raise OutputError(f"{capture / name}: folder: is there already: give another folder for the capture")
    try:
        colmap = import_module("pycolmap")
    except ImportError as error:
        raise OptionError(f"poses: {INSTALL}") from error
    with tempfile.TemporaryDirectory() as scratch:
        best = _mapped(colmap, photographs, names, Path(scratch), one_camera, seed, say)
        say("Undistorting the photographs")
        _write(colmap, best, photographs, capture, Path(scratch))
    error = float(best.compute_mean_reprojection_error())
    return Recovered(best.num_reg_images(), len(names), best.num_points3D(), error)


def _names(photographs: Path) -> list[str]:
    if not photographs.is_dir():
        raise CaptureError(f"{photographs}: photographs: no such folder: give the folder that they are in")
    names = sorted(p.name for p in photographs.iterdir() if p.suffix.lower() in SUFFIXES)
    if len(names) < FEWEST:
        raise CaptureError(f"{photographs}: photographs: {len(names)}: at least {FEWEST} are needed, 20 to 40 are good")
    return names


def _mapped(
    colmap: ModuleType, photographs: Path, names: list[str], scratch: Path, one_camera: bool, seed: int, say: Callable
):
    """The largest group of photographs that could be placed with each other."""
    colmap.logging.minloglevel = 3  # its own talk goes nowhere
    colmap.set_random_seed(seed)
    database = scratch / "database.db"
    mode = colmap.CameraMode.SINGLE if one_camera else colmap.CameraMode.PER_IMAGE
    reader = colmap.ImageReaderOptions(camera_model="OPENCV")
    say(f"Finding features in {len(names)} photographs")
    colmap.extract_features(database, photographs, names, mode, reader)
    say("Matching them")
    colmap.match_exhaustive(database)
    say("Placing the photographs")
    models = colmap.incremental_mapping(database, photographs, scratch / "models")
    if not models:
        raise CaptureError(
            f"{photographs}: photographs: {len(names)} could not be placed: overlap them more, sharp, on something "
            "with a pattern"
        )
    return max(models.values(), key=lambda model: (model.num_reg_images(), model.num_points3D()))


def _write(colmap: ModuleType, model, photographs: Path, capture: Path, scratch: Path) -> None:
    (scratch / "best").mkdir()
    model.write(scratch / "best")
    made = scratch / "undistorted"
    colmap.undistort_images(made, scratch / "best", photographs)
    capture.mkdir(parents=True, exist_ok=True)
    for name in PARTS:
        shutil.move(str(made / name), str(capture / name))
