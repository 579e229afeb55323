"""Nodes of cut paths, true and found: where edges meet, and whether they meet smoothly.

Board plane of the true board, millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.evaluate.truth import TrueBoard
from kerfwright.model import Board, Circle, Loop
from kerfwright.model.geometry import edge_start, edge_tangents

__all__ = ["NodeCount", "compare_nodes", "loop_nodes", "true_nodes"]

REACH = 2.0  # mm within which a node is found
SMOOTH = np.radians(15.0)  # a turn below this is smooth: what polylines of small arcs turn by over a millimetre
INSIDE = 0.3  # mm from the shadow's corner beyond which a node is one of a bevel
PROBE = 1.0  # mm along the outline on either side of a true node, where its turn is read


@dataclass(frozen=True)
class NodeCount:
    """True nodes; those with a found node within 2 mm; those of them of the right kind; found ones that match none."""

    true: int
    found: int
    right_kind: int
    spurious: int


def loop_nodes(loop: Loop) -> tuple[np.ndarray, np.ndarray]:
    """Positions (N, 2) and whether smooth (N,) of a loop's nodes; a circle has none."""
    if isinstance(loop.edges[0], Circle):
        return np.zeros((0, 2)), np.zeros(0, bool)
    at = np.array([edge_start(e) for e in loop.edges])
    out = np.array([edge_tangents(e, np.zeros(1))[0] for e in loop.edges])
    into = np.array([edge_tangents(e, np.ones(1))[0] for e in (loop.edges[-1], *loop.edges[:-1])])
    return at, np.einsum("ij,ij->i", into, out) > np.cos(SMOOTH)


def true_nodes(board: TrueBoard) -> tuple[np.ndarray, np.ndarray]:
    """The same of a true board; where curves meet, the turn is read off its mesh's outline. Those of a bevelled end are
    where the board reaches furthest, as in a model's cut path: some truths have them half way through the board.
    """
    rings = _outline(board)
    at, smooth, corner = [], [], []
    for loop in board.loops:
        edges = loop["edges"]
        for before, edge in zip([edges[-1], *edges[:-1]], edges, strict=True):
            if len(edges) > 1:
                at.append(edge["start"])
                smooth.append(_is_smooth(before, edge, rings))
                corner.append(not smooth[-1] and before["kind"] == edge["kind"] == "line")
    at = [_furthest(np.array(p, float), rings, board.thickness) if c else p for p, c in zip(at, corner, strict=True)]
    return np.array(at, float).reshape(-1, 2), np.array(smooth, bool)


def _furthest(node: np.ndarray, rings, thickness: float) -> np.ndarray:
    """The corner of the board's shadow that belongs to a corner of two lines."""
    import shapely

    corners = np.concatenate([shapely.get_coordinates(ring.simplify(INSIDE)) for ring in rings])
    distance = np.linalg.norm(corners - node, axis=1)
    return corners[distance.argmin()] if INSIDE < distance.min() < 2 * thickness else node


def _is_smooth(before: dict, edge: dict, rings) -> bool:
    if before["kind"] == edge["kind"] == "line":
        u, v = (np.subtract(e["end"], e["start"]) / e["length"] for e in (before, edge))
        return bool(u @ v > np.cos(SMOOTH))
    import shapely

    node = shapely.Point(edge["start"])
    ring = min(rings, key=node.distance)
    here = ring.project(node)
    a, b, c = (np.array(ring.interpolate((here + s) % ring.length).coords[0]) for s in (-PROBE, 0, PROBE))
    return bool((b - a) @ (c - b) > np.cos(SMOOTH) * np.linalg.norm(b - a) * np.linalg.norm(c - b))


def _outline(board: TrueBoard) -> list:
    """Rings of the board's shadow on its own plane."""
    import shapely

    pose = board.truth_from_board
    flat = ((board.vertices - pose[:3, 3]) @ pose[:3, :3])[:, :2][board.triangles]
    u, v = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    shadow = shapely.union_all(shapely.buffer(shapely.polygons(flat[area > 1e-6]), 0.001))
    polygons = shapely.get_parts(shadow)
    return [ring for p in polygons for ring in (p.exterior, *p.interiors)]


def compare_nodes(true: TrueBoard, found: Board, truth_from_model: np.ndarray) -> NodeCount:
    """Match nodes one to one, nearest first."""
    from scipy.optimize import linear_sum_assignment

    at, smooth = true_nodes(true)
    pieces = [loop_nodes(loop) for loop in (found.cut_path.outer, *found.cut_path.holes)]
    own, own_smooth = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    placed = _placed(own, found, true, truth_from_model)
    distance = np.linalg.norm(at[:, None] - placed[None], axis=2)
    rows, columns = linear_sum_assignment(np.minimum(distance, 10 * REACH))
    near = distance[rows, columns] <= REACH
    right = smooth[rows[near]] == own_smooth[columns[near]]
    return NodeCount(len(at), int(near.sum()), int(right.sum()), len(own) - int(near.sum()))


def _placed(flat: np.ndarray, found: Board, true: TrueBoard, truth_from_model: np.ndarray) -> np.ndarray:
    """Points of the found board in the plane of the true one; taken at half thickness, so that a flip is harmless."""
    middle = np.column_stack([flat, np.full(len(flat), found.thickness.value / 2), np.ones(len(flat))])
    board_from_truth = np.linalg.inv(true.truth_from_board)
    return (middle @ (board_from_truth @ truth_from_model @ np.array(found.model_from_board)).T)[:, :2]
