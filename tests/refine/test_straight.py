"""Bumps in straight edges: taken off where the photographs show the line, left where they don't."""

import numpy as np
import pytest
import shapely
from shapely.geometry import Point, Polygon, box

from kerfwright.refine.segment.straight import straightened

BOARD = box(0, 0, 200, 90)
BUMPS = [box(80, 85, 110, 95), box(0, 84, 15, 97), box(150, -6, 170, 5), box(185, 80, 206, 95)]


def shown_by(truth: Polygon, hidden: Polygon | None = None):
    """Edges as photographs of a true outline would show them; nothing inside `hidden`."""

    def shown(points: np.ndarray) -> np.ndarray:
        at = shapely.points(points)
        strength = np.where(shapely.distance(at, truth.boundary) < 0.75, 3.0, 0.3)
        return strength if hidden is None else np.where(shapely.contains(hidden, at), np.nan, strength)

    return shown


def iou(a: Polygon, b: Polygon) -> float:
    return a.intersection(b).area / a.union(b).area


@pytest.mark.parametrize("bump", BUMPS)
def test_bump_or_bite_that_no_photograph_shows_goes(bump: Polygon) -> None:
    for traced in (BOARD.union(bump), BOARD.difference(bump)):
        assert iou(straightened(traced, shown_by(BOARD)), BOARD) > 0.999


def test_notch_and_tab_that_the_photographs_show_stay() -> None:
    true = BOARD.difference(box(80, 82, 110, 95)).union(box(130, 85, 150, 96))
    assert iou(straightened(true, shown_by(true)), true) > 0.999


def test_round_corners_and_chamfers_stay() -> None:
    for true in (BOARD.buffer(-12).buffer(12), Polygon([(0, 0), (200, 0), (200, 78), (188, 90), (0, 90)])):
        assert iou(straightened(true, shown_by(true)), true) > 0.999


def test_hidden_notch_stays() -> None:
    true = BOARD.difference(box(80, 78, 110, 95))
    assert iou(straightened(true, shown_by(true, box(70, 60, 120, 100))), true) > 0.999


def test_holes_are_kept_and_straightened() -> None:
    true = BOARD.difference(box(60, 30, 140, 60))
    traced = true.union(box(90, 55, 110, 62)).difference(Point(20, 45).buffer(8))
    found = straightened(traced, shown_by(true.difference(Point(20, 45).buffer(8))))
    assert len(found.interiors) == 2
    assert iou(found, true.difference(Point(20, 45).buffer(8))) > 0.998
