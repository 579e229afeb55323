"""Curves: from a traced boundary to the lines, arcs, circles and cubics of a cut path.

Read in order: samples, snap, candidates, prices, ranges, chain, start, shape, solve, search, bumps, relations,
polish, path, fit.
"""

from kerfwright.refine.curves.fit import fit_curves, fit_cut_path
from kerfwright.refine.curves.options import CurveFit, CurveOptions, EdgeStatistics

__all__ = ["CurveFit", "CurveOptions", "EdgeStatistics", "fit_curves", "fit_cut_path"]
