"""What a person may choose about the files."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Literal

from kerfwright.errors import OptionError

__all__ = ["ExportOptions"]


@dataclass(frozen=True)
class ExportOptions:
    """Options of all exporters; each reads those that concern it. Lengths in mm.

    Raises
    ------
    OptionError
        If a value makes no sense.
    """

    units: Literal["mm", "in"] = "mm"  # of DXF, SVG and cut list; the other formats are millimetres always
    unverified: bool = False  # stamp the files NOT VERIFIED
    arc_tolerance: float = 0.05  # how far the arcs that stand for a Bezier may stray from it
    splines: bool = False  # write Beziers as splines, not as arcs
    layers: Literal["plain", "depth", "numbered"] = "plain"  # how DXF and SVG call their layers
    kerf: float = 0.0  # width of the cut; above 0 the path of the tool's centre is drawn beside the original
    relief: Literal["none", "dogbone", "tbone"] = "none"  # in inside corners
    tool_diameter: float = 6.0  # of the bit that makes the relief
    sheet_length: float = 2440.0  # of the stock sheets, along the grain
    sheet_width: float = 1220.0
    sheet_margin: float = 10.0  # of a sheet's border that is not used
    spacing: float = 6.0  # between boards on a sheet; the kerf, where that is wider
    grain: bool = False  # keep every board's x axis along the grain, which runs along the sheet
    mesh_tolerance: float = 0.1  # chord error of triangle meshes

    def __post_init__(self) -> None:
        self._choose("units", "mm", "in")
        self._choose("layers", "plain", "depth", "numbered")
        self._choose("relief", "none", "dogbone", "tbone")
        for name in ("arc_tolerance", "mesh_tolerance", "tool_diameter"):
            self._require(name, 0.0, inclusive=False)
        for name in ("sheet_length", "sheet_width"):
            self._require(name, 2 * max(0.0, self.sheet_margin), inclusive=False)
        for name in ("kerf", "sheet_margin", "spacing"):
            self._require(name, 0.0)
        if self.kerf and self.splines:
            raise OptionError("splines: True: a spline has no exact path beside it: give either kerf or splines")

    def _choose(self, name: str, *choices: str) -> None:
        if getattr(self, name) not in choices:
            raise OptionError(f"{name}: {getattr(self, name)!r}: choose {' or '.join(choices)}")

    def _require(self, name: str, least: float, *, inclusive: bool = True) -> None:
        value = getattr(self, name)
        sound = (
            isinstance(value, int | float) and math.isfinite(value) and (value >= least if inclusive else value > least)
        )
        if not sound:
            raise OptionError(f"{name}: {value!r}: give a number {'of at least' if inclusive else 'above'} {least:g}")

    @property
    def per_unit(self) -> float:
        """Millimetres in one unit of the file."""
        return 25.4 if self.units == "in" else 1.0

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of all options, sorted."""
        return tuple(sorted(f.name for f in fields(cls)))
