"""First unknowns of a chain: nodes of two lines at their intersection, the others on the boundary."""

from __future__ import annotations

import numpy as np

from kerfwright.refine.curves.chain import GUIDE, Chain
from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.ranges import ARC, CUBIC, LINE
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.shape import Shape
from kerfwright.refine.curves.snap import GuideLine

__all__ = ["chain_ranges", "first_shape", "inner_unknowns"]


def chain_ranges(nodes: tuple[int, ...], count: int) -> tuple[tuple[int, int], ...]:
    """First and last sample of each edge; the last exceeds `count` where an edge runs over the start."""
    following = (*nodes[1:], nodes[0])
    return tuple((a, b if b > a else b + count) for a, b in zip(nodes, following, strict=True))


def first_shape(chain: Chain, samples: Samples, guides: list[GuideLine], options: CurveOptions) -> Shape:
    """A shape with the chain's structure near its best fit."""
    ranges = chain_ranges(chain.nodes, samples.count)
    kinds = tuple(LINE if kind == GUIDE else kind for kind in chain.kinds)
    straight = [
        _line(samples, r, guides, line) if kind == LINE else None
        for r, kind, line in zip(ranges, kinds, chain.lines, strict=True)
    ]
    nodes = [_node(samples.points[a], straight[k - 1], straight[k], options) for k, (a, _) in enumerate(ranges)]
    extras = []
    for k, (kind, span) in enumerate(zip(kinds, ranges, strict=True)):
        extras.extend(inner_unknowns(kind, nodes[k], nodes[(k + 1) % len(nodes)], samples, span))
    return Shape(np.concatenate([*nodes, np.array(extras)]), kinds, chain.lines, chain.smooth, ranges)


def _line(samples: Samples, span: tuple[int, int], guides: list[GuideLine], guide: int) -> tuple[np.ndarray, float]:
    """Normal and offset of a line edge."""
    if guide >= 0:
        return guides[guide].normal, guides[guide].offset
    points = samples.points[np.arange(span[0], span[1] + 1) % samples.count]
    mean = points.mean(axis=0)
    normal = np.linalg.svd(points - mean)[2][-1]
    return normal, float(normal @ mean)


def _node(
    point: np.ndarray, a: tuple[np.ndarray, float] | None, b: tuple[np.ndarray, float] | None, options: CurveOptions
) -> np.ndarray:
    """Where two lines cross if that is near, else the foot on the line there is, else the boundary's point."""
    if a is not None and b is not None:
        system = np.array([a[0], b[0]])
        if abs(np.linalg.det(system)) > np.sin(options.sharp_angle) / 2:
            crossing = np.linalg.solve(system, [a[1], b[1]])
            if np.linalg.norm(crossing - point) < 2 * options.corner_reach:
                return crossing
    line = a if a is not None else b
    return point if line is None else point - (line[0] @ point - line[1]) * line[0]


def inner_unknowns(kind: int, a: np.ndarray, b: np.ndarray, samples: Samples, span: tuple[int, int]) -> list[float]:
    """Bulge of an arc or inner control points of a cubic between two nodes."""
    points = samples.points[np.arange(span[0], span[1] + 1) % samples.count]
    if kind == ARC:
        chord = b - a
        right = np.array([chord[1], -chord[0]]) / max(chord @ chord, 1e-9)
        return [float(2 * (points[len(points) // 2] - (a + b) / 2) @ right)]
    if kind != CUBIC:
        return []
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    t = np.concatenate([[0.0], np.cumsum(step)]) / max(step.sum(), 1e-9)
    basis = np.column_stack([3 * (1 - t) ** 2 * t, 3 * (1 - t) * t**2])
    rest = points - np.outer((1 - t) ** 3, a) - np.outer(t**3, b)
    return np.linalg.lstsq(basis, rest, rcond=None)[0].ravel().tolist()
