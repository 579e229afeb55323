"""The report's photographs with the model drawn over them."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.report.meshes import BoardMesh
from kerfwright.report.overlay import LINE_COLOUR, draw, shaded
from kerfwright.report.views import scaled

if TYPE_CHECKING:
    from kerfwright.capture.types import View

__all__ = ["photographs_section"]

PHOTO_WIDTH = 900  # pixels; two photographs side by side on a common screen
JPEG_QUALITY = 80
Colour = tuple[float, float, float]


def photographs_section(views: Iterable[View], meshes: Sequence[BoardMesh], colours: Sequence[Colour]) -> str:
    figures = [_figure(view, meshes, colours) for view in views]
    if not figures:
        return ""
    return (
        '<h2>Over the photographs</h2><div class="controls"><label>drawing <select id="style">'
        '<option value="outline">outline</option><option value="shaded">shaded</option></select></label>'
        '<label>strength <input type="range" id="blend" min="0" max="1" step="0.01" value="1"></label>'
        '<label><input type="checkbox" id="blink"> blink</label></div>'
        f'<div class="photos">{"".join(figures)}</div>'
    )


def _figure(view: View, meshes: Sequence[BoardMesh], colours: Sequence[Colour]) -> str:
    small, photo = scaled(view, view.image(), PHOTO_WIDTH)
    drawing = draw(meshes, small)
    lines = np.empty((*drawing.lines.shape, 4), np.uint8)
    lines[..., :3], lines[..., 3] = LINE_COLOUR, np.round(255 * drawing.lines)
    name = escape(view.name)
    return (
        f'<figure><div class="layers"><img src="{_image(photo, ".jpg")}" alt="{name}">'
        f'<img class="outline" src="{_image(lines, ".png")}" alt="outlines of the boards">'
        f'<img class="shaded" src="{_image(shaded(photo, drawing, colours), ".jpg")}" alt="the boards, shaded"></div>'
        f"<figcaption>{name}</figcaption></figure>"
    )


def _image(pixels: np.ndarray, kind: str) -> str:
    """RGB or RGBA pixels as a data address."""
    import cv2

    settings = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY] if kind == ".jpg" else [cv2.IMWRITE_PNG_COMPRESSION, 9]
    order = [2, 1, 0] if pixels.shape[2] == 3 else [2, 1, 0, 3]
    _, data = cv2.imencode(kind, pixels[..., order], settings)
    media = "image/jpeg" if kind == ".jpg" else "image/png"
    return f"data:{media};base64,{base64.b64encode(data.tobytes()).decode('ascii')}"
