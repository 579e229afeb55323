"""Synthetic outlines with known nodes, for tests and the benchmark of curve fitting.

The generator fixes what "right" means before there is a fitter: each outline is a `CutPath` (its truth) and the noisy
boundary that a traced mask would give: a point a millimetre, displaced by a stationary Gaussian field of `noise` RMS in
both directions whose correlation falls to 1/e over `correlation_length` along the boundary.
Sizes run from 60 to 600 mm.
Shapes are only kept apart where a person could do so too: arcs have 4 mm of sagitta or more, splines leave every arc
and line by several millimetres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kerfwright.model import Arc, Bezier, Circle, CutPath, Edge, Line, Loop
from kerfwright.refine.types import BoundaryLoop

__all__ = [
    "HARD_SHAPES",
    "SHAPES",
    "SyntheticOutline",
    "complaints",
    "edge_points",
    "edge_tangents",
    "loop_nodes",
    "make_outline",
    "make_outlines",
    "trace",
]

SMOOTH_ANGLE = np.radians(1.0)  # nodes whose tangents differ by less are smooth


@dataclass(frozen=True, eq=False)
class SyntheticOutline:
    """A shape, its true path and the boundary that was traced of it."""

    shape: str
    path: CutPath
    loops: tuple[BoundaryLoop, ...]


def make_outlines(
    count: int, seed: int = 0, noise: float = 0.5, correlation_length: float = 5.0
) -> list[SyntheticOutline]:
    """`count` outlines, the shapes in turn; the i-th depends on `seed` and i alone."""
    names = sorted(SHAPES)
    return [
        make_outline(names[i % len(names)], np.random.default_rng([seed, i]), noise, correlation_length)
        for i in range(count)
    ]


def make_outline(
    shape: str, rng: np.random.Generator, noise: float = 0.5, correlation_length: float = 5.0, spacing: float = 1.0
) -> SyntheticOutline:
    """One outline of the named shape, turned and shifted at random."""
    path = _placed((SHAPES | HARD_SHAPES)[shape](rng), rng)
    loops = tuple(
        trace(loop, rng, noise, correlation_length, spacing, is_hole=i > 0)
        for i, loop in enumerate((path.outer, *path.holes))
    )
    return SyntheticOutline(shape, path, loops)


def trace(
    loop: Loop,
    rng: np.random.Generator,
    noise: float,
    correlation_length: float,
    spacing: float = 1.0,
    is_hole: bool = False,
) -> BoundaryLoop:
    """The boundary of a loop, from a random start, with correlated noise; standard errors are the noise's own."""
    dense = np.concatenate([edge_points(edge, spacing / 20)[:-1] for edge in loop.edges])
    closed = np.vstack([dense, dense[:1]])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    count = round(length[-1] / spacing)
    at = (np.arange(count) + rng.uniform()) * length[-1] / count
    points = np.column_stack([np.interp(at, length, closed[:, k]) for k in range(2)])
    points += noise * correlated_noise(count, correlation_length / spacing, rng)
    points = np.roll(points, rng.integers(count), axis=0)
    return BoundaryLoop(points, np.full(count, max(noise, 0.05)), is_hole)


def correlated_noise(count: int, correlation_length: float, rng: np.random.Generator) -> np.ndarray:
    """(count, 2) periodic unit Gaussian noise with autocorrelation exp(-(d / correlation_length)^2)."""
    frequency = np.fft.rfftfreq(count)
    spectrum = np.exp(-((np.pi * frequency * correlation_length) ** 2) / 2)
    field = np.fft.irfft(np.fft.rfft(rng.normal(size=(count, 2)), axis=0) * spectrum[:, None], count, axis=0)
    kernel = np.fft.irfft(spectrum, count)
    return field / np.sqrt((kernel**2).sum())


def edge_points(edge: Edge, spacing: float) -> np.ndarray:
    """(N, 2) points along an edge, both ends included."""
    if isinstance(edge, Line):
        ends = np.array([edge.start, edge.end])
        return _between(ends[0], ends[1], _count(np.linalg.norm(ends[1] - ends[0]), spacing))
    if isinstance(edge, Bezier):
        return _bezier_points(edge, spacing)
    centre, radius, start, turn = _arc_frame(edge)
    angle = start + turn * np.linspace(0, 1, _count(radius * abs(turn), spacing))
    return centre + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def edge_tangents(edge: Edge) -> tuple[np.ndarray, np.ndarray]:
    """Unit tangents at the start and at the end of an edge."""
    if isinstance(edge, Line):
        tangents = [np.subtract(edge.end, edge.start)] * 2
    elif isinstance(edge, Bezier):
        tangents = [np.subtract(edge.control_1, edge.start), np.subtract(edge.end, edge.control_2)]
    else:
        _, _, start, turn = _arc_frame(edge)
        tangents = [np.sign(turn) * np.array([-np.sin(a), np.cos(a)]) for a in (start, start + turn)]
    return tuple(t / np.linalg.norm(t) for t in tangents)


def loop_nodes(loop: Loop) -> list[tuple[np.ndarray, bool]]:
    """Where each edge starts, and whether the path is smooth there; a full circle has none."""
    if isinstance(loop.edges[0], Circle):
        return []
    tangents = [edge_tangents(edge) for edge in loop.edges]
    return [
        (np.array(edge.start), _angle(tangents[k - 1][1], tangents[k][0]) < SMOOTH_ANGLE)
        for k, edge in enumerate(loop.edges)
    ]


def complaints(truth: CutPath, found: CutPath, reach: float = 2.0) -> list[str]:
    """What is wrong with a fitted path: nodes too many, too few, more than `reach` mm off; wrong kinds."""
    loops = zip((truth.outer, *truth.holes), (found.outer, *found.holes), strict=True)
    return [text for a, b in loops for text in _loop_complaints(a, b, reach)]


def _loop_complaints(truth: Loop, found: Loop, reach: float) -> list[str]:
    true_nodes, nodes = loop_nodes(truth), loop_nodes(found)
    if len(true_nodes) != len(nodes):
        return [f"{len(nodes)} nodes for {len(true_nodes)}"]
    if not nodes:
        return [] if isinstance(found.edges[0], Circle) else ["not a circle"]
    count = len(nodes)
    gap = np.array([[np.linalg.norm(a[0] - b[0]) for b in nodes] for a in true_nodes])
    shift = min(range(count), key=lambda s: sum(gap[i, (i + s) % count] for i in range(count)))
    wrong = []
    for i, (true_edge, (_, smooth)) in enumerate(zip(truth.edges, true_nodes, strict=True)):
        j = (i + shift) % count
        wrong += [f"node off by {gap[i, j]:.1f} mm"] if gap[i, j] > reach else []
        wrong += ["smooth for sharp"] if nodes[j][1] and not smooth else []
        wrong += ["sharp for smooth"] if smooth and not nodes[j][1] else []
        same = true_edge.kind == found.edges[j].kind
        wrong += [] if same else [f"{found.edges[j].kind} for {true_edge.kind}"]
    return wrong


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return abs(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))


def _count(length: float, spacing: float) -> int:
    return max(2, int(np.ceil(length / spacing)) + 1)


def _between(a: np.ndarray, b: np.ndarray, count: int) -> np.ndarray:
    return a + np.linspace(0, 1, count)[:, None] * (b - a)


def _bezier_points(edge: Bezier, spacing: float) -> np.ndarray:
    control = np.array([edge.start, edge.control_1, edge.control_2, edge.end])
    t = np.linspace(0, 1, _count(np.linalg.norm(np.diff(control, axis=0), axis=1).sum(), spacing))[:, None]
    return sum(c * (1 - t) ** (3 - k) * t**k * (1, 3, 3, 1)[k] for k, c in enumerate(control))


def _arc_frame(edge: Arc | Circle) -> tuple[np.ndarray, float, float, float]:
    """Centre, radius, start angle and signed turn."""
    if isinstance(edge, Circle):
        return np.array(edge.centre), edge.radius, 0.0, -2 * np.pi if edge.clockwise else 2 * np.pi
    a, m, b = np.array([edge.start, edge.mid, edge.end])
    centre = a + np.linalg.solve(2 * np.array([m - a, b - a]), [(m - a) @ (m - a), (b - a) @ (b - a)])
    angles = [np.arctan2(*(p - centre)[::-1]) for p in (a, m, b)]
    ccw = (angles[1] - angles[0]) % (2 * np.pi) < (angles[2] - angles[0]) % (2 * np.pi)
    turn = (angles[2] - angles[0]) % (2 * np.pi)
    return centre, float(np.linalg.norm(a - centre)), float(angles[0]), turn if ccw else turn - 2 * np.pi


# Shapes: each draws its dimensions and gives a path about the origin.


def _polygon(points: list[tuple[float, float]] | np.ndarray) -> CutPath:
    points = [tuple(map(float, p)) for p in points]
    return CutPath(outer=Loop(edges=tuple(Line(start=a, end=b) for a, b in pairwise([*points, points[0]]))))


def _size(rng: np.random.Generator, low: float = 60.0, high: float = 600.0) -> float:
    """Small boards are as likely as large ones: uniform in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _rectangle(rng: np.random.Generator) -> CutPath:
    w, h = _size(rng) / 2, _size(rng) / 2
    return _polygon([(-w, -h), (w, -h), (w, h), (-w, h)])


def _trapezium(rng: np.random.Generator) -> CutPath:
    w, h = _size(rng, 100) / 2, _size(rng) / 2
    left, right = rng.uniform(0.05, 0.3, 2) * w + 6
    return _polygon([(-w, -h), (w, -h), (w - right, h), (-w + left, h)])


def _rounded_rectangle(rng: np.random.Generator) -> CutPath:
    w, h = _size(rng, 100) / 2, _size(rng, 100) / 2
    return CutPath(outer=_rounded(w, h, rng.uniform(0.3, 0.8) * min(w, h, 75)))


def _rounded(w: float, h: float, r: float) -> Loop:
    edges, d = [], r * (1 - np.sqrt(0.5))
    corners = [(w, -h, -1, 0, 0, 1), (w, h, 0, -1, -1, 0), (-w, h, 1, 0, 0, -1), (-w, -h, 0, 1, 1, 0)]
    for k, (x, y, ax, ay, bx, by) in enumerate(corners):
        a, b = (x + r * ax, y + r * ay), (x + r * bx, y + r * by)
        edges.append(Arc(start=a, mid=(x + d * (ax + bx), y + d * (ay + by)), end=b))
        x2, y2, ax2, ay2 = corners[(k + 1) % 4][:4]
        edges.append(Line(start=b, end=(x2 + r * ax2, y2 + r * ay2)))
    return Loop(edges=tuple(edges))


def _slot_loop(half: float, r: float, at: tuple[float, float] = (0.0, 0.0), hole: bool = False) -> Loop:
    x, y = at
    a, b, c, d = (x - half, y - r), (x + half, y - r), (x + half, y + r), (x - half, y + r)
    right, left = (x + half + r, y), (x - half - r, y)
    if hole:
        return Loop(
            edges=(
                Line(start=b, end=a),
                Arc(start=a, mid=left, end=d),
                Line(start=d, end=c),
                Arc(start=c, mid=right, end=b),
            )
        )
    return Loop(
        edges=(
            Line(start=a, end=b),
            Arc(start=b, mid=right, end=c),
            Line(start=c, end=d),
            Arc(start=d, mid=left, end=a),
        )
    )


def _slot(rng: np.random.Generator) -> CutPath:
    length = _size(rng, 80)
    r = rng.uniform(0.1, 0.35) * length
    r = min(max(r, 10.0), 100.0)
    return CutPath(outer=_slot_loop(length / 2 - r, r))


def _disc(rng: np.random.Generator) -> CutPath:
    """A disc with a round hole beside its middle."""
    r = _size(rng, 60, 400) / 2
    hole = Circle(centre=(0.3 * r, 0.1 * r), radius=rng.uniform(0.25, 0.5) * r, clockwise=True)
    return CutPath(outer=Loop(edges=(Circle(centre=(0, 0), radius=r),)), holes=(Loop(edges=(hole,)),))


def _arc_side(rng: np.random.Generator) -> CutPath:
    """A rectangle one side of which bulges out or in as a circular arc."""
    w, h = _size(rng, 80) / 2, _size(rng, 80) / 2
    sagitta = np.sign(rng.uniform(-1, 1)) * max(4.0, rng.uniform(0.08, 0.5) * min(w, h))
    points = [(-w, h), (-w, -h), (w, -h), (w, h)]
    lines = tuple(Line(start=a, end=b) for a, b in pairwise(points))
    return CutPath(outer=Loop(edges=(*lines, Arc(start=points[3], mid=(0, h + sagitta), end=points[0]))))


def _spline_side(rng: np.random.Generator) -> CutPath:
    """A rectangle one side of which is an S-shaped or a lopsided cubic that meets its neighbours in corners."""
    w, h = _size(rng, 150) / 2, _size(rng, 100) / 2
    rise = rng.uniform(0.5, 0.9) * min(w, h)
    near, far = (rise, -rise) if rng.uniform() < 0.5 else (1.4 * rise, -0.1 * rise)
    points = [(-w, h), (-w, -h), (w, -h), (w, h)]
    lines = tuple(Line(start=a, end=b) for a, b in pairwise(points))
    side = Bezier(start=points[3], control_1=(0.4 * w, h + near), control_2=(-0.4 * w, h + far), end=points[0])
    return CutPath(outer=Loop(edges=(*lines, side)))


def _notched(rng: np.random.Generator) -> CutPath:
    """A rectangle with one or two notches for crossing boards, 6 to 40 mm wide."""
    w, h = _size(rng, 120) / 2, _size(rng, 80) / 2
    points = [(-w, -h), (w, -h), (w, h)]
    for x in [[0.0], [0.45 * w, -0.45 * w]][rng.integers(2)]:
        a, d = rng.uniform(6, min(40, 0.4 * w)) / 2, rng.uniform(6, max(8, 0.9 * h))
        points += [(x + a, h), (x + a, h - d), (x - a, h - d), (x - a, h)]
    return _polygon([*points, (-w, h)])


def _tray_end(rng: np.random.Generator) -> CutPath:
    """The end of a tray: a flat top that runs smoothly into two round shoulders, and a slot for the hand."""
    w, low, top, flat = _tray_dimensions(rng)
    radius = ((w - flat) ** 2 + (top - low) ** 2) / (2 * (top - low))
    half = np.arcsin((w - flat) / radius) / 2
    mid = (flat + radius * np.sin(half), top - radius * (1 - np.cos(half)))
    right = Arc(start=(w, low), mid=mid, end=(flat, top))
    left = Arc(start=(-flat, top), mid=(-mid[0], mid[1]), end=(-w, low))
    return _tray(w, low, top, flat, right, left, rng)


def _tray_spline(rng: np.random.Generator) -> CutPath:
    """The same with cubic shoulders, as the tray of the captures has them."""
    w, low, top, flat = _tray_dimensions(rng)
    near, far = (w - 0.31 * (w - flat), low), (flat + 0.53 * (w - flat), top)
    right = Bezier(start=(w, low), control_1=near, control_2=far, end=(flat, top))
    left = Bezier(start=(-flat, top), control_1=(-far[0], top), control_2=(-near[0], low), end=(-w, low))
    return _tray(w, low, top, flat, right, left, rng)


def _tray_dimensions(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Half width, height of the sides, height and half length of the flat top."""
    w = _size(rng, 200, 500) / 2
    return w, 0.4 * w * rng.uniform(0.95, 1.05), 0.7 * w, 0.55 * w * rng.uniform(0.9, 1.1)


def _tray(w: float, low: float, top: float, flat: float, right: Edge, left: Edge, rng: np.random.Generator) -> CutPath:
    points = [(-w, low), (-w, 0.0), (w, 0.0), (w, low)]
    lines = [Line(start=a, end=b) for a, b in pairwise(points)]
    r = rng.uniform(10, 15)
    hole = _slot_loop(0.25 * w, r, (0.0, top - 1.8 * r), hole=True)
    return CutPath(outer=Loop(edges=(*lines, right, Line(start=(flat, top), end=(-flat, top)), left)), holes=(hole,))


def _arched_leg(rng: np.random.Generator) -> CutPath:
    """The leg of a stool: tapering sides that are lopsided cubics, and an arch between two feet."""
    h, w = _size(rng, 200, 500), _size(rng, 150, 300) / 2
    dip, foot = rng.uniform(0.25, 0.4) * w, rng.uniform(0.35, 0.5) * w
    points = [(-w, h), (-w, 0.0), (-foot, 0.0), (foot, 0.0), (w, 0.0), (w, h)]
    left = Bezier(start=points[0], control_1=(-w, 0.65 * h), control_2=(-w + 2 * dip, 0.45 * h), end=points[1])
    right = Bezier(start=points[4], control_1=(w - 2 * dip, 0.45 * h), control_2=(w, 0.65 * h), end=points[5])
    arch = Arc(start=points[2], mid=(0.0, rng.uniform(0.4, 1.0) * foot), end=points[3])
    feet = [Line(start=points[k], end=points[k + 1]) for k in (1, 3)]
    return CutPath(outer=Loop(edges=(left, feet[0], arch, feet[1], right, Line(start=points[5], end=points[0]))))


SHAPES: dict[str, Callable[[np.random.Generator], CutPath]] = {
    "arc_side": _arc_side,
    "arched_leg": _arched_leg,
    "disc": _disc,
    "notched": _notched,
    "rectangle": _rectangle,
    "rounded_rectangle": _rounded_rectangle,
    "slot": _slot,
    "spline_side": _spline_side,
    "trapezium": _trapezium,
    "tray_end": _tray_end,
}
# Even a fitter that is told the true structure finds the smooth node between a cubic and a line only to 3 mm (median)
# in this noise: the cubic's end can bend as the line wants it. Kinds can be asked of it, places of nodes not.
HARD_SHAPES: dict[str, Callable[[np.random.Generator], CutPath]] = {"tray_spline": _tray_spline}


def _placed(path: CutPath, rng: np.random.Generator) -> CutPath:
    angle, shift = rng.uniform(0, 2 * np.pi), rng.uniform(-50, 50, 2)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points = ("start", "mid", "end", "control_1", "control_2", "centre")

    def place(edge: Edge) -> Edge:
        moved = {n: tuple((turn @ getattr(edge, n) + shift).tolist()) for n in points if hasattr(edge, n)}
        return edge.model_copy(update=moved)

    loops = [Loop(edges=tuple(place(e) for e in loop.edges)) for loop in (path.outer, *path.holes)]
    return CutPath(outer=loops[0], holes=tuple(loops[1:]))
