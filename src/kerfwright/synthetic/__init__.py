"""Objects that we know everything about: assemblies, photographs and clouds made from a seed."""

from kerfwright.synthetic.assemblies import assembled, random_assembly
from kerfwright.synthetic.capture import in_memory, write_capture
from kerfwright.synthetic.families import FAMILIES
from kerfwright.synthetic.options import PRESETS, CaptureOptions, CloudOptions, DatasetOptions, ImageOptions
from kerfwright.synthetic.tiny import tiny_assembly, tiny_capture

__all__ = [
    "FAMILIES",
    "PRESETS",
    "CaptureOptions",
    "CloudOptions",
    "DatasetOptions",
    "ImageOptions",
    "assembled",
    "in_memory",
    "random_assembly",
    "tiny_assembly",
    "tiny_capture",
    "write_capture",
]
