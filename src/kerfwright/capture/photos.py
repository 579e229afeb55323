"""Photographs in memory: decoded once for all stages, and no larger than a laptop holds."""

from __future__ import annotations

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from kerfwright.capture.types import Capture, View

__all__ = ["lightened", "photograph"]

MOST_BYTES = 3 << 28  # of all photographs together, decoded: .75 GiB

_DECODED: WeakKeyDictionary[View, np.ndarray] = WeakKeyDictionary()


def photograph(view: View) -> np.ndarray:
    """The view's photograph, (height, width, 3) uint8 RGB, kept as long as the view is; not to be written to."""
    pixels = _DECODED.get(view)
    if pixels is None:
        pixels = _DECODED[view] = view.image()
    return pixels


def lightened(capture: Capture, most_bytes: int = MOST_BYTES) -> Capture:
    """The capture with its photographs shrunk by one whole factor, if all of them take more than so many bytes."""
    total = sum(3 * v.camera.width * v.camera.height for v in capture.views)
    factor = int(np.ceil(np.sqrt(total / most_bytes))) if total else 1
    if factor <= 1:
        return capture
    views = tuple(replace(v, camera=v.camera.scaled(1 / factor), shrink=factor) for v in capture.views)
    note = (
        f"the {len(views)} photographs take {total / 2**30:.1f} GiB of memory: of each, {factor} x {factor} pixels are "
        "averaged to one"
    )
    return replace(capture, views=views, notes=(*capture.notes, note))
