"""What stages can depend on of a capture: its views, their photographs' bytes, and its cloud."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from kerfwright.capture.parsing import capture_error
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.model import Scale

__all__ = ["content_hash", "unscaled"]


def unscaled(capture: Capture) -> Capture:
    """The capture without what only the model needs: its name, its scale, its place in the files' frame, and notes."""
    nowhere = Scale(millimetres_per_unit=1.0, origin="assumed")
    return replace(capture, name="", scale=nowhere, capture_from_world=np.eye(4), notes=())


def content_hash(capture: Capture) -> str:
    """Hash of all that a capture holds, the bytes of its photographs included.

    Raises
    ------
    CaptureError
        If a photograph cannot be read.
    """
    rest = (capture.name, capture.scale, capture.capture_from_world.tolist(), capture.notes)
    return hashlib.sha256(f"{_seen_hash(capture.views, capture.cloud)} {rest}".encode()).hexdigest()


@lru_cache(maxsize=2)  # with the photographs and without
def _seen_hash(views: tuple[View, ...], cloud: Cloud) -> str:
    total = hashlib.sha256()
    for view in views:
        fields = (view.name, str(view.path), view.camera, view.camera_from_world.tolist(), view.shrink)
        total.update(f"{fields} {_file_hash(view.path)}\n".encode("utf-8", "surrogateescape"))
    for rows in (cloud.points, cloud.normals, cloud.colours):
        if rows is not None:
            total.update(f"{rows.dtype} {rows.shape}\n".encode() + np.ascontiguousarray(rows).tobytes())
    return total.hexdigest()


def _file_hash(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise capture_error(path, "image", error.strerror, "make it readable or take it away") from error
