"""How rough boards meet, and what that says about their cut paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from kerfwright.identify.types import Sheet
from kerfwright.model import Contact, Finding

__all__ = ["Assembly", "ConstraintSegment"]


@dataclass(frozen=True, eq=False)
class ConstraintSegment:
    """A straight stretch that a board's cut path must follow and not cross (paper, Interface surfaces & constraints).

    Board frame, mm. The material lies on the left of start -> end; the half-plane on the right is excluded for points
    that project between start and end.
    """

    start: np.ndarray  # (2,)
    end: np.ndarray  # (2,)
    origin: Literal["contact", "corner", "ground", "photo"]
    standard_error: float  # of its position across itself, mm
    normal: np.ndarray | None = None  # (3,) outward normal of the cut face, board frame; None for a square cut
    depth: float = 0.0  # z at which the line start-end lies on the cut face; matters when it is slanted
    contact: int | None = None  # index in Assembly.contacts


@dataclass(frozen=True, eq=False)
class Assembly:
    """Boards, contacts and constraint segments; `constraints[i]` belongs to `sheets[i]`."""

    sheets: tuple[Sheet, ...]
    contacts: tuple[Contact, ...]
    constraints: tuple[tuple[ConstraintSegment, ...], ...]
    findings: tuple[Finding, ...] = ()
