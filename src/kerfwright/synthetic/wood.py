"""Solid wood: a colour at every point of a board, so that end grain, edges and sheets belong together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.model import Board
from kerfwright.model.geometry import path_area, sample_loop
from kerfwright.synthetic.noise import SmoothNoise

__all__ = ["SPECIES", "Wood", "draw_wood"]

# Early and late wood (sRGB), width of a year ring in mm, strength of rings and of fibres.
SPECIES = {
    "beech": ((214, 176, 138), (192, 148, 108), 2.5, 0.35, 0.06),
    "birch": ((226, 201, 160), (208, 178, 132), 3.0, 0.35, 0.05),
    "oak": ((193, 155, 106), (146, 107, 66), 2.8, 0.7, 0.10),
    "pine": ((222, 188, 132), (184, 134, 80), 4.0, 0.8, 0.06),
    "walnut": ((124, 88, 62), (78, 54, 40), 3.5, 0.6, 0.10),
}


@dataclass(frozen=True, eq=False)
class Wood:
    """How one board grew."""

    early: np.ndarray  # (3,) linear
    late: np.ndarray
    ring: float  # mm
    contrast: float
    fibre: float
    pith: np.ndarray  # (2,) where the trunk's middle lies in y and z of the board, mm
    slope: np.ndarray  # (2,) of the trunk's axis against the board's
    knots: np.ndarray  # (K, 4): x, y, slant, radius
    offset: np.ndarray  # (3,) into the noise: no two boards are alike
    tone: np.ndarray  # (3,) of the whole board

    def colour(self, x_in_board: np.ndarray, noise: SmoothNoise, finest: float) -> np.ndarray:
        """Linear colours (N, 3) at points (N, 3), mm; nothing varies over less than `finest` mm."""
        x, y, z = x_in_board.T
        near, inside = self._knot_fields(x, y, z)
        at = x_in_board + self.offset
        a = y - self.pith[0] - self.slope[0] * x
        b = z - self.pith[1] - self.slope[1] * x
        wander = noise(at / (260, 55, 55)) * 5 + noise(at / (90, 24, 24)) * 1.2
        turns = (np.hypot(a, b) + wander + near * 9) / self.ring
        late = np.clip((turns % 1.0 - 0.35) / 0.6, 0, 1) ** 2 * self.contrast
        streak = noise(at / (70, max(0.9, finest), max(0.9, finest))) * self.fibre
        broad = noise(at / (420, 70, 70)) * 0.035
        mixed = self.early + (self.late - self.early) * late[:, None]
        mixed = mixed * (1 + streak + broad)[:, None] * self.tone
        bark = self.late * np.array([0.42, 0.34, 0.30])
        return mixed + (bark - mixed) * inside[:, None]

    def _knot_fields(self, x, y, z) -> tuple[np.ndarray, np.ndarray]:
        """How far knots push the rings aside, and how much of a point is knot."""
        near, inside = np.zeros_like(x), np.zeros_like(x)
        for kx, ky, slant, radius in self.knots:
            d = np.hypot((x - kx - slant * z) / 1.25, y - ky)
            near += np.exp(-((d / (2.2 * radius)) ** 2))
            inside = np.maximum(inside, np.clip((radius - d) / (0.25 * radius) + 0.5, 0, 1) * 0.9)
        return near, inside


def draw_wood(board: Board, species: str, knots: float, rng: np.random.Generator) -> Wood:
    """A board sawn out of some trunk.

    Parameters
    ----------
    species : str
        A key of `SPECIES`.
    knots : float
        Expected number a square metre of sheet.
    """
    early, late, ring, contrast, fibre = SPECIES[species]
    outline = sample_loop(board.cut_path.outer, 1.0)
    low, high = outline.min(axis=0), outline.max(axis=0)
    count = rng.poisson(knots * path_area(board.cut_path) * 1e-6)
    at = low + rng.random((count, 2)) * (high - low)
    knot = np.column_stack([at, rng.normal(0, 0.5, count), rng.uniform(3.5, 9, count)])
    pith = np.array([low[1] + rng.uniform(-0.3, 1.3) * (high[1] - low[1]), rng.choice([-1, 1]) * rng.uniform(25, 160)])
    tone = rng.normal(1, 0.07) * (1 + rng.normal(0, 0.012, 3))
    return Wood(
        early=_linear(early), late=_linear(late), ring=ring * rng.uniform(0.75, 1.3), contrast=contrast, fibre=fibre,
        pith=pith, slope=rng.normal(0, (0.02, 0.04)), knots=knot, offset=rng.uniform(0, 5000, 3), tone=tone,
    )  # fmt: skip


def _linear(colour: tuple[int, int, int]) -> np.ndarray:
    return (np.array(colour) / 255.0) ** 2.2
