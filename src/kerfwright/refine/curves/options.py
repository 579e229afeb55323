"""Options and results of curve fitting."""

from __future__ import annotations

from dataclasses import dataclass

from kerfwright.errors import OptionError
from kerfwright.model import CutPath

__all__ = ["CurveFit", "CurveOptions", "EdgeStatistics"]


@dataclass(frozen=True)
class CurveOptions:
    """What curve fitting takes for granted; lengths in mm.

    Attributes
    ----------
    correlation_length : float
        Distance along the boundary over which its errors lose their memory (autocorrelation exp(-(d/l)^2)). Two
        correlation lengths of boundary count as one independent observation.
    doubtful : float
        Where standard errors are beyond this many times the usual one the photographs contradict each other: what was
        traced there may be another edge, not this one with noise, and a path may leave it out for a bounded price.
    complexity : float
        Price of a degree of freedom, as a multiple of the Bayesian information criterion's ln(n).
    shortest_edge : float
        Edges shorter than this are not looked for.
    snap_sigmas : float
        A boundary point follows a constraint segment within this many standard errors, its own and the segment's
        combined.
    snap_angle : float
        Radians between boundary and constraint segment that count as following it: beyond, the boundary leaves it.
    corner_reach : float
        How far a corner of two lines may lie from the traced boundary, which rounds or misses corners.
    sharp_angle : float
        Radians; nodes that turn less are smooth or not nodes at all (paper, Constrained Curve Fitting: 10 degrees).
    bump_length, bump_depth : float
        A stretch that leaves a line, comes back to it, and is neither longer nor deeper nor has steep sides is an
        artefact of the boundary (a shadow), not a shape. Notches have steep sides and stay.
    easing, straight_length : float
        A stretch between sharp corners, at least so long, that stays so near to one line is that line unless it bows
        evenly: eased edges show two lines, and the boundary changes between them.
    relation_rise : float
        A relation (parallel, equal radius, ...) is kept if chi-square rises by at most this for each degree of
        freedom it takes away.
    max_candidates : int
        Bound on the nodes that dynamic programming chooses from.
    use_relations : bool
        Whether relations that the data supports are made exact.
    """

    correlation_length: float = 5.0
    doubtful: float = 2.0
    complexity: float = 1.0
    shortest_edge: float = 5.0
    snap_sigmas: float = 5.0
    snap_angle: float = 0.45
    corner_reach: float = 12.0
    sharp_angle: float = 0.175
    bump_length: float = 40.0
    bump_depth: float = 5.0
    easing: float = 1.5
    straight_length: float = 60.0
    relation_rise: float = 6.6
    max_candidates: int = 72
    use_relations: bool = True

    def __post_init__(self) -> None:
        for name in ("correlation_length", "complexity", "shortest_edge", "snap_sigmas", "max_candidates"):
            if not getattr(self, name) > 0:
                raise OptionError(f"CurveOptions: {name}: {getattr(self, name)}: give a number above 0")


@dataclass(frozen=True)
class EdgeStatistics:
    """How one edge fits its stretch of boundary; mm."""

    length: float
    rms: float
    standard_error: float
    constraint: int | None  # index of the constraint segment that it lies on


@dataclass(frozen=True)
class CurveFit:
    """A cut path, what was noticed on the way, and how well it fits.

    `chi2` is over all loops in units of the boundary's standard errors and effective observations (`observations` of
    them); `edges[i][k]` belongs to edge k of loop i, the outer loop first; `relations` names those that hold exactly.
    """

    path: CutPath
    notes: tuple[str, ...]
    chi2: float
    observations: float
    edges: tuple[tuple[EdgeStatistics, ...], ...]
    relations: tuple[str, ...] = ()
