"""Agisoft Metashape: File, Export, Export Cameras, as Agisoft XML.

Metashape user manual, appendix Camera models: u = width / 2 + cx + f x' + b1 x' + b2 y', v = height / 2 + cy + f y',
where (x', y') is Brown's polynomial in k1 to k4, with p1 (r^2 + 2 x^2) + 2 p2 x y in x': p1 and p2 are OpenCV's p2 and
p1. A camera's transform leads from the camera (x right, y down, z forward) to its chunk; that of the chunk, or of its
component, leads on to the coordinates in which clouds are exported.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from kerfwright.capture.camera import Camera
from kerfwright.capture.fields import read_xml, rigid, words_of
from kerfwright.capture.images import Locate
from kerfwright.capture.parsing import capture_error, finite_float, whole_number
from kerfwright.capture.posed import PosedImage, checked_camera

__all__ = ["find_metashape", "read_metashape"]

OLDEST = (1, 2)  # format versions before had the principal point from the corner
EARTH = 1e5  # farther from the origin the chunk's coordinates are geocentric, those of its clouds are not
GEOREFERENCED = (
    "the project is georeferenced: set its coordinate system to Local Coordinates, then export cameras and cloud again"
)


def find_metashape(folder: Path) -> list[Path]:
    """XML files of the capture's folder that begin like Agisoft's."""
    return [path for path in sorted(folder.glob("*.xml")) if _is_agisoft(path)]


def _is_agisoft(path: Path) -> bool:
    with path.open("rb") as file:
        start = file.read(2000)
    return b"<document" in start and b"<chunk" in start


@np.errstate(over="ignore", invalid="ignore")  # numbers too large to be true fail the checks
def read_metashape(path: Path, locate: Locate) -> list[PosedImage]:
    """Images with a transform, in the order of the file; others were not aligned.

    Raises
    ------
    CaptureError
        If the file is damaged, holds several chunks, is georeferenced, or a camera is none that kerfwright knows.
    """
    root = read_xml(path)
    _check_version(root, path)
    chunks = root.findall("chunk")
    if len(chunks) != 1:
        raise capture_error(path, "chunks", len(chunks), "one is needed: export the cameras of one chunk")
    chunk = chunks[0]
    sensors = [s for s in chunk.findall("sensors/sensor") if _calibration(s) is not None]
    cameras = {s.get("id", ""): _camera(s, path) for s in sensors}
    world = _worlds(chunk, path)
    found = [camera for camera in chunk.findall("cameras//camera") if camera.findtext("transform")]
    return [_image(camera, cameras, world, path) for camera in found]


def _check_version(root: ElementTree.Element, path: Path) -> None:
    text = root.get("version", "")
    parts = text.split(".")
    if not all(p.isascii() and p.isdigit() and len(p) < 9 for p in parts) or tuple(map(int, parts)) < OLDEST:
        raise capture_error(path, "document version", text, "at least 1.2: export from Metashape, or PhotoScan 1.2 on")


def _calibration(sensor: ElementTree.Element) -> ElementTree.Element | None:
    """The adjusted calibration, else the first one."""
    found = sensor.findall("calibration")
    return next((c for c in found if c.get("class") == "adjusted"), found[0] if found else None)


def _camera(sensor: ElementTree.Element, path: Path) -> Camera:
    calibration = _calibration(sensor)
    field = f"sensor {sensor.get('id')}"
    kind = calibration.get("type", sensor.get("type", "frame"))
    if kind not in ("frame", "fisheye"):
        raise capture_error(path, f"{field} type", kind, "frame and fisheye are known: undistort, then export again")
    names = ("f", "cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4")
    v = {n: finite_float(calibration.findtext(n) or "0", path, f"{field} {n}") for n in names}
    unknown = ("p3", "p4") if kind == "frame" else ("p1", "p2", "p3", "p4")
    for name in unknown:
        if v[name]:
            raise capture_error(path, f"{field} {name}", v[name], f"not known for {kind}: fit without it, or undistort")
    resolution = calibration.find("resolution")
    size = {} if resolution is None else resolution.attrib
    width, height = (whole_number(size.get(n, ""), path, f"{field} {n}") for n in ("width", "height"))
    fx = v["f"] + v["b1"]
    lengths = (fx, v["f"], width / 2 + v["cx"], height / 2 + v["cy"], v["k1"], v["k2"], v["k3"], v["k4"])
    shear = v["b2"] / fx if fx else 0.0
    if kind == "fisheye":
        return checked_camera("FISHEYE", width, height, (*lengths, shear), path, field)
    return checked_camera("BROWN", width, height, (*lengths, v["p2"], v["p1"], shear), path, field)


def _worlds(chunk: ElementTree.Element, path: Path) -> dict[str, np.ndarray]:
    """world_from_chunk, 4x4, of each component, and under "" of the chunk."""
    own = chunk.find("transform")
    worlds = {"": np.eye(4) if own is None else _similarity(own, path, "chunk transform")}
    for component in chunk.findall("components/component"):
        transform = component.find("transform")
        if transform is not None:
            worlds[component.get("id", "")] = _similarity(transform, path, f"component {component.get('id')} transform")
    return worlds


def _similarity(transform: ElementTree.Element, path: Path, field: str) -> np.ndarray:
    """Rotation, translation and scale, each of which may be left out; older files have 16 numbers instead."""
    if (transform.text or "").strip():
        matrix = words_of(transform.text, 16, path, field).reshape(4, 4)
        scale = float(np.cbrt(max(np.linalg.det(matrix[:3, :3]), 0.0)))
        turn, shift = matrix[:3, :3] / (scale or 1.0), matrix[:3, 3]
    else:
        scale = finite_float(transform.findtext("scale") or "1", path, f"{field} scale")
        rotation = transform.findtext("rotation") or "1 0 0 0 1 0 0 0 1"
        turn = words_of(rotation, 9, path, f"{field} rotation").reshape(3, 3)
        shift = words_of(transform.findtext("translation") or "0 0 0", 3, path, f"{field} translation")
    if not 1e-9 < scale < 1e9:
        raise capture_error(path, f"{field} scale", scale, "impossible: export the file again")
    if np.linalg.norm(shift) > EARTH:
        raise capture_error(path, field, shift.tolist(), GEOREFERENCED)
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = scale * rigid(turn, np.zeros(3), path, field)[:3, :3], shift
    return out


def _image(
    camera: ElementTree.Element, cameras: dict[str, Camera], worlds: dict[str, np.ndarray], path: Path
) -> PosedImage:
    name = camera.get("label", "")
    field = f"camera {camera.get('id')}"
    if camera.get("sensor_id", "") not in cameras:
        found = camera.get("sensor_id")
        raise capture_error(path, f"{field} sensor_id", found, "no calibration for it: align, then export")
    chunk_from_camera = words_of(camera.findtext("transform"), 16, path, f"{field} transform").reshape(4, 4)
    world = worlds.get(camera.get("component_id", ""), worlds[""])
    scale = float(np.cbrt(np.linalg.det(world[:3, :3])))
    rigid(chunk_from_camera[:3, :3].T, chunk_from_camera[:3, 3], path, field)  # is it one?
    turn = (world[:3, :3] / scale @ chunk_from_camera[:3, :3]).T
    centre = world[:3, :3] @ chunk_from_camera[:3, 3] + world[:3, 3]
    return PosedImage(name, cameras[camera.get("sensor_id", "")], rigid(turn, centre, path, field))
