"""Relations that the data supports, found one after another, then made exact over all loops of a board together.

Whether a relation holds within the uncertainty is asked of the fit's covariance: conditioning on it raises chi-square
by g^2 / (J P J^T) in first order. Accepted relations condition the estimate for those that follow, so that one that
is implied already shows up as having no variance left and adds no redundant equation. The nonlinear solve comes at
the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from kerfwright.refine.curves.options import CurveOptions
from kerfwright.refine.curves.ranges import ARC, CUBIC, LINE
from kerfwright.refine.curves.relations import Relation, evaluate
from kerfwright.refine.curves.samples import Samples
from kerfwright.refine.curves.shape import Shape, equations
from kerfwright.refine.curves.snap import GuideLine
from kerfwright.refine.curves.solve import Fit, constrained_step, normal_equations, taken_stock

__all__ = ["polish"]

MOST_TILT = 0.08  # sine: lines further from parallel or square are left alone however uncertain they are
MOST_GAP = 0.04  # of a length or radius, likewise
_IMPLIED = 1e-6  # share of a relation's first variance below which it follows from others
_STEPS = 10


@dataclass(eq=False)
class _State:
    """All unknowns of a board, their covariance given the relations so far, and those relations."""

    unknowns: np.ndarray
    covariance: np.ndarray
    kept: list[Relation]
    rise: float = 0.0


def polish(
    fits: list[Fit], samples: list[Samples], guides: list[GuideLine], options: CurveOptions
) -> tuple[list[Fit], tuple[str, ...]]:
    """Fits with the supported relations exact, and the relations' names; the fits as they were if relations do not
    agree.
    """
    if not fits:
        return fits, ()
    state = _joined(fits)
    offsets = np.cumsum([0, *(len(f.shape.unknowns) for f in fits)])
    for stage in (_line_pairs, _arc_pairs, _symmetries, _length_pairs):
        for group in sorted(stage(fits, offsets, state), key=lambda g: _rise(g, state)):
            _consider(group, state, options)
    while state.kept:
        polished = _solved(fits, samples, guides, state)
        limit = options.relation_rise * len(state.kept)
        if polished and sum(f.chi2 for f in polished) - sum(f.chi2 for f in fits) <= limit:
            return polished, tuple(sorted({r.label for r in state.kept}))
        state.kept = state.kept[: len(state.kept) // 2]
    return fits, ()


def _joined(fits: list[Fit]) -> _State:
    sizes = [len(f.shape.unknowns) for f in fits]
    covariance = np.zeros((sum(sizes), sum(sizes)))
    at = 0
    for fit, size in zip(fits, sizes, strict=True):
        covariance[at : at + size, at : at + size] = fit.covariance
        at += size
    return _State(np.concatenate([f.shape.unknowns for f in fits]), covariance, [])


def _columns(fits: list[Fit], offsets: np.ndarray, kind: int) -> list[tuple[str, tuple[int, ...]]]:
    """Labels and positions among all unknowns of the edges of a kind."""
    return [
        (f"{i}.{k}", tuple(int(c) for c in offsets[i] + fit.shape.columns(k)))
        for i, fit in enumerate(fits)
        for k in range(fit.shape.count)
        if fit.shape.kinds[k] == kind
    ]


def _line_pairs(fits: list[Fit], offsets: np.ndarray, state: _State) -> Iterator[list[Relation]]:
    """Pairs of lines that are nearly parallel, collinear or square."""
    for (a, ca), (b, cb) in combinations(_columns(fits, offsets, LINE), 2):
        for kind in ("parallel", "perpendicular"):
            relation = Relation(kind, ca + cb, f"{kind} {a} {b}")
            if abs(evaluate(relation, state.unknowns)[0][0]) < MOST_TILT:
                yield [relation]
    for (a, ca), (b, cb) in combinations(_columns(fits, offsets, LINE), 2):
        relation = Relation("collinear", ca + cb, f"collinear {a} {b}")
        tilt, gap = np.abs(evaluate(relation, state.unknowns)[0])
        if tilt < MOST_TILT and gap < 3.0:
            yield [relation]


def _arc_pairs(fits: list[Fit], offsets: np.ndarray, state: _State) -> Iterator[list[Relation]]:
    for (a, ca), (b, cb) in combinations(_columns(fits, offsets, ARC), 2):
        radius = Relation("equal radius", ca + cb, f"equal radius {a} {b}")
        size = float(np.linalg.norm(state.unknowns[list(ca[:2])] - state.unknowns[list(ca[2:4])]))
        if abs(evaluate(radius, state.unknowns)[0][0]) < 5 * MOST_GAP * size:
            yield [radius]
        concentric = Relation("concentric", ca + cb, f"concentric {a} {b}")
        if np.linalg.norm(evaluate(concentric, state.unknowns)[0]) < MOST_GAP * size:
            yield [concentric]


def _length_pairs(fits: list[Fit], offsets: np.ndarray, state: _State) -> Iterator[list[Relation]]:
    for (a, ca), (b, cb) in combinations(_columns(fits, offsets, LINE), 2):
        relation = Relation("equal length", ca + cb, f"equal length {a} {b}")
        length = float(np.linalg.norm(state.unknowns[list(ca[:2])] - state.unknowns[list(ca[2:4])]))
        if abs(evaluate(relation, state.unknowns)[0][0]) < MOST_GAP * length:
            yield [relation]


def _symmetries(fits: list[Fit], offsets: np.ndarray, state: _State) -> Iterator[list[Relation]]:
    """Mirror symmetries of single loops, each with two unknowns of its own for the axis."""
    for i, fit in enumerate(fits):
        shape = fit.shape.moved(state.unknowns[offsets[i] : offsets[i + 1]])
        for turn in range(shape.count):
            axis = _axis(shape, turn)
            if axis is None:
                continue
            at = len(state.unknowns)
            state.unknowns = np.append(state.unknowns, axis)
            wide = np.zeros((at + 2, at + 2))
            wide[:at, :at], wide[at, at], wide[at + 1, at + 1] = state.covariance, 1.0, 1e4
            state.covariance = wide
            yield _mirror_group(shape, turn, int(offsets[i]), at, f"symmetric {i}.{turn}")


def _axis(shape: Shape, turn: int) -> np.ndarray | None:
    """Normal angle and distance of the axis that swaps node k with node turn - k, if kinds and places allow one."""
    n = shape.count
    pair = [(turn - k) % n for k in range(n)]
    if any(shape.kinds[k] != shape.kinds[(turn - 1 - k) % n] for k in range(n)):
        return None
    nodes = shape.unknowns[: 2 * n].reshape(n, 2)
    gap = nodes - nodes[pair]
    if np.abs(gap).max() < 1e-6:
        return None
    double = np.arctan2((2 * gap[:, 0] * gap[:, 1]).sum(), (gap[:, 0] ** 2 - gap[:, 1] ** 2).sum())
    normal = np.array([np.cos(double / 2), np.sin(double / 2)])
    distance = float(((nodes + nodes[pair]) / 2 @ normal).mean())
    image = nodes - 2 * (nodes @ normal - distance)[:, None] * normal
    size = float(np.ptp(nodes, axis=0).max())
    far = np.linalg.norm(image - nodes[pair], axis=1).max()
    return np.array([double / 2, distance]) if far < MOST_GAP * size else None


def _mirror_group(shape: Shape, turn: int, offset: int, at: int, label: str) -> list[Relation]:
    n, found = shape.count, []
    for k in range(n):
        j = (turn - k) % n
        a, b = offset + 2 * k, offset + 2 * j
        if k == j:
            found.append(Relation("on axis", (at, at + 1, a, a + 1), label))
        elif k < j:
            found.append(Relation("mirrored", (at, at + 1, a, a + 1, b, b + 1), label))
        mirror = (turn - 1 - k) % n
        own, other = offset + shape.extra(k).start, offset + shape.extra(mirror).start
        if k < mirror and shape.kinds[k] == ARC:
            found.append(Relation("equal", (own, other), label))
        if k <= mirror and shape.kinds[k] == CUBIC:
            found.append(Relation("mirrored", (at, at + 1, own, own + 1, other + 2, other + 3), label))
            if k < mirror:
                found.append(Relation("mirrored", (at, at + 1, own + 2, own + 3, other, other + 1), label))
    return found


def _linear(group: list[Relation], state: _State) -> tuple[np.ndarray, np.ndarray]:
    """Values and full Jacobian of a group of relations."""
    values, rows = [], []
    for relation in group:
        value, jacobian = evaluate(relation, state.unknowns)
        row = np.zeros((len(value), len(state.unknowns)))
        for c, column in enumerate(relation.columns):
            row[:, column] += jacobian[:, c]
        values.append(value)
        rows.append(row)
    return np.concatenate(values), np.vstack(rows)


def _split(group: list[Relation], state: _State) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Values and Jacobian rotated to independent combinations, their variances, and which of these are not implied."""
    value, jacobian = _linear(group, state)
    spread = jacobian @ state.covariance @ jacobian.T
    scale = np.sqrt((jacobian**2).sum(axis=1))
    variance, turn = np.linalg.eigh(spread / np.outer(scale, scale))
    return turn.T @ (value / scale), turn.T @ (jacobian / scale[:, None]), variance, variance > _IMPLIED * 1e-2


def _rise(group: list[Relation], state: _State) -> float:
    """Chi-square that conditioning on the group costs for each degree of freedom."""
    value, _, variance, free = _split(group, state)
    return float((value[free] ** 2 / variance[free]).sum() / max(free.sum(), 1))


def _consider(group: list[Relation], state: _State, options: CurveOptions) -> None:
    """Keep a group if it is affordable and not implied or contradicted by what is kept."""
    value, jacobian, variance, free = _split(group, state)
    if not free.any() or np.abs(value[~free]).max(initial=0.0) > 0.02:
        return
    rise = float((value[free] ** 2 / variance[free]).sum())
    if rise > options.relation_rise * (1 + np.sqrt(free.sum() - 1)):
        return
    gain = state.covariance @ jacobian[free].T / variance[free]
    state.unknowns = state.unknowns - gain @ value[free]
    state.covariance = state.covariance - gain @ (jacobian[free] @ state.covariance)
    state.kept.extend(group)
    state.rise += rise


def _solved(fits: list[Fit], samples: list[Samples], guides: list[GuideLine], state: _State) -> list[Fit] | None:
    """Gauss-Newton over all loops with structure and relations as equations; None if these cannot all hold."""
    sizes = [len(f.shape.unknowns) for f in fits]
    total = sum(sizes)
    x = np.concatenate([*(f.shape.unknowns for f in fits), state.unknowns[total:]])
    covariance = np.zeros((len(x), len(x)))
    for _ in range(_STEPS):
        shapes = _shapes(fits, x)
        normal, right = np.eye(len(x)) * 1e-12, np.zeros(len(x))
        at = 0
        for shape, sample in zip(shapes, samples, strict=True):
            block = slice(at, at + len(shape.unknowns))
            part, side, _ = normal_equations(shape, sample)
            normal[block, block] += part
            right[block] += side
            at += len(shape.unknowns)
        value, jacobian = _all_equations(shapes, guides, state.kept, x)
        if not np.isfinite(jacobian).all():
            return None  # steps that contradict each other have grown without bound
        step, covariance = constrained_step(normal, right, value, jacobian, 1e-6)
        x = x + step
        if np.abs(step).max() < 1e-4:
            break
    x = _exact(fits, guides, state.kept, x)
    shapes = _shapes(fits, x)
    if np.abs(_all_equations(shapes, guides, state.kept, x)[0]).max(initial=0.0) > 1e-10:
        return None
    at = np.cumsum([0, *sizes])
    return [
        taken_stock(shape, sample, covariance[a:b, a:b])
        for shape, sample, a, b in zip(shapes, samples, at[:-1], at[1:], strict=True)
    ]


def _exact(fits: list[Fit], guides: list[GuideLine], kept: list[Relation], x: np.ndarray) -> np.ndarray:
    """Newton steps of least length to rounding error."""
    for _ in range(8):
        value, jacobian = _all_equations(_shapes(fits, x), guides, kept, x)
        if np.abs(value).max(initial=0.0) < 1e-13:
            break
        x = x + np.linalg.lstsq(jacobian, -value, rcond=1e-10)[0]
    return x


def _shapes(fits: list[Fit], x: np.ndarray) -> list[Shape]:
    at, shapes = 0, []
    for fit in fits:
        size = len(fit.shape.unknowns)
        shapes.append(fit.shape.moved(x[at : at + size]))
        at += size
    return shapes


def _all_equations(
    shapes: list[Shape], guides: list[GuideLine], kept: list[Relation], x: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    values, rows, at = [np.zeros(0)], [np.zeros((0, len(x)))], 0
    for shape in shapes:
        value, jacobian = equations(shape, guides)
        row = np.zeros((len(value), len(x)))
        row[:, at : at + len(shape.unknowns)] = jacobian
        values.append(value)
        rows.append(row)
        at += len(shape.unknowns)
    if kept:
        value, row = _linear(kept, _State(x, np.zeros((0, 0)), []))
        values.append(value)
        rows.append(row)
    return np.concatenate(values), np.vstack(rows)
