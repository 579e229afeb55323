"""From a folder of files to views and an oriented cloud."""

from kerfwright.capture.camera import Camera
from kerfwright.capture.folder import open_capture
from kerfwright.capture.prepare import PrepareOptions, crop_options, prepare
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.capture.write import write_colmap_text, write_ply

__all__ = [
    "Camera", "Capture", "Cloud", "PrepareOptions", "View", "crop_options", "open_capture", "prepare",
    "write_colmap_text", "write_ply",
]
