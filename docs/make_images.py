"""Make the pictures of the documentation from a finished reconstruction.

    kerfwright demo
    python docs/make_images.py fixtures/stool kerfwright-demo IMG_0010.jpg docs/images/stool.png

Left the boards' outlines over the photograph, right the boards shaded.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from kerfwright.capture import open_capture
from kerfwright.capture.frame import moved
from kerfwright.model.io import read_model
from kerfwright.report.meshes import board_meshes
from kerfwright.report.overlay import draw, outlined, shaded
from kerfwright_exporters.naming import board_colours

HEIGHT = 560  # pixels
COLOURS = 256  # of the palette: a third of the size, and no difference to see


def main() -> None:
    """Read the command line and go."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("capture", "out"):
        parser.add_argument(name, type=Path)
    parser.add_argument("view")
    parser.add_argument("picture", type=Path)
    options = parser.parse_args()
    model = read_model(options.out / "model.json")
    capture = moved(open_capture(options.capture), np.linalg.inv(np.array(model.capture_from_model)))
    view = next(v for v in capture.views if v.name == options.view)
    photo, drawing = view.image(), draw(board_meshes(model), view)
    both = (outlined(photo, drawing), shaded(photo, drawing, board_colours(model)))
    options.picture.parent.mkdir(parents=True, exist_ok=True)
    _write(options.picture, np.hstack([_cropped(picture, drawing.board_idx) for picture in both]))


def _cropped(picture: np.ndarray, board_idx: np.ndarray) -> np.ndarray:
    """What lies round the boards, at HEIGHT."""
    rows, columns = np.nonzero(board_idx >= 0)
    margin = (rows.max() - rows.min()) // 8
    top, bottom = max(0, rows.min() - margin), rows.max() + margin
    left, right = max(0, columns.min() - 2 * margin), columns.max() + 2 * margin
    part = picture[top:bottom, left:right]
    return cv2.resize(part, (round(part.shape[1] * HEIGHT / part.shape[0]), HEIGHT), interpolation=cv2.INTER_AREA)


def _write(path: Path, picture: np.ndarray) -> None:
    """A PNG of few colours."""
    from PIL import Image

    Image.fromarray(picture).quantize(COLOURS).save(path, optimize=True)


if __name__ == "__main__":
    main()
