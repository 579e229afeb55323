"""Cut paths of straight lines: what is left where curves make no sound path."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from kerfwright.model.cutpath import CutPath, Line, Loop

if TYPE_CHECKING:
    from shapely.geometry import Polygon

__all__ = ["polygon_path"]

SHORTEST = 1e-3  # mm; OCCT makes no edge of less


def polygon_path(region: Polygon, tolerance: float) -> CutPath:
    """A polygon's rings as lines, simplified to a tolerance in mm; of one that crosses itself the largest piece.

    Raises
    ------
    ValueError
        If nothing of the polygon is as wide as OCCT's shortest edge.
    """
    import shapely
    from shapely.geometry.polygon import orient

    plain = shapely.set_precision(region.simplify(tolerance), SHORTEST).buffer(0)
    plain = orient(max(getattr(plain, "geoms", [plain]), key=lambda p: p.area))
    if plain.is_empty:
        raise ValueError(f"region of {region.area:g} mm2: nothing is left of it on a grid of {SHORTEST:g} mm")
    loops = []
    for ring in (plain.exterior, *plain.interiors):
        points = [tuple(map(float, p)) for p in ring.coords]
        loops.append(Loop(edges=tuple(Line(start=a, end=b) for a, b in pairwise(points))))
    return CutPath(outer=loops[0], holes=tuple(loops[1:]))
