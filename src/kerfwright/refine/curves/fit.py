"""Fit a board's cut path to its traced boundary: the stage's entry (paper, Constrained Curve Fitting)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.errors import StageError
from kerfwright.model import CutPath, Loop
from kerfwright.refine.curves.bumps import without_bumps
from kerfwright.refine.curves.candidates import find_candidates
from kerfwright.refine.curves.chain import Chain, best_chain, unit_price
from kerfwright.refine.curves.nearly import with_straight_edges
from kerfwright.refine.curves.options import CurveFit, CurveOptions, EdgeStatistics
from kerfwright.refine.curves.path import check_path, full_circle, loop_of_shape
from kerfwright.refine.curves.polish import polish
from kerfwright.refine.curves.ranges import fit_circle
from kerfwright.refine.curves.samples import Samples, resample
from kerfwright.refine.curves.search import improve
from kerfwright.refine.curves.snap import GuideLine, Run, find_runs, guide_lines
from kerfwright.refine.curves.solve import Fit, solve
from kerfwright.refine.curves.start import first_shape
from kerfwright.refine.curves.tidy import without_slivers, without_straight_nodes
from kerfwright.refine.types import BoundaryLoop

__all__ = ["fit_curves", "fit_cut_path"]


@dataclass(frozen=True, eq=False)
class _LoopFit:
    """What came out for one loop: a circle or a fitted chain."""

    samples: Samples
    fit: Fit | None
    circle: tuple[np.ndarray, float, float] | None
    bumps: tuple[np.ndarray, ...] = ()  # where the boundary was not believed


def fit_cut_path(
    loops: Sequence[BoundaryLoop], constraints: Sequence[ConstraintSegment] = (), options: CurveOptions | None = None
) -> CutPath:
    """The cut path alone; see `fit_curves`."""
    return fit_curves(loops, constraints, options).path


def fit_curves(
    loops: Sequence[BoundaryLoop], constraints: Sequence[ConstraintSegment] = (), options: CurveOptions | None = None
) -> CurveFit:
    """Lines, arcs, circles and cubics that explain a traced boundary at the least cost, on constraint segments exactly.

    Parameters
    ----------
    loops : sequence of BoundaryLoop
        The outer loop first, then holes; board frame, mm.
    constraints : sequence of ConstraintSegment
        Segments that the path follows where the boundary runs along them; material on their left.
    options : CurveOptions, optional

    Raises
    ------
    StageError
        If a loop is degenerate or the result would cross itself.
    """
    options = options or CurveOptions()
    if not loops:
        raise StageError("boundary: loops: none found: nothing to fit a cut path to")
    centre = np.mean(np.asarray(loops[0].points, float), axis=0)
    segments = [replace(s, start=np.asarray(s.start) - centre, end=np.asarray(s.end) - centre) for s in constraints]
    guides = guide_lines(segments)
    fits = [_fit_loop(_shifted(loop, -centre), guides, options) for loop in loops]
    polished, relations = _polished(fits, guides, options)
    try:
        return _result(polished, loops, guides, centre, relations)
    except StageError:
        if not relations:
            raise
        plain = _result(fits, loops, guides, centre, ())
        return replace(
            plain, notes=(*plain.notes, "relations between edges made the path cross itself and were left out")
        )


def _polished(
    fits: list[_LoopFit], guides: list[GuideLine], options: CurveOptions
) -> tuple[list[_LoopFit], tuple[str, ...]]:
    """All loops but full circles with their relations made exact, if they are to be."""
    if not options.use_relations:
        return fits, ()
    chains = [i for i, fit in enumerate(fits) if fit.fit is not None]
    better, relations = polish([fits[i].fit for i in chains], [fits[i].samples for i in chains], guides, options)
    better = [without_straight_nodes(f, fits[i].samples) for i, f in zip(chains, better, strict=True)]
    swapped = dict(zip(chains, better, strict=True))
    return [replace(fit, fit=swapped.get(i)) for i, fit in enumerate(fits)], relations


def _shifted(loop: BoundaryLoop, by: np.ndarray) -> BoundaryLoop:
    return replace(loop, points=np.asarray(loop.points, float) + by)


def _fit_loop(loop: BoundaryLoop, guides: list[GuideLine], options: CurveOptions) -> _LoopFit:
    samples = resample(loop, options.correlation_length, options.doubtful)
    runs = find_runs(samples, guides, options)
    centre, radius, chi2 = fit_circle(samples)
    price = unit_price(samples, options)
    if not runs and chi2 < samples.observations + 3 * np.sqrt(2 * samples.observations):
        return _LoopFit(samples, None, (centre, radius, chi2))
    chain = _chain(samples, runs, guides, options)
    if not runs and chi2 + 3 * price < chain.cost:
        return _LoopFit(samples, None, (centre, radius, chi2))
    shape = first_shape(chain, samples, guides, options)
    fit = improve(solve(shape, samples, guides), samples, guides, options)
    fit, samples, bumps = without_bumps(fit, samples, guides, options)
    fit = without_slivers(fit, samples, guides, options)
    fit, samples = with_straight_edges(fit, samples, guides, options)
    return _LoopFit(samples, fit, None, tuple(bumps))


def _chain(samples: Samples, runs: list[Run], guides: list[GuideLine], options: CurveOptions) -> Chain:
    blocked = np.zeros(samples.count, bool)
    for run in runs:
        blocked[np.arange(run.first + 1, run.last) % samples.count] = True
    nodes = find_candidates(samples, _forced(runs, samples), blocked, options)
    chain = best_chain(samples, nodes, runs, guides, options)
    if chain is None:
        raise StageError(f"boundary loop of {samples.length:.1f} mm: no chain of edges fits: trace it again")
    return chain


def _forced(runs: list[Run], samples: Samples) -> np.ndarray:
    """Ends of constrained runs, and the middles of short gaps between them, where corners are."""
    found = [i for run in runs for i in (run.first, run.last)]
    for k, run in enumerate(runs):
        gap = (runs[(k + 1) % len(runs)].first - run.last) % samples.count
        if gap * samples.spacing < 30.0:
            found.append(run.last + gap // 2)
    return np.array(found, int)


def _result(
    fits: list[_LoopFit],
    loops: Sequence[BoundaryLoop],
    guides: list[GuideLine],
    centre: np.ndarray,
    relations: tuple[str, ...],
) -> CurveFit:
    made = [_finish(fit, loop, guides, centre) for fit, loop in zip(fits, loops, strict=True)]
    path = CutPath(outer=made[0][0], holes=tuple(loop for loop, _ in made[1:]))
    check_path(path)
    return CurveFit(
        path,
        tuple(_bump_note(place + centre) for fit in fits for place in fit.bumps),
        sum(fit.fit.chi2 if fit.fit else fit.circle[2] for fit in fits),
        sum(fit.samples.observations for fit in fits),
        tuple(statistics for _, statistics in made),
        relations,
    )


def _bump_note(place: np.ndarray) -> str:
    return f"a bump of the boundary near ({place[0]:.0f}, {place[1]:.0f}) mm was taken for an artefact and left out"


def _finish(
    found: _LoopFit, loop: BoundaryLoop, guides: list[GuideLine], centre: np.ndarray
) -> tuple[Loop, tuple[EdgeStatistics, ...]]:
    if found.circle is not None:
        middle, radius, chi2 = found.circle
        sigma = float(np.sqrt(np.mean(found.samples.sigma**2)))
        error = sigma * np.sqrt(max(1.0, chi2 / found.samples.observations) / found.samples.observations)
        rms = sigma * np.sqrt(chi2 / found.samples.observations)
        statistics = EdgeStatistics(2 * np.pi * radius, float(rms), float(error), None)
        return full_circle(middle + centre, radius, loop.is_hole, float(error)), (statistics,)
    shape = found.fit.shape
    statistics = tuple(_statistics(found.fit, found.samples, guides, k) for k in range(shape.count))
    return loop_of_shape(shape, [s.standard_error for s in statistics], centre), statistics


def _statistics(fit: Fit, samples: Samples, guides: list[GuideLine], k: int) -> EdgeStatistics:
    from kerfwright.refine.curves.shape import residuals

    shape = fit.shape
    mine = np.flatnonzero(fit.edge == k)
    length = len(mine) * samples.spacing
    rms = float(np.sqrt(np.mean(fit.distance[mine] ** 2))) if len(mine) else 0.0
    if shape.lines[k] >= 0:
        guide = guides[shape.lines[k]]
        return EdgeStatistics(length, rms, guide.standard_error, guide.segment)
    if not len(mine):
        return EdgeStatistics(length, rms, float(samples.sigma.mean()), None)
    _, slope = residuals(shape, k, samples.points[mine])
    columns = shape.columns(k)
    variance = np.einsum("mc,cd,md->m", slope, fit.covariance[np.ix_(columns, columns)], slope).mean()
    excess = max(1.0, float(np.mean((fit.distance[mine] / samples.sigma[mine]) ** 2)))
    return EdgeStatistics(length, rms, float(np.sqrt(max(variance, 0.0) * excess)), None)
