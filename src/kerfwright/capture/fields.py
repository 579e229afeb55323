"""Fields of JSON and XML files: fetched by name, checked, and named in the error when they are wrong."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from kerfwright.capture.parsing import capture_error, finite_float, read_bytes, read_lines
from kerfwright.capture.posed import LARGEST_NUMBER

__all__ = ["Fields", "array_of", "number_of", "read_json", "read_xml", "rigid", "words_of"]

TURN_TOLERANCE = 1e-3  # of a rotation matrix printed with few digits from an orthonormal one


class Fields:
    """A JSON object of a file, which knows where in the file it stands."""

    def __init__(self, content: Any, path: Path, place: str) -> None:
        if not isinstance(content, dict):
            raise capture_error(path, place, content, "an object {...} belongs here: export the file again")
        self.content, self.path, self.place = content, path, place

    def __contains__(self, name: str) -> bool:
        return self.content.get(name) is not None

    def at(self, name: str) -> str:
        """What an error calls a field of this object."""
        return f"{self.place}.{name}" if self.place else name

    def get(self, name: str) -> Any:
        if name not in self:
            raise capture_error(self.path, self.at(name), "missing", "export the file again, with cameras and poses")
        return self.content[name]

    def number(self, name: str, default: float | None = None) -> float:
        """A finite number, which some programs write as text."""
        if default is not None and name not in self:
            return default
        return number_of(self.get(name), self.path, self.at(name))

    def numbers(self, name: str, shape: tuple[int, ...]) -> np.ndarray:
        """A list of numbers, or a list of rows, of this shape; -1 in it stands for any length."""
        return array_of(self.get(name), shape, self.path, self.at(name))

    def text(self, name: str, default: str | None = None) -> str:
        found = self.get(name) if default is None or name in self else default
        if not isinstance(found, str):
            raise capture_error(self.path, self.at(name), found, "a text belongs here: export the file again")
        return found

    def key(self, name: str) -> str:
        """A number or text that other parts of the file refer to."""
        found = self.get(name)
        if not isinstance(found, str | int) or isinstance(found, bool):
            raise capture_error(self.path, self.at(name), found, "an id belongs here: export the file again")
        return str(found)

    def inner(self, name: str) -> Fields:
        return Fields(self.get(name), self.path, self.at(name))

    def rows(self, name: str) -> Iterator[Fields]:
        """The objects of a list."""
        found = self.get(name)
        if not isinstance(found, list):
            raise capture_error(self.path, self.at(name), found, "a list belongs here: export the file again")
        for k, item in enumerate(found):
            yield Fields(item, self.path, f"{self.at(name)}[{k}]")

    def size(self, name: str) -> int:
        """A whole number of pixels; whether it makes sense is the camera's to say."""
        value = self.number(name)
        if value != int(value):
            raise capture_error(self.path, self.at(name), value, "a whole number of pixels: export the file again")
        return int(value)


def number_of(found: Any, path: Path, field: str) -> float:
    """A finite number from a JSON number or a text."""
    if isinstance(found, str):
        return finite_float(found, path, field)
    if isinstance(found, bool) or not isinstance(found, int | float) or not abs(found) < np.inf:
        raise capture_error(path, field, found, "a finite number belongs here: export the file again")
    return float(found)


def array_of(found: Any, shape: tuple[int, ...], path: Path, field: str) -> np.ndarray:
    """Nested lists of numbers as an array of this shape, in which one -1 stands for any length."""
    flat: list[float] = []
    _collect(found, len(shape), flat, path, field)
    try:
        out = np.array(flat).reshape(shape)
    except ValueError:
        size = " x ".join("any" if n < 0 else str(n) for n in shape)
        raise capture_error(path, field, found, f"{size} numbers belong here: export the file again") from None
    return out


def _collect(found: Any, depth: int, flat: list[float], path: Path, field: str) -> None:
    if depth == 0:
        flat.append(number_of(found, path, field))
    elif isinstance(found, list) and len(found) < 100:
        for item in found:
            _collect(item, depth - 1, flat, path, field)
    else:
        raise capture_error(path, field, found, "a list of numbers belongs here: export the file again")


def words_of(text: str | None, count: int, path: Path, field: str) -> np.ndarray:
    """`count` numbers with blanks between them."""
    words = (text or "").split()
    if len(words) != count:
        raise capture_error(path, field, text or "", f"{count} numbers belong here: export the file again")
    return np.array([finite_float(word, path, field) for word in words])


def rigid(turn: np.ndarray, centre: np.ndarray, path: Path, field: str) -> np.ndarray:
    """camera_from_world, 4x4, from the turn camera_from_world (3, 3) and the camera's centre in world (3,).

    Raises
    ------
    CaptureError
        If the turn is not one, or a number is absurd.
    """
    sound = np.abs(turn).max() < 2 and np.allclose(turn @ turn.T, np.eye(3), atol=TURN_TOLERANCE)
    if not sound or np.linalg.det(turn) < 0:
        raise capture_error(path, f"{field} rotation", turn.tolist(), "not a rotation: export the file again")
    if not (np.abs(centre) < LARGEST_NUMBER).all():
        raise capture_error(path, f"{field} position", centre.tolist(), "not a place: export the file again")
    u, _, vt = np.linalg.svd(turn)
    pose = np.eye(4)
    pose[:3, :3] = u @ vt
    pose[:3, 3] = -pose[:3, :3] @ centre
    return pose


def read_json(path: Path) -> Fields:
    """The object that a JSON file holds."""
    text = "\n".join(read_lines(path))
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise capture_error(path, "JSON", " ".join(str(error).split()), "export the file again") from None
    return Fields(content, path, "")


def read_xml(path: Path) -> ElementTree.Element:
    """The root of an XML file without entities of its own, which no camera file has and which can grow without end."""
    data = read_bytes(path)
    plain = data.replace(b"\0", b"")  # as it is in UTF-16, too
    if b"<!DOCTYPE" in plain or b"<!ENTITY" in plain:
        raise capture_error(path, "XML", "<!DOCTYPE", "no camera file has a document type: export the file again")
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise capture_error(path, "XML", " ".join(str(error).split()), "export the file again") from None
