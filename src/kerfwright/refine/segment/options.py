"""What segmentation may be told, and what it gives back."""

from __future__ import annotations

from dataclasses import dataclass

from kerfwright.parallel import THREADS
from kerfwright.refine.types import Outline

__all__ = ["BoardOutlines", "SegmentOptions"]


@dataclass(frozen=True)
class SegmentOptions:
    """Options of `segment_boards`. Lengths in mm; evidence and smoothness in nats."""

    max_views: int = 7  # photographs a board (paper, Joint Image-Based Segmentation)
    use_images: bool = True  # false: every board keeps the cloud's outline
    rounds: int = 2  # the second learns its colours from the first one's mask
    pixel: float | None = None  # of the rectified images; None: what the photographs support
    min_pixel: float = 0.8  # finer is for the exact boundary, which is read from the photographs themselves
    max_pixel: float = 1.0
    max_grid: int = 700_000  # pixels of a rectified image; larger boards get coarser pixels
    min_visible: float = 0.12  # share of a board's rough region that a view must show to be of use
    min_slant: float = 0.2  # cosine between line of sight and sheet normal below which a view is too grazing
    outline_error: float = 8.0  # a rough outline is taken to be true to this: what is further in or out is known
    search_margin: float = 24.0  # how far beyond the rough outline the board may reach
    unbacked_error: float = 24.0  # the same two where no cut face and no contact backs the outline: stereo spans dark
    unbacked_margin: float = 80.0  # openings with a veil, and loses dark wood
    cut_face_error: float = 2.5  # ... and where cut faces lie right on it: fringe and eased edges
    contact_reach: float = 250.0  # a board known to touch another may be missing up to there: it is dark in corners
    refined_error: float = 4.0  # the same, of a mask after the first round
    components: int = 5  # of a colour mixture
    samples: int = 1500  # pixels that a colour mixture is trained on
    evidence_cap: float = 4.0  # one view says no more than this about one pixel
    wood_share: float = 0.35  # weight of colour where another board is what would show: wood beside wood
    smoothness: float = 3.0
    min_piece: float = 400.0  # mm2; smaller pieces of a mask are specks
    min_piece_share: float = 0.04  # ... as are those smaller than this share of the largest piece
    min_hole: float = 60.0  # mm2
    reach: float = 4.0  # half width of the search for the exact boundary about the mask's
    step: float = 1.0  # between boundary points
    correlated_error: float = 0.08  # what no averaging removes: blur, rounded arrises, the plane's own error
    seed: int = 0
    threads: int = THREADS


@dataclass(frozen=True, eq=False)
class BoardOutlines:
    """The outlines of one rough board: one for each connected piece, largest first."""

    outlines: tuple[Outline, ...]
    views: tuple[str, ...] = ()  # photographs used
    left_out: tuple[str, ...] = ()  # photographs that disagreed with the others
    fallback: str | None = None  # why the cloud's outline was kept; None when the photographs decided
    pixel: float = 0.0  # mm, of the rectified images
    registration: float = 0.0  # largest shift that a view needed, mm
