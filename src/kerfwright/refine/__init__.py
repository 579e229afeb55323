"""From rough boards to exact ones: outlines from photographs, curves, and the boards of the model (paper, Geometry
Refinement).
"""

from __future__ import annotations

from kerfwright.assemble.types import Assembly
from kerfwright.capture.types import Capture
from kerfwright.identify.types import Parts
from kerfwright.refine.options import Refined, RefineOptions
from kerfwright.refine.types import BoundaryLoop, Outline

__all__ = ["BoundaryLoop", "Outline", "RefineOptions", "Refined", "refine"]


def refine(assembly: Assembly, parts: Parts, capture: Capture, options: RefineOptions | None = None) -> Refined:
    """Trace every board in the photographs, find the contacts again with what they show, and fit the cut paths.

    Raises StageError when a cut path cannot be fitted.
    """
    from kerfwright.refine.alternate import refined_assembly
    from kerfwright.refine.finish import finished

    options = options or RefineOptions()
    outlines, assembly = refined_assembly(assembly, parts, capture, options)
    return finished(outlines, assembly, capture, options)
