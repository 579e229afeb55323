"""From a folder of files to views and an oriented cloud."""

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import Capture, Cloud, View

__all__ = ["Camera", "Capture", "Cloud", "View"]
