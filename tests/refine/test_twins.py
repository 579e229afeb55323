"""Repeated boards: which are one within their errors, and that they come out identical and still on their planes."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import Polygon, box

from clouds import pose, sheet
from kerfwright.assemble.types import ConstraintSegment
from kerfwright.identify.outlines import segment_axes
from kerfwright.model.geometry import mirror_path, path_polygon, sample_loop, transform_path
from kerfwright.refine import BoundaryLoop
from kerfwright.refine.boards import to_boards
from kerfwright.refine.congruence import best_motion, contour_of, moved_points
from kerfwright.refine.curves import fit_curves
from kerfwright.refine.twins import with_twins
from kerfwright.refine.types import Fitted

ERROR = 0.1
BRACKET = Polygon([(0, 0), (200, 0), (200, 60), (90, 60), (60, 140), (0, 140)])  # its mirror image is another board
WINDOW = BRACKET.difference(box(20, 20, 60, 50))


def motion(degrees: float, x: float, y: float, mirrored: bool = False) -> np.ndarray:
    angle = np.radians(degrees)
    matrix = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.column_stack([matrix @ np.diag([1.0, -1.0 if mirrored else 1.0]), [x, y]])


def moved(region: Polygon, m: np.ndarray) -> Polygon:
    return affinity.affine_transform(region, [*m[:, :2].ravel(), *m[:, 2]])


def traced(region: Polygon, error: float = ERROR, seed: int = 0) -> tuple[BoundaryLoop, ...]:
    """A boundary point a millimetre, off by noise that is correlated over 5 mm."""
    rng, loops = np.random.default_rng(seed), []
    for k, ring in enumerate([region.exterior, *region.interiors]):
        points = np.array([ring.interpolate(s).coords[0] for s in np.arange(0, ring.length - 0.5, 1.0)])
        points = points if ring.is_ccw == (k == 0) else points[::-1]
        noise = rng.standard_normal((5, len(points), 2)).cumsum(axis=0)[-1] / np.sqrt(5)
        noise = sum(np.roll(noise, s, axis=0) for s in range(5)) / np.sqrt(5)
        loops.append(BoundaryLoop(points + 0.7 * error * noise, np.full(len(points), error), k > 0))
    return tuple(loops)


def on_segments(loop: BoundaryLoop, segments) -> BoundaryLoop:
    """The boundary put on constraint segments where it runs along them, as refinement does."""
    points = loop.points.copy()
    for segment in segments:
        along, inward, length = segment_axes(segment)
        x = points - segment.start
        near = (np.abs(x @ inward) < 1) & (x @ along > 1) & (x @ along < length - 1)
        points[near] -= (x[near] @ inward)[:, None] * inward
    return replace(loop, points=points)


def fitted(name: str, region: Polygon, *segments: ConstraintSegment, error=ERROR, seed=0, thickness=18.0) -> Fitted:
    loops = tuple(on_segments(loop, segments) for loop in traced(region, error, seed))
    rough = sheet(name, pose((0, 0, 50)), thickness, region)
    return Fitted(rough, segments, loops, fit_curves(loops, segments).path, "images")


def found(a: Polygon, b: Polygon, error: float = ERROR) -> np.ndarray | None:
    one, two = contour_of(traced(a, error, 1)), contour_of(traced(b, error, 2))
    return best_motion(one, two, one.error, two.error)


@pytest.mark.parametrize("region", [BRACKET, WINDOW])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("degrees", [0.0, 37.0, 180.0, 271.0])
def test_the_motion_between_two_tracings_is_found(region, mirrored, degrees):
    m = motion(degrees, 300.0, -40.0, mirrored)
    back = found(region, moved(region, m))
    corners = np.array(region.exterior.coords)
    assert np.linalg.det(back[:, :2]) == pytest.approx(-1.0 if mirrored else 1.0)
    assert np.abs(moved_points(back, moved_points(m, corners)) - corners).max() < 0.15


@pytest.mark.parametrize("region", [box(0, 0, 200, 80), box(0, 0, 90, 90)])
def test_what_is_its_own_mirror_image_is_not_mirrored(region):
    back = found(region, moved(region, motion(90.0, 10, 10, True)))
    assert np.linalg.det(back[:, :2]) == pytest.approx(1.0)


def test_a_millimetre_is_another_board_when_a_tenth_can_be_seen():
    longer = Polygon([(0, 0), (201, 0), (201, 60), (90, 60), (60, 140), (0, 140)])
    assert found(BRACKET, longer) is None
    assert found(BRACKET, longer, error=1.0) is not None


def test_a_notch_that_one_of_two_has_parts_them():
    notched = BRACKET.difference(box(100, -1, 108, 4))
    assert found(BRACKET, notched) is None and found(notched, BRACKET) is None


def test_repeats_come_out_identical_where_they_were():
    m, n = motion(123.0, 500, 20), motion(-40.0, -300, 90, mirrored=True)
    longer = Polygon([(0, 0), (201, 0), (201, 60), (90, 60), (60, 140), (0, 140)])
    regions = {"first": BRACKET, "longer": longer, "turned": moved(BRACKET, m), "mirrored": moved(BRACKET, n)}
    joined = with_twins([fitted(name, region, seed=k) for k, (name, region) in enumerate(regions.items())])
    boards = {b.name: b for b in to_boards(joined)}
    assert [(b.same_as, b.mirrored) for b in boards.values()] == [
        (None, False), (None, False), ("first", False), ("first", True),
    ]  # fmt: skip
    assert boards["turned"].cut_path == boards["first"].cut_path
    image = sample_loop(mirror_path(boards["first"].cut_path).outer)
    assert np.abs(np.ptp(image, axis=0) - np.ptp(sample_loop(boards["mirrored"].cut_path.outer), axis=0)).max() < 1e-9
    for name, region in regions.items():
        assert path_polygon(boards[name].cut_path).area == pytest.approx(region.area, abs=60)
        assert placed(boards[name]).symmetric_difference(region).area < 0.1 * region.length


def placed(board) -> Polygon:
    """A board's outline in the world, whose xy is the plane of the sheet."""
    frame = np.array(board.model_from_board)
    assert np.linalg.det(frame[:3, :3]) == pytest.approx(1.0) and frame[2, 2] == pytest.approx(1.0)
    return path_polygon(transform_path(board.cut_path, np.c_[frame[:2, :2], frame[:2, 3]]))


def test_what_two_boards_show_is_known_better_than_what_one_shows():
    boards = [fitted("a", BRACKET, seed=3), fitted("b", moved(BRACKET, motion(90, 0, 0)), seed=4)]
    joined = with_twins(boards)
    assert joined[1].twin is not None
    alone, both = ([e.standard_error for e in f.path.outer.edges] for f in (boards[0], joined[0]))
    assert len(alone) == len(both) == 6 and np.mean(both) < 0.9 * np.mean(alone)


def ends_at(height: float) -> ConstraintSegment:
    return ConstraintSegment(np.array([200.0, height]), np.array([0.0, height]), "contact", 0.15, contact=0)


def ends_below(height: float) -> ConstraintSegment:
    return ConstraintSegment(np.array([0.0, height]), np.array([200.0, height]), "contact", 0.15, contact=1)


def between(name: str, low: float, high: float, seed: int) -> Fitted:
    return fitted(name, box(0, low, 200, high), ends_below(low), ends_at(high), seed=seed)


def heights(board: Fitted) -> np.ndarray:
    return np.unique([p[1] for e in board.path.outer.edges for p in (e.start, e.end)])


def test_twins_stay_on_the_planes_they_end_on():
    joined = with_twins([between("a", 0.0, 120.0, 1), between("b", 0.0, 120.01, 2)])
    assert joined[1].twin is not None
    for board, planes in zip(joined, [(0.0, 120.0), (0.0, 120.01)], strict=True):
        found = heights(board)
        assert np.abs(found[:, None] - planes).min(axis=1).max() < 0.01
    one, two = to_boards(joined)
    assert one.cut_path == two.cut_path


def test_boards_that_one_path_would_take_off_their_planes_stay_as_they_are():
    boards = [between("a", 0.0, 120.0, 1), between("b", 0.0, 120.1, 2)]
    joined = with_twins(boards)
    assert [f.path for f in joined] == [f.path for f in boards] and joined[1].twin is None


def test_the_floor_is_not_held_to_like_a_board():
    def leg(name: str, high: float, seed: int) -> Fitted:
        floor = ConstraintSegment(np.array([0.0, 0.0]), np.array([200.0, 0.0]), "ground", 0.15)
        return fitted(name, box(0, 0, 200, high), floor, ends_at(high), seed=seed)

    joined = with_twins([leg("a", 120.0, 1), leg("b", 120.1, 2)])
    assert joined[1].twin is not None
    assert [heights(f).max() for f in joined] == pytest.approx([120.0, 120.1], abs=0.01)


@pytest.mark.parametrize(("slant", "twins"), [(0.2, True), (-0.2, False), (0.25, False), (None, False)])
def test_bevels_must_be_alike(slant, twins):
    def bevelled(name: str, slant: float | None, seed: int) -> Fitted:
        normal = None if slant is None else np.array([0.0, np.sqrt(1 - slant**2), slant])
        end = ConstraintSegment(np.array([200.0, 140]), np.array([0.0, 140]), "contact", 0.15, normal, contact=0)
        return fitted(name, Polygon([(0, 0), (200, 0), (160, 140), (0, 140)]), end, seed=seed)

    joined = with_twins([bevelled("a", 0.2, 1), bevelled("b", slant, 2)])
    assert (joined[1].twin is not None) == twins
    if twins:
        one, two = to_boards(joined)
        assert len(one.bevels) == len(two.bevels) == 1
        assert one.bevels[0].angle.value == pytest.approx(two.bevels[0].angle.value)


def test_boards_of_other_stock_are_no_twins():
    joined = with_twins([fitted("a", BRACKET, seed=1), fitted("b", BRACKET, seed=2, thickness=12.0)])
    assert joined[1].twin is None


def test_a_joint_path_that_cannot_be_fitted_leaves_both_alone(monkeypatch):
    from kerfwright.errors import StageError
    from kerfwright.refine import twins

    boards = [fitted("a", BRACKET, seed=1), fitted("b", BRACKET, seed=2)]

    def fails(loops, segments, options):
        raise StageError("too rough")

    monkeypatch.setattr(twins, "fit_curves", fails)
    assert with_twins(boards) == tuple(boards)
