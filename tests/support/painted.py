"""Photographs from straight above, painted by a rule: what stages that sweep photographs see of a known surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kerfwright.identify.visibility import Obstacles


@dataclass(frozen=True, eq=False)
class FromAbove:
    """A camera far up: pixels are x and y of the world, mm."""

    centre: np.ndarray

    def project(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) to (N, 2) pixels and (N,) depth."""
        return places[:, :2].copy(), self.centre[2] - places[:, 2]


class Painted:
    """`Photos` of a surface with a tone at every (x, y), each view with grain of its own."""

    def __init__(self, tone: Callable[[np.ndarray, np.ndarray], np.ndarray], views: int = 8, grain: float = 3.0):
        self.views = [FromAbove(np.array([50.0 * k, 30.0, 1e5])) for k in range(views)]
        self._tone, self._grain = tone, grain

    def colours(self, k: int, places: np.ndarray) -> np.ndarray:
        """(..., 3) to (..., 3) RGB."""
        xy = self.views[k].project(places.reshape(-1, 3))[0]
        noise = np.random.default_rng(k).normal(0, self._grain, len(xy))
        tones = self._tone(xy[:, 0], xy[:, 1]) + noise
        return np.repeat(tones[:, None], 3, axis=1).reshape(places.shape)


def nothing_hides() -> Obstacles:
    """Obstacles of an empty scene."""
    return Obstacles([], 1.0)
