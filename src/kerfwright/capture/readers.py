"""Which file of a capture tells of its cameras, and which is its cloud; docs/formats.md has the table of both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from kerfwright.capture.alicevision import find_alicevision, read_alicevision
from kerfwright.capture.bundler import find_bundler, read_bundler
from kerfwright.capture.colmap import find_colmap, read_colmap
from kerfwright.capture.images import Locate
from kerfwright.capture.metashape import find_metashape, read_metashape
from kerfwright.capture.nerfstudio import find_nerfstudio, read_nerfstudio
from kerfwright.capture.openmvg import find_openmvg, read_openmvg
from kerfwright.capture.parsing import capture_error
from kerfwright.capture.pcd import read_pcd
from kerfwright.capture.ply import read_ply
from kerfwright.capture.posed import PosedImage
from kerfwright.capture.raw_cloud import RawCloud
from kerfwright.capture.realitycapture import find_rc_csv, find_rc_xmp, read_rc_csv, read_rc_xmp
from kerfwright.capture.scans import read_e57, read_las
from kerfwright.capture.xyz import read_xyz

__all__ = ["CLOUD_READERS", "CameraFile", "find_cameras", "find_cloud", "read_cloud"]

CLOUD_READERS: dict[str, Callable[[Path], RawCloud]] = {
    ".ply": read_ply,
    ".pcd": read_pcd,
    ".e57": read_e57,
    ".laz": read_las,
    ".las": read_las,
    ".xyz": read_xyz,
    ".pts": read_xyz,
    ".asc": read_xyz,
}
CLOUD_STEMS = ("cloud", "fused")


@dataclass(frozen=True)
class CameraFile:
    """Where cameras were found: the program, the file or folder, the folder that names are relative to besides."""

    program: str
    path: Path
    base: Path | None
    read: Callable[[Locate], list[PosedImage]]


def find_cameras(folder: Path) -> CameraFile:
    """The first of the known camera files that is there, COLMAP before all others.

    Raises
    ------
    CaptureError
        If there is none, or several of the same program.
    """
    if model := find_colmap(folder):
        return CameraFile("COLMAP", model, None, lambda locate: read_colmap(model))
    if bundle := find_bundler(folder):
        return CameraFile("Bundler", bundle, bundle.parent, partial(read_bundler, bundle))
    for program, find, read in (
        ("Metashape", find_metashape, read_metashape),
        ("Meshroom", find_alicevision, read_alicevision),
        ("RealityCapture", find_rc_csv, read_rc_csv),
        ("OpenMVG", find_openmvg, read_openmvg),
        ("nerfstudio", find_nerfstudio, read_nerfstudio),
    ):
        if files := find(folder):
            return CameraFile(program, _only(files, program), files[0].parent, partial(read, files[0]))
    if files := find_rc_xmp(folder):
        return CameraFile("RealityCapture", files[0].parent, files[0].parent, partial(read_rc_xmp, files))
    raise capture_error(
        folder,
        "cameras",
        "none",
        "put a COLMAP model into sparse/0, or what another program wrote; see docs/formats.md",
    )


def _only(files: Sequence[Path], program: str) -> Path:
    if len(files) > 1:
        names = ", ".join(path.name for path in files)
        raise capture_error(files[0].parent, "cameras", names, f"keep one file of {program}")
    return files[0]


def find_cloud(folder: Path) -> Path:
    """The file `cloud`, else `fused`, of any kind that can be read; else the largest such file.

    Raises
    ------
    CaptureError
        If there is none.
    """
    files = [p for p in folder.iterdir() if p.suffix.lower() in CLOUD_READERS and p.is_file()]
    if not files:
        known = ", ".join(ending[1:] for ending in CLOUD_READERS)
        raise capture_error(folder, "cloud", "none", f"put the stereo cloud there as cloud.ply, or as one of {known}")
    kinds = list(CLOUD_READERS)

    def rank(path: Path) -> tuple[int, int, int, str]:
        stem = CLOUD_STEMS.index(path.stem) if path.stem in CLOUD_STEMS else len(CLOUD_STEMS)
        kind = kinds.index(path.suffix.lower()) if path.stem in CLOUD_STEMS else 0
        return stem, kind, -path.stat().st_size, path.name

    return min(files, key=rank)


def read_cloud(path: Path) -> RawCloud:
    """Read a cloud by the kind that its name's ending tells."""
    return CLOUD_READERS[path.suffix.lower()](path)
