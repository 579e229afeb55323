"""The labelling of least energy, by data term and contrast-sensitive smoothness (paper, Image-Based Segmentation)."""

from __future__ import annotations

import numpy as np

from kerfwright.refine.segment._pixels import ALONG

__all__ = ["STEPS", "cut", "smoothness_weights"]

STEPS = ALONG  # neighbours right, down, and both diagonals: fewer stairs than four
LENGTH = (1.0, 1.0, 2**-0.5, 2**-0.5)
SHARE = 0.5  # of an edge's weight each of the 8-neighbourhood's edges carries, so that the sum compares to 4-connected
HARD = 1e6


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
