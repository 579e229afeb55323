"""RealityCapture and RealityScan: the CSV of internal and external camera parameters, and XMP files beside the images.

Epic Games, RealityScan XMP Camera Math: x_in_camera = R (x - position), x right, y down, z forward. Coordinates in the
picture are shares of its longer side, from the middle; the focal length is that of a 36 mm frame. Brown's polynomial
acts on the plane z = 1 with the terms k1 k2 k3 k4 t1 t2; t1 belongs to r^2 + 2 x^2 in x (as AliceVision's importer has
it), so that t1 and t2 are OpenCV's p2 and p1. In the CSV, heading, pitch and roll turn a camera that looks down, its
top to +y: by -heading about z, pitch about x, roll about y.
"""

from __future__ import annotations

import csv
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from kerfwright.capture.fields import read_xml, rigid, words_of
from kerfwright.capture.images import Locate, image_size
from kerfwright.capture.parsing import capture_error, finite_float, read_lines
from kerfwright.capture.posed import PosedImage, checked_camera

__all__ = ["find_rc_csv", "find_rc_xmp", "read_rc_csv", "read_rc_xmp"]

FILM = 36.0  # mm, the longer side of the frame that focal lengths are told for
XCR = "{http://www.capturingreality.com/ns/xcr/1.1#}"
RDF = "{http://www.w3.org/1999/02/22-rdf-syntax-ns#}"
POSE_COLUMNS = ("x", "y", "alt", "heading", "pitch", "roll", "f")
LENS_COLUMNS = ("px", "py", "k1", "k2", "k3", "k4", "t1", "t2")
BROWN = frozenset({"perspective", "brown3", "brown4", "brown3t2", "brown4t2"})
CV_FROM_GL = np.diag([1.0, -1.0, -1.0])
UNKNOWN_LENS = "set Alignment settings, Distortion model to Brown3 and align again, or export undistorted images"


def find_rc_csv(folder: Path) -> list[Path]:
    """CSV files of the capture's folder whose heading is that of camera parameters."""
    return [path for path in sorted(folder.glob("*.csv")) if _heading(path)]


def _heading(path: Path) -> tuple[int, list[str]] | None:
    """Index of the line of column names among the first three, and the names."""
    with path.open("rb") as file:
        start = file.read(2000).decode("utf-8-sig", errors="replace")
    for number, line in enumerate(start.splitlines()[:3]):
        names = [name.strip().lstrip("#").lower() for name in line.split(",")]
        if names[0] == "name" and set(POSE_COLUMNS) <= set(names):
            return number, names
    return None


def read_rc_csv(path: Path, locate: Locate) -> list[PosedImage]:
    """Images in the order of the file; sizes come from the image files, as the CSV has none.

    Raises
    ------
    CaptureError
        If the file is damaged, or its lens terms are of a model that kerfwright does not know.
    """
    number, names = _heading(path) or (0, [])
    rows = csv.reader(line for line in read_lines(path)[number + 1 :] if line.strip() and not line.startswith("#"))
    try:
        images = [_csv_image(row, names, path, f"row {k}", locate) for k, row in enumerate(rows, 1)]
    except csv.Error as error:
        raise capture_error(path, "CSV", str(error), "export the file again") from None
    return [image for image in images if image]


def _csv_image(row: list[str], names: list[str], path: Path, field: str, locate: Locate) -> PosedImage | None:
    if len(row) != len(names):
        raise capture_error(path, field, ",".join(row), f"{len(names)} columns, as in the heading: export again")
    name = row[0]
    value = {n: finite_float(w, path, f"{field} {n}") for n, w in zip(names[1:], row[1:], strict=True) if n in _WANTED}
    turn = Rotation.from_euler("ZXY", [-value["heading"], value["pitch"], value["roll"]], degrees=True).as_matrix()
    pose = rigid(CV_FROM_GL @ turn.T, np.array([value[n] for n in ("x", "y", "alt")]), path, field)
    px, py, *lens = (value.get(n, 0.0) for n in LENS_COLUMNS)
    if lens[0] and not any(lens[1:]):
        raise capture_error(path, f"{field} k1", lens[0], f"alone, it is of the division model: {UNKNOWN_LENS}")
    return _image(name, locate(name), value["f"], (px, py), lens, pose, path, field)


_WANTED = frozenset(POSE_COLUMNS + LENS_COLUMNS)


def _image(
    name: str,
    file: Path | None,
    focal: float,
    middle: tuple[float, float],
    lens: list[float],
    pose: np.ndarray,
    path: Path,
    field: str,
) -> PosedImage | None:
    """The image, from what both kinds of file tell; None where its file is missing, so that its size is unknown."""
    if file is None:
        return None
    width, height = image_size(file)
    longer = max(width, height)
    f, (u, v) = focal * longer / FILM, middle
    k1, k2, k3, k4, t1, t2 = lens
    params = (f, f, width / 2 + u * longer, height / 2 + v * longer, k1, k2, k3, k4, t2, t1, 0.0)
    return PosedImage(name, checked_camera("BROWN", width, height, params, path, field), pose)


def find_rc_xmp(folder: Path) -> list[Path]:
    """XMP files of RealityCapture beside the images, in the capture's folder or in its folder xmp."""
    places = (folder / "images", folder / "xmp", folder)
    files = [path for place in places if place.is_dir() for path in sorted(place.glob("*.xmp"))]
    return [path for path in files if b"capturingreality.com" in path.read_bytes()[:4000]]


def read_rc_xmp(files: list[Path], locate: Locate) -> list[PosedImage]:
    """One image a file, in the order of the files; an XMP file without a pose is of an image that was not aligned.

    Raises
    ------
    CaptureError
        If a file is damaged, or its lens model is one that kerfwright does not know.
    """
    images = [_xmp_image(path, locate) for path in files]
    return [image for image in images if image]


def _xmp_image(path: Path, locate: Locate) -> PosedImage | None:
    about = read_xml(path).find(f".//{RDF}Description")
    if about is None or _xmp_text(about, "Rotation") is None or _xmp_text(about, "Position") is None:
        return None
    model = (_xmp_text(about, "DistortionModel") or "perspective").strip().lower()
    if model not in BROWN:
        raise capture_error(path, "DistortionModel", model, UNKNOWN_LENS)
    for name, plain in (("Skew", 0.0), ("AspectRatio", 1.0)):
        if abs(_xmp_number(about, name, path, plain) - plain) > 1e-9:
            raise capture_error(path, name, _xmp_text(about, name), f"only {plain:g} is known: export undistorted")
    turn = words_of(_xmp_text(about, "Rotation"), 9, path, "Rotation").reshape(3, 3)
    pose = rigid(turn, words_of(_xmp_text(about, "Position"), 3, path, "Position"), path, "pose")
    middle = tuple(_xmp_number(about, f"PrincipalPoint{axis}", path, 0.0) for axis in "UV")
    focal = _xmp_number(about, "FocalLength35mm", path, None)
    return _image(path.stem, locate(path.stem), focal, middle, _xmp_lens(about, model, path), pose, path, "camera")


def _xmp_text(about: ElementTree.Element, name: str) -> str | None:
    """A property, which may stand as an attribute or as an element."""
    found = about.get(XCR + name)
    return about.findtext(XCR + name) if found is None else found


def _xmp_number(about: ElementTree.Element, name: str, path: Path, default: float | None) -> float:
    text = _xmp_text(about, name)
    if text is None and default is not None:
        return default
    return finite_float(text or "", path, name)


def _xmp_lens(about: ElementTree.Element, model: str, path: Path) -> list[float]:
    """k1 k2 k3 k4 t1 t2; older versions leave zeros at the end out."""
    text = _xmp_text(about, "DistortionCoeficients") or ""  # spelled so
    if model == "perspective":
        return [0.0] * 6
    words = text.split()
    if not 3 <= len(words) <= 6:
        raise capture_error(path, "DistortionCoeficients", text, "3 to 6 numbers belong here: export the file again")
    lens = [finite_float(word, path, "DistortionCoeficients") for word in words]
    return lens + [0.0] * (6 - len(lens))
