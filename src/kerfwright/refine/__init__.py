"""From rough boards to exact ones: outlines from photographs, curves, and the boards of the model (paper, Geometry
Refinement).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from kerfwright.assemble.types import Assembly
from kerfwright.capture.types import Capture
from kerfwright.identify.types import Parts
from kerfwright.refine.options import Refined, RefineOptions
from kerfwright.refine.types import BoundaryLoop, Outline

if TYPE_CHECKING:
    from kerfwright.refine.alternate import Piece

__all__ = ["BoundaryLoop", "Outline", "RefineOptions", "Refined", "fit_traced", "refine", "trace"]


def refine(assembly: Assembly, parts: Parts, capture: Capture, options: RefineOptions | None = None) -> Refined:
    """Trace every board in the photographs, find the contacts again with what they show, and fit the cut paths.

    Raises StageError when a cut path cannot be fitted.
    """
    options = options or RefineOptions()
    return fit_traced(trace(assembly, parts, capture, options), parts, capture, options)


def trace(assembly: Assembly, parts: Parts, capture: Capture, options: RefineOptions) -> tuple[Piece, ...]:
    """The first half of `refine`: every board's outline in the photographs."""
    from kerfwright.refine.alternate import traced_pieces

    return traced_pieces(assembly, parts, capture, options)


def fit_traced(pieces: Sequence[Piece], parts: Parts, capture: Capture, options: RefineOptions) -> Refined:
    """The second half: contacts found again, and cut paths. `options.stock` may be another than when tracing."""
    from kerfwright.refine.alternate import assembled_again
    from kerfwright.refine.finish import finished

    outlines, assembly = assembled_again(pieces, parts, capture, options)
    return finished(outlines, assembly, capture, options)
