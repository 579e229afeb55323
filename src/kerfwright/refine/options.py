"""Options and result of refinement."""

from __future__ import annotations

from dataclasses import dataclass, field

from kerfwright.assemble import Stock
from kerfwright.model import Board, Contact, Finding

__all__ = ["RefineOptions", "Refined"]


@dataclass(frozen=True)
class RefineOptions:
    """What refinement may be told; lengths are fractions of the cloud's largest side D."""

    use_images: bool = True  # false: cut paths come from the cloud alone
    use_constraints: bool = True  # false: cut paths follow what was traced, neither contacts nor relations of edges
    use_seams: bool = True  # false: boards glued edge to edge stay one
    views_a_board: int = 7  # photographs (paper, Joint Image-Based Segmentation)
    boundary_step: float = 1 / 450  # spacing of boundary points handed to curve fitting
    stock: Stock = field(default_factory=Stock)  # thicknesses to snap to, in the stages' units
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Refined:
    """Finished boards, the contacts between them, and what was noticed."""

    boards: tuple[Board, ...]
    contacts: tuple[Contact, ...]
    findings: tuple[Finding, ...] = ()
    scale_factor: float | None = None  # that measured lengths gave before thicknesses were snapped at it
