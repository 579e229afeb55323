"""Draws of dimensions: whole millimetres, stock thicknesses, coin tosses."""

from __future__ import annotations

import numpy as np

from kerfwright.synthetic.carpentry import STOCK

__all__ = ["between", "chance", "stock"]


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """A whole number of millimetres from low to high."""
    return float(rng.integers(round(low), round(high) + 1))


def stock(rng: np.random.Generator, low: float, high: float) -> float:
    """A stock thickness from low to high, mm."""
    return float(rng.choice([t for t in STOCK if low <= t <= high]))


def chance(rng: np.random.Generator, probability: float) -> bool:
    """True with the given probability."""
    return bool(rng.random() < probability)
