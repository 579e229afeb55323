"""Three boards and eight small views in memory: what unit tests of every stage run on."""

from __future__ import annotations

from functools import lru_cache

from kerfwright.capture import Capture
from kerfwright.model import Model
from kerfwright.synthetic.assemblies import assembled
from kerfwright.synthetic.capture import in_memory
from kerfwright.synthetic.carpentry import slab
from kerfwright.synthetic.options import CaptureOptions, CloudOptions, DatasetOptions, ImageOptions

__all__ = ["tiny_assembly", "tiny_capture"]

TINY = CaptureOptions(
    dataset=DatasetOptions(images=8, width=160, height=120),
    images=ImageOptions(samples=1, texels=0.006, knots=0.0, floor_texels=256, room_nodes=16, light_rays=12),
    cloud=CloudOptions(points=6000, noise=0.03, drift=0.03, fringe=0.02, dropout=0.0),
)


def tiny_assembly() -> Model:
    """A shelf: a board of 300 x 180 x 18 mm on two uprights of 15 mm, 200 mm high."""
    return assembled(
        "tiny",
        [
            slab("top", (-150, -90, 200), (150, 90, 218)),
            slab("left", (-120, -80, 0), (-105, 80, 200)),
            slab("right", (105, -80, 0), (120, 80, 200)),
        ],
    )


@lru_cache(maxsize=4)
def tiny_capture(seed: int = 0) -> Capture:
    """The tiny assembly, photographed: eight views of 160 x 120, 6,000 points; made once a process and seed."""
    return in_memory(tiny_assembly(), TINY.seeded(seed))
