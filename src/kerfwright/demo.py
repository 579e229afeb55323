"""The capture that ships with kerfwright."""

from __future__ import annotations

from pathlib import Path

from kerfwright.errors import CaptureError

__all__ = ["demo_capture"]


def demo_capture() -> Path:
    """Folder of the shipped capture: inside the package when installed, beside `src` in a checkout.

    Raises CaptureError when neither is there.
    """
    package = Path(__file__).resolve().parent
    for folder in (package / "fixtures" / "stool", package.parents[1] / "fixtures" / "stool"):
        if folder.is_dir():
            return folder
    raise CaptureError(f"{package}: fixtures/stool: not there: install kerfwright again, or run from its whole source")
