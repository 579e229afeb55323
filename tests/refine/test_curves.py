"""Fitting cut paths to synthetic boundaries."""

import numpy as np
import pytest

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.errors import StageError
from kerfwright.model import Origin
from kerfwright.refine.curves import fit_curves, fit_cut_path
from kerfwright.refine.types import BoundaryLoop


def rectangle_boundary(w=200.0, h=100.0, cut_corner=0.0, noise=0.0, seed=0):
    corners = np.array([(0, 0), (w, 0), (w, h - cut_corner), (w - cut_corner, h), (0, h)], float)
    if not cut_corner:
        corners = np.array([(0, 0), (w, 0), (w, h), (0, h)], float)
    sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    points = np.vstack([np.linspace(a, b, max(2, int(np.linalg.norm(b - a))), endpoint=False) for a, b in sides])
    points = points + noise * np.random.default_rng(seed).normal(size=points.shape)
    return BoundaryLoop(points, np.full(len(points), 0.5))


def segment(a, b, error=0.2):
    return ConstraintSegment(np.array(a, float), np.array(b, float), "contact", error)


def test_constrained_corner_closes_though_the_boundary_cuts_it_off():
    right, top = segment((200.3, 10), (200.3, 80)), segment((150, 100.4), (20, 100.4))
    path = fit_cut_path([rectangle_boundary(cut_corner=5.0)], [right, top])
    assert len(path.outer.edges) == 4
    assert min(np.hypot(e.start[0] - 200.3, e.start[1] - 100.4) for e in path.outer.edges) < 1e-9
    assert sum(e.origin == Origin.IMPLIED for e in path.outer.edges) == 2


def test_edges_share_their_end_points_to_the_last_bit():
    path = fit_cut_path([rectangle_boundary(noise=0.2)])
    edges = path.outer.edges
    assert all(edges[k - 1].end == edges[k].start for k in range(len(edges)))


def test_segment_that_the_boundary_does_not_follow_is_ignored():
    fit = fit_curves([rectangle_boundary()], [segment((194, 10), (194, 80), 0.1)])
    assert all(s.constraint is None for s in fit.edges[0])


def test_too_few_points_are_refused():
    with pytest.raises(StageError, match="at least 3"):
        fit_cut_path([BoundaryLoop(np.array([(0.0, 0.0), (1.0, 0.0)]), np.full(2, 0.5))])
