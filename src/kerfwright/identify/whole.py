"""Boards made whole: what the cloud shows in part goes on to where other boards, or the photographs, say it ends.

Selection knows that a board is there; its region stops where stereo does. Pieces of one board are joined, boards in the
dark are run on to what they end on, hidden faces are put where the board that hides them begins, and boards side by
side that stereo joined over the gap between them are parted.
"""

from __future__ import annotations

from collections.abc import Sequence

from kerfwright.capture.types import Cloud
from kerfwright.identify.align import align_sheets
from kerfwright.identify.crossings import crossings_settled
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.gaps import filled_out, mended
from kerfwright.identify.grooves import parted
from kerfwright.identify.laid import laid_on
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.rags import pieced_together
from kerfwright.identify.reaching import Scene
from kerfwright.identify.run_on import run_on
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles

__all__ = ["whole_boards"]


def whole_boards(
    sheets: Sequence[Sheet], cloud: Cloud, photos: Photos, free: FreeSpace, options: WholeOptions
) -> tuple[tuple[Sheet, ...], tuple[tuple[str, str], ...]]:
    """The boards, as far as they go and as thick as they are; and by name, who was run on to whom: (a, b) for b to a.

    Their sheet planes are aligned first: over the length of a board in the dark, half a degree is millimetres.
    Raises StageError when the alignment does not converge.
    """
    whole, _ = align_sheets(tuple(sheets), cloud, options)
    whole = pieced_together(whole, cloud, free, options)
    whole = crossings_settled(whole, cloud, photos, Obstacles(whole, options.outline_error * cloud.diameter))
    whole = mended(laid_on(whole, cloud, free, options), cloud, free, options)
    ends: set[tuple[str, str]] = set()
    for _ in range(options.passes):
        obstacles = Obstacles(whole, options.outline_error * cloud.diameter)
        whole, joints = run_on(Scene(whole, cloud, photos, obstacles, free, options))
        ends |= {(whole[j.a].name, whole[j.b].name) for j in joints}
    pieces, names = parted(filled_out(whole, cloud, free, options), cloud)
    return pieces, tuple(sorted((a, b) for one, other in ends for a in names[one] for b in names[other]))
