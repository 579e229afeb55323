"""The labelling of least energy, by data term and contrast-sensitive smoothness (paper, Image-Based Segmentation)."""

from __future__ import annotations

import numpy as np

from kerfwright.refine.segment.constraints import neighbours

__all__ = ["STEPS", "contrast", "cut", "smoothness_weights"]

STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))  # neighbours right, down, and both diagonals: fewer stairs than four
LENGTH = (1.0, 1.0, 2**-0.5, 2**-0.5)
SHARE = 0.5  # of an edge's weight each of the 8-neighbourhood's edges carries, so that the sum compares to 4-connected
HARD = 1e6
STEEPEST = 8.0  # one view's contrast says no more than this: a glint must not outvote the rest


def contrast(lab: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """(4, rows, cols) squared colour steps to each neighbour over those usual inside the board."""
    stacked = np.zeros((len(STEPS), *lab.shape[:2]), np.float32)
    for channel in np.ascontiguousarray(np.moveaxis(lab, 2, 0)):
        for full, (dy, dx) in zip(stacked, STEPS, strict=True):
            here, there = neighbours(channel, dy, dx)
            step = here - there
            step *= step
            view, _ = neighbours(full, dy, dx)
            view += step
    usual = stacked[:, inside].mean() if inside.any() else stacked.mean()
    return np.minimum(stacked / (4 * max(float(usual), 1.0)), STEEPEST)


def smoothness_weights(contrasts: np.ndarray, crossing: np.ndarray, smoothness: float) -> np.ndarray:
    """(4, rows, cols) cost of a label change, by the contrast averaged over views; none across a constraint."""
    weights = smoothness * SHARE * np.exp(-contrasts) * np.array(LENGTH)[:, None, None]
    weights[crossing] = 0
    return weights


def cut(evidence: np.ndarray, weights: np.ndarray, inside: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """The mask: `evidence` > 0 speaks for inside, nats; `inside` and `outside` are hard seeds (outside wins)."""
    mask = np.zeros(evidence.shape, bool)
    if outside.all():
        return mask
    window = _window(~outside)
    mask[window] = _least_cut(evidence[window], weights[:, *window], inside[window], outside[window])
    return mask


def _window(mask: np.ndarray) -> tuple[slice, slice]:
    """The rows and columns that hold a mask, and one more on each side: what lies further out cannot change the cut."""
    return tuple(
        slice(max(0, int(hit[0]) - 1), int(hit[-1]) + 2) for hit in (np.flatnonzero(mask.any(axis)) for axis in (1, 0))
    )


def _least_cut(evidence: np.ndarray, weights: np.ndarray, inside: np.ndarray, outside: np.ndarray) -> np.ndarray:
    import maxflow

    graph = maxflow.Graph[float](evidence.size, 4 * evidence.size)
    nodes = graph.add_grid_nodes(evidence.shape)
    for (dy, dx), edge_weights in zip(STEPS, weights, strict=True):
        structure = np.zeros((3, 3))
        structure[1 + dy, 1 + dx] = 1
        graph.add_grid_edges(nodes, edge_weights, structure, symmetric=True)
    for_inside = np.where(inside, HARD, np.maximum(evidence, 0))
    for_outside = np.where(outside, HARD * 10, np.maximum(-evidence, 0))
    graph.add_grid_tedges(nodes, for_inside, for_outside)
    graph.maxflow()
    return ~graph.get_grid_segments(nodes)
