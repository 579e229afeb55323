"""Segmentation of boards in photographs: parts on made-up rasters and profiles, the whole on the tiny capture."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.geometry import Point, Polygon, box

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.capture.camera import Camera
from kerfwright.capture.types import View
from kerfwright.errors import OptionError
from kerfwright.identify.types import Sheet
from kerfwright.model import Quantity
from kerfwright.refine.segment import SegmentOptions, segment_boards
from kerfwright.refine.segment.appearance import fit_mixture, same_surface, with_shade
from kerfwright.refine.segment.boundary import Chain, chain_of, registration, snap
from kerfwright.refine.segment.constraints import carve, fill_to_contacts, limits_of
from kerfwright.refine.segment.drilled import drilled_holes, drilled_seeds
from kerfwright.refine.segment.edges import PITCH, EdgeScan, trace, view_offsets
from kerfwright.refine.segment.evidence import Bounds, behind_cut_faces, cut_face_band, seeds_of, signed_distance
from kerfwright.refine.segment.graphcut import cut, smoothness_weights
from kerfwright.refine.segment.grid import Grid, grid_over
from kerfwright.refine.segment.holes import without_false_holes
from kerfwright.refine.segment.openings import disagreement, open_seeds, openings
from kerfwright.refine.segment.rectify import even_out
from kerfwright.refine.segment.scene import BOARD, CLEAR, OCCLUDED, Occluders, slab_mesh
from kerfwright.refine.segment.topology import clean, pieces
from kerfwright.refine.segment.views import BoardView, choose_views

GRID = Grid(np.array([-20.0, -20.0]), 1.0, (60, 80))


def segment(start, end, **more) -> ConstraintSegment:
    return ConstraintSegment(np.array(start, float), np.array(end, float), more.pop("origin", "contact"), 0.2, **more)


def sheet(region: Polygon, z: float = 100.0, thickness: float = 10.0) -> Sheet:
    pose = np.eye(4)
    pose[2, 3] = z
    none = np.zeros(0, int)
    return Sheet("b", pose, Quantity(value=thickness), True, region, none, none, none)


def looking_down(x: float, y: float, z: float) -> View:
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[:3, 3] = -pose[:3, :3] @ [x, y, z]
    return View("v", "v.png", Camera("PINHOLE", 400, 400, (400.0, 400.0, 200.0, 200.0)), pose)


# --- raster ---


def test_grid_mask_holds_the_pixels_whose_centres_are_inside() -> None:
    region = box(-5.2, 0.3, 30.4, 10.1).difference(box(5.2, 2.3, 9.7, 6.9))
    want = shapely.contains_xy(region, GRID.centres().reshape(-1, 2)).reshape(GRID.shape)
    assert (GRID.mask(region) != want).sum() <= 0.02 * want.sum()


def test_grid_lookup_and_index_agree() -> None:
    values = np.arange(60 * 80).reshape(60, 80)
    xy = GRID.centres()[7, 11][None]
    assert GRID.lookup(values, xy, -1)[0] == values[7, 11]
    assert np.allclose(GRID.to_index(xy), [[11, 7]])
    assert GRID.lookup(values, np.array([[1e3, 0]]), -1)[0] == -1


def test_grid_never_exceeds_its_limit() -> None:
    grid = grid_over(box(0, 0, 3000, 2000), 10, 0.5, 100_000)
    assert np.prod(grid.shape) <= 101_000


def test_smoothed_piece_keeps_size_and_hole() -> None:
    mask = GRID.mask(box(-10, -10, 40, 20).difference(box(0, 0, 12, 10)))
    piece = pieces(mask, GRID)
    assert len(piece.interiors) == 1
    assert piece.area == pytest.approx(50 * 30 - 120, rel=0.01)


def test_specks_go_and_holes_stay() -> None:
    mask = GRID.mask(box(-10, -10, 40, 30).difference(box(0, 0, 12, 10)))
    mask[15, 15], mask[55, 75] = False, True
    found = clean(mask, 1.0, SegmentOptions())
    assert len(found) == 1
    assert not found[0][55, 75]
    assert found[0][15, 15]
    assert not found[0][25, 25]


def test_two_pieces_stay_two() -> None:
    mask = GRID.mask(box(-15, -15, 10, 30)) | GRID.mask(box(20, -15, 50, 30))
    found = clean(mask, 1.0, SegmentOptions())
    assert [m.sum() for m in found] == sorted((m.sum() for m in found), reverse=True)
    assert len(found) == 2


# --- constraints ---


def test_excluded_side_is_the_right_of_a_segment() -> None:
    excluded, crossing = carve(limits_of([segment((10, -5), (10, 15))], 10, 20), GRID)
    x, y = np.moveaxis(GRID.centres(), 2, 0)
    assert (excluded == ((x > 10) & (y > -5) & (y < 15))).all()
    assert crossing[0].sum() == 20  # one step right a row


def test_exclusion_ends_at_material_on_the_far_side() -> None:
    left, right = segment((10, -5), (10, 15)), segment((26, 15), (26, -5))
    excluded, _ = carve(limits_of([left, right], 10, 5), GRID)
    x, y = np.moveaxis(GRID.centres(), 2, 0)
    assert (excluded == ((x > 10) & (x < 26) & (y > -5) & (y < 15))).all()


def test_open_corner_is_closed() -> None:
    up, across = limits_of([segment((30, -10), (30, 12)), segment((25, 20), (-10, 20))], 10, 20)
    assert np.allclose(up.end, (30, 20))
    assert np.allclose(across.start, (30, 20))


def test_slanted_segment_moves_to_the_widest_height() -> None:
    normal = np.array([np.sqrt(0.5), 0, -np.sqrt(0.5)])  # leans outward going up
    (limit,) = limits_of([segment((10, 0), (10, 20), normal=normal, depth=0.0)], 8.0, 20)
    assert limit.start[0] == pytest.approx(18)


def test_pointed_end_stops_at_the_point() -> None:
    up, down = (np.array([np.sqrt(0.5), 0, s * np.sqrt(0.5)]) for s in (-1, 1))
    limits = limits_of([segment((10, 0), (10, 20), normal=up, depth=0.0),
                        segment((10, 0), (10, 20), normal=down, depth=8.0)], 8.0, 20)
    assert [limit.start[0] for limit in limits] == pytest.approx([14, 14], abs=0.1)


def test_pieces_of_one_contact_exclude_what_lies_between_them() -> None:
    first, second = segment((10, -15), (10, -5), contact=2), segment((10, 10), (10, 25), contact=2)
    other = segment((10, 10), (10, 25), contact=3)
    x, y = np.moveaxis(GRID.centres(), 2, 0)
    between = (x > 10) & (y > -5) & (y < 10)
    limits = limits_of([first, second], 10, 5)
    assert carve(limits, GRID)[0][between].all()
    assert [m.touching for m in limits] == [True, True, False]
    assert not carve(limits_of([first, other], 10, 5), GRID)[0][between & (y > 0) & (y < 5)].any()


def test_edge_seen_in_photographs_keeps_off_what_lies_beyond_but_not_the_exact_edge() -> None:
    limits = limits_of([segment((10, -15), (10, 25), origin="photo")], 10, 5)
    excluded, _ = carve(limits, GRID)
    x, y = np.moveaxis(GRID.centres(), 2, 0)
    beside = (y > -15) & (y < 25)
    assert not excluded[beside & (x < 12.9)].any()
    assert excluded[beside & (x > 13.1)].all()
    points = np.array([[11.4, 0.0]])
    assert (snap(points, np.array([0.2]), np.array([[1.0, 0.0]]), limits, 1.5)[0] == points).all()


def test_board_is_run_on_to_its_contact_only() -> None:
    mask = GRID.mask(box(-10, -10, 20, 20))
    contact, cut_plane = segment((40, -5), (40, 15)), segment((-15, 15), (-15, -5), origin="seam")
    filled = fill_to_contacts(mask, limits_of([contact, cut_plane], 10, 5), GRID, 60)
    assert (filled == mask | GRID.mask(box(19, -5, 40, 15))).all()


# --- scene ---


def test_slab_mesh_is_closed() -> None:
    import open3d as o3d

    region = box(0, 0, 40, 30).difference(box(10, 10, 20, 20))
    vertices, triangles = slab_mesh(region, 5.0)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(vertices.astype(np.float32), triangles.astype(np.uint32))
    points = np.array([[5, 5, 2], [15, 15, 2], [50, 5, 2], [5, 5, 6]], np.float32)
    assert scene.compute_occupancy(points).numpy().tolist() == [1, 0, 0, 0]


def test_what_lies_before_and_behind_a_plane() -> None:
    boards = [sheet(box(-50, -50, 50, 50), 100), sheet(box(-50, -50, 0, 50), 40), sheet(box(30, -50, 50, 50), 300)]
    occluders = Occluders(boards, [[b.region] for b in boards])
    points = np.array([[-20.0, 0, 110], [10, 0, 110], [25, 0, 110]])
    kinds = occluders.classify(0, looking_down(0, 0, 500), points)
    assert kinds.tolist() == [BOARD, CLEAR, CLEAR]
    assert occluders.classify(0, looking_down(60, 0, 500), points[2:]).tolist() == [OCCLUDED]


def test_cut_face_shows_on_the_side_of_the_camera() -> None:
    mask = GRID.mask(box(-10, -10, 30, 20))
    eye = np.array([55.0, 5.0, 40.0])
    view = BoardView(looking_down(0, 0, 500), 0, 10.0, 0.0, eye, 1.0, 1.0)
    band = cut_face_band(mask, view, GRID)
    row = np.flatnonzero(band[25])
    want = 30 + (55 - 30) * (1 - 30 / 40)  # the far edge, seen on the near plane
    assert GRID.to_xy(np.array([row.min(), 0]))[0] == pytest.approx(30.5, abs=1)
    assert GRID.to_xy(np.array([row.max(), 0]))[0] == pytest.approx(want, abs=1)


# --- appearance and cut ---


def test_mixture_tells_two_colours_apart() -> None:
    rng = np.random.default_rng(1)
    wood, floor = (rng.normal(m, 3, (5000, 3)).astype(np.float32) for m in ([70, 8, 25], [50, 0, 0]))
    inside, outside = (fit_mixture(c, 5, 2000, rng) for c in (wood, floor))
    ratio = inside.log_density(wood) - outside.log_density(wood)
    assert (ratio > 3).mean() > 0.99
    assert np.isfinite(outside.log_density(np.array([[1000.0, 0, 0]]))).all()


def test_shade_is_likelier_inside_with_shade() -> None:
    rng = np.random.default_rng(1)
    lit = fit_mixture(rng.normal([70, 8, 25], 2, (3000, 3)), 5, 2000, rng)
    dark = np.array([[86 * 0.75 - 16, 8 * 0.75, 25 * 0.75]])
    assert with_shade(lit).log_density(dark)[0] > lit.log_density(dark)[0] + 2


def test_too_few_colours_make_no_mixture() -> None:
    assert fit_mixture(np.zeros((3, 3)), 5, 100, np.random.default_rng(0)) is None


def test_agreeing_colours_are_one_surface() -> None:
    same, other, alone = same_surface(np.full((3, 3), 50.0), np.array([[51.0, 50, 50], [70, 50, 50], [np.nan] * 3]))
    assert same > other + 5
    assert alone == -np.inf


def test_cut_follows_evidence_seeds_and_constraints() -> None:
    x, y = np.moveaxis(GRID.centres(), 2, 0)
    evidence = np.where(x < 20, 1.0, -1.0)
    excluded, crossing = carve(limits_of([segment((-10, -10), (30, -10))], 10, 5), GRID)
    weights = smoothness_weights(np.zeros((4, *GRID.shape)), crossing, 3.0)
    inside = (abs(x) < 3) & (abs(y) < 3)
    mask = cut(evidence, weights, inside, excluded | (x < -18))
    assert mask[inside].all()
    assert not mask[excluded].any()
    assert mask[(x > -16) & (x < 19) & (y > -9)].all()
    assert not mask[x > 21].any()


def test_cut_looks_only_where_wood_may_be() -> None:
    x, y = np.moveaxis(GRID.centres(), 2, 0)
    evidence = np.where((x > 0) & (x < 12) & (y > 3) & (y < 20), 2.0, -2.0)
    weights = smoothness_weights(np.zeros((4, *GRID.shape)), np.zeros((4, *GRID.shape), bool), 0.1)
    inside, outside = np.hypot(x - 5, y - 10) < 2, np.hypot(x - 5, y - 10) > 15
    mask = cut(evidence, weights, inside, outside)
    assert (mask == ((evidence > 0) & ~outside)).mean() > 0.999
    assert not mask[outside].any()
    assert not cut(evidence, weights, inside, np.ones_like(inside)).any()


# --- boundary ---


def ring_chain(radius: float = 50.0, count: int = 300) -> Chain:
    angle = np.arange(count) / count * 2 * np.pi
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    return Chain(radius * normals, normals, np.zeros(count, int))


def scan_at(offset: np.ndarray, strength: float = 20.0) -> EdgeScan:
    offsets = np.arange(-4, 4 + PITCH / 2, PITCH)
    return EdgeScan(strength * np.exp(-((offsets - offset[:, None]) / 0.7) ** 2), np.ones(len(offset)), offsets)


def test_trace_and_peak_find_an_edge_between_samples() -> None:
    chain = ring_chain()
    true = 0.37 + 0.5 * np.sin(2 * np.arctan2(*chain.normals.T))
    scan = scan_at(true)
    offset, weight = view_offsets(scan, trace([scan], chain.ring))
    assert (weight > 0).all()
    assert abs(offset - true).max() < 0.03


def test_one_view_with_an_edge_elsewhere_is_outvoted() -> None:
    chain = ring_chain()
    still = np.zeros(len(chain.ring))
    path = trace([scan_at(still), scan_at(still), scan_at(still + 2.5, 60.0)], chain.ring)
    assert abs(path).max() <= PITCH


def test_registration_recovers_a_moved_view() -> None:
    chain, shift = ring_chain(), np.array([0.9, -0.6])
    still = np.zeros(len(chain.ring))
    scans = [scan_at(still), scan_at(still), scan_at(still), scan_at(chain.normals @ shift)]
    shifts, remains, agrees = registration(chain, scans)
    assert np.linalg.norm(shifts[3] - shift) < 0.3 * np.linalg.norm(shift)  # the poses' own say holds it back
    assert abs(shifts[:3]).max() < 0.05
    assert np.nanmax(remains) < 0.2
    assert agrees.min() > 0.4


def test_view_that_shows_no_boundary_does_not_agree() -> None:
    chain = ring_chain()
    still = np.zeros(len(chain.ring))
    elsewhere = EdgeScan(np.ones((len(still), 33)), np.ones(len(still)), scan_at(still).offsets)
    for last in (elsewhere, scan_at(still + 2.4)):
        _, _, agrees = registration(chain, [scan_at(still), scan_at(still), scan_at(still), last])
        assert agrees[3] < 0.1
    assert agrees[:3].min() > 1


def test_chain_runs_round_material_on_the_left() -> None:
    chain = chain_of(box(0, 0, 60, 40).difference(box(20, 10, 40, 30)), 1.0)
    material = box(0, 0, 60, 40).difference(box(20, 10, 40, 30)).buffer(0.2)
    assert not shapely.contains_xy(material, chain.moved(np.full(len(chain.points), 1.0))).any()
    outer, hole = (Polygon(chain.points[chain.ring == k]) for k in (0, 1))
    assert outer.exterior.is_ccw
    assert not hole.exterior.is_ccw


def test_snap_takes_the_segments_place_and_error() -> None:
    limits = limits_of([segment((60, 0), (60, 40))], 10, 5)
    chain = chain_of(box(0, 0, 61, 40), 1.0)
    points, error = snap(chain.points, np.full(len(chain.points), 0.5), chain.normals, limits, 2.0)
    on = (chain.normals[:, 0] > 0.9)
    assert np.allclose(points[on, 0], 60)
    assert (error[on] == 0.2).all()
    assert (error[chain.normals[:, 0] < 0] == 0.5).all()


def test_signed_distance_is_zero_on_the_boundary() -> None:
    distance = signed_distance(GRID.mask(box(-10, -10, 40, 20)), 1.0)
    assert distance[30, 40] > 8
    assert distance[25, 59] == pytest.approx(0.5)
    assert distance[25, 60] == pytest.approx(-0.5)


# --- the whole ---


@pytest.fixture(scope="module")
def tiny():
    """The tiny capture with rough boards: true poses, outlines wrong by some millimetres."""
    from kerfwright.synthetic import tiny_assembly, tiny_capture

    capture, model = tiny_capture(), tiny_assembly()
    sheets, truths = [], []
    for board in model.boards:
        outline = Polygon([e.start for e in board.cut_path.outer.edges])
        none = np.zeros(0, int)
        pose = np.array(board.model_from_board)
        sheets.append(Sheet(board.name, pose, board.thickness, True, outline.buffer(-5), none, none, none))
        truths.append(outline)
    return capture, sheets, truths


def iou(a: Polygon, b: Polygon) -> float:
    return a.intersection(b).area / a.union(b).area


def test_photographs_put_a_shrunk_outline_right(tiny) -> None:
    capture, sheets, truths = tiny
    result = segment_boards(sheets, [[], [], []], capture)[0]
    (outline,) = result.outlines
    assert result.fallback is None
    assert outline.origin == "images"
    assert iou(truths[0], Polygon(outline.loops[0].points)) > max(0.97, iou(truths[0], sheets[0].region))
    assert np.isfinite(outline.loops[0].standard_error).all()
    assert (outline.loops[0].standard_error > 0).all()


def test_same_bytes_whatever_the_threads(tiny) -> None:
    capture, sheets, _ = tiny
    runs = [segment_boards(sheets, [[], [], []], capture, SegmentOptions(threads=n)) for n in (1, 3)]
    for a, b in zip(*runs, strict=True):
        assert a.outlines[0].loops[0].points.tobytes() == b.outlines[0].loops[0].points.tobytes()


def test_without_photographs_the_cloud_outline_stays_and_says_so(tiny) -> None:
    capture, sheets, _ = tiny
    results = segment_boards(sheets, [[], [], []], capture, SegmentOptions(use_images=False))
    for rough, result in zip(sheets, results, strict=True):
        assert result.outlines[0].origin == "cloud"
        assert "not to be used" in result.fallback
        assert iou(rough.region, Polygon(result.outlines[0].loops[0].points)) > 0.98


def test_a_board_out_of_sight_falls_back(tiny) -> None:
    capture, sheets, _ = tiny
    below = np.array(sheets[0].world_from_board)
    below[2, 3] = -500.0
    result = segment_boards([replace(sheets[0], world_from_board=below)], [[]], capture)[0]
    assert "no photograph" in result.fallback


def test_constraints_must_match_the_sheets(tiny) -> None:
    capture, sheets, _ = tiny
    with pytest.raises(OptionError, match="constraints"):
        segment_boards(sheets, [[]], capture)


# --- openings ---


def views_of_a_hole(hole: np.ndarray, moves: bool) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Five views of wood with a patch: another colour in each of them, or the same dark one in all."""
    rng = np.random.default_rng(3)
    labs = []
    for k in range(5):
        lab = rng.normal([70, 8, 25], 1.0, (*GRID.shape, 3)).astype(np.float32)
        lab[hole] = (25 + 14 * k * moves, 2, 5 + 5 * k * moves)
        labs.append(lab)
    return labs, [np.ones(GRID.shape, bool)] * 5


def apart_in(labs: list[np.ndarray], seen: list[np.ndarray]) -> np.ndarray:
    return disagreement(labs, seen, [1] * len(labs))


def spread_points(mask: np.ndarray) -> np.ndarray:
    return GRID.centres()[mask][::3]


def test_hole_that_the_cloud_closed_is_opened() -> None:
    board, hole = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, 0, 30, 18))
    labs, seen = views_of_a_hole(hole, moves=True)
    found = openings(labs, seen, apart_in(labs, seen), board, spread_points(board & ~hole), GRID, 4.0)
    assert (found & hole).sum() > 0.95 * hole.sum()
    assert not (found & ~hole).any()


def test_knot_and_shadow_look_alike_from_everywhere_and_stay() -> None:
    board, knot = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, 0, 30, 18))
    labs, seen = views_of_a_hole(knot, moves=False)
    assert not openings(labs, seen, apart_in(labs, seen), board, spread_points(board & ~knot), GRID, 4.0).any()


def test_wood_that_the_cloud_shows_is_not_opened() -> None:
    board, hidden = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, 0, 30, 18))
    labs, seen = views_of_a_hole(hidden, moves=True)
    assert not openings(labs, seen, apart_in(labs, seen), board, spread_points(board), GRID, 4.0).any()


def test_one_glossy_view_opens_nothing() -> None:
    board, glint = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, 0, 30, 18))
    labs, seen = views_of_a_hole(glint, moves=False)
    for lab in labs:
        lab[glint] = (70, 8, 25)
    labs[2][glint] = (98, 0, 0)
    assert not openings(labs, seen, apart_in(labs, seen), board, spread_points(board & ~glint), GRID, 4.0).any()


def test_open_at_the_rim_is_no_hole() -> None:
    board, bay = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, -20, 30, 18))
    labs, seen = views_of_a_hole(bay, moves=True)
    assert not openings(labs, seen, apart_in(labs, seen), board, spread_points(board & ~bay), GRID, 4.0).any()


def test_opening_is_outside_and_its_edge_is_asked_for() -> None:
    board, hole = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, 0, 30, 18))
    seeds = seeds_of(board, np.zeros_like(board), np.zeros_like(board), Bounds(4.0, 8.0), 1.0)
    opened = open_seeds(seeds, hole, 1.0)
    assert opened.outside[GRID.mask(box(9, 4, 26, 14))].all()
    assert not opened.inside[GRID.mask(box(0, -5, 35, 23))].any()
    assert seeds.inside[hole].all()
    assert open_seeds(seeds, np.zeros_like(hole), 1.0) is seeds


# --- holes that are none ---


def views_of_wood(patch: np.ndarray, colour: tuple[float, float, float]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Five views of wood with a patch of one colour."""
    labs, seen = views_of_a_hole(patch, moves=False)
    rng = np.random.default_rng(4)
    for lab in labs:
        lab[patch] = rng.normal(colour, 1.0, (patch.sum(), 3))
    return labs, seen


@pytest.mark.parametrize(
    ("colour", "moves", "stays"),
    [((70, 8, 25), False, False), ((74, 8, 22), False, False), ((40, 8, 25), False, True), (None, True, True)],
)
def test_holes_in_which_the_photographs_show_the_same_wood_are_filled(colour, moves: bool, stays: bool) -> None:
    board, hole = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, 0, 30, 18))
    labs, seen = views_of_a_hole(hole, moves=True) if moves else views_of_wood(hole, colour)
    left = without_false_holes(board & ~hole, labs, seen, apart_in(labs, seen), 1.0)
    assert np.array_equal(left, board & ~hole if stays else board)


def test_hole_is_filled_though_one_view_has_a_shadow_in_it() -> None:
    board, hole = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, 0, 30, 18))
    labs, seen = views_of_wood(hole, (70, 8, 25))
    labs[1][hole] = (30, 0, 10)
    assert without_false_holes(board & ~hole, labs, seen, apart_in(labs, seen), 1.0)[hole].all()


def test_hole_that_two_views_show_is_left_to_the_cloud() -> None:
    board, hole = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(box(5, 0, 30, 18))
    labs, seen = views_of_wood(hole, (70, 8, 25))
    seen = [*seen[:2], *[s & ~hole for s in seen[2:]]]
    assert not without_false_holes(board & ~hole, labs, seen, apart_in(labs, seen), 1.0)[hole].any()


# --- drilled holes ---


def drilled(labs: list[np.ndarray], points: np.ndarray) -> np.ndarray:
    seen = [np.ones(GRID.shape, bool)] * len(labs)
    board = GRID.mask(box(-16, -16, 56, 36))
    return drilled_holes(labs, seen, [1] * len(labs), apart_in(labs, seen), board, points, GRID)


def views_of_a_bore(bore: np.ndarray, moves: bool) -> list[np.ndarray]:
    """Five views of wood with a dark place; the stripes in it lie elsewhere in each of them, or in one place."""
    labs, _ = views_of_wood(bore, (55, 8, 25))
    columns = GRID.centres()[..., 0]
    for k, lab in enumerate(labs):
        lab[bore, 0] += 8 * np.sin(columns[bore] / 2 + 2 * k * moves)
    return labs


def test_small_round_hole_is_found_by_its_rim() -> None:
    bore = GRID.mask(Point(20, 10).buffer(6.0))
    found = drilled(views_of_a_bore(bore, moves=True), spread_points(~bore))
    assert (found & bore).sum() > 0.9 * bore.sum()
    assert (found & ~bore).sum() < 0.15 * bore.sum()


def test_plug_is_no_hole_nor_is_a_dark_place_that_the_cloud_shows() -> None:
    bore = GRID.mask(Point(20, 10).buffer(6.0))
    assert not drilled(views_of_a_bore(bore, moves=False), spread_points(~bore)).any()
    assert not drilled(views_of_a_bore(bore, moves=True), spread_points(np.ones(GRID.shape, bool))).any()


def test_square_place_is_not_drilled() -> None:
    patch = GRID.mask(box(12, 2, 28, 18))
    assert not drilled(views_of_a_bore(patch, moves=True), spread_points(~patch)).any()


def test_rim_of_a_drilled_hole_is_asked_for_and_wood_lies_round_it() -> None:
    board, bore = GRID.mask(box(-16, -16, 56, 36)), GRID.mask(Point(20, 10).buffer(6.0))
    seeds = seeds_of(board, np.zeros_like(board), np.zeros_like(board), Bounds(4.0, 8.0), 1.0)
    told = drilled_seeds(seeds, bore, 1.0)
    assert told.outside[GRID.mask(Point(20, 10).buffer(4.0))].all()
    assert told.inside[GRID.mask(Point(20, 10).buffer(9.0)) & ~GRID.mask(Point(20, 10).buffer(8.0))].all()
    assert drilled_seeds(seeds, np.zeros_like(bore), 1.0) is seeds


# --- views and exposure ---


def test_exposure_is_evened_out_within_a_side() -> None:
    wood = np.full((6, 8, 3), (150, 120, 90), np.uint8)
    images = [wood, (wood * 0.8).astype(np.uint8), (wood * 1.2).astype(np.uint8), (wood * 0.5).astype(np.uint8)]
    everywhere = [np.ones((6, 8), bool)] * 4
    top, darker, brighter, other_side = even_out(images, everywhere, [1, 1, 1, -1])
    assert abs(darker - top).max() < 1
    assert abs(brighter - top).max() < 1
    assert other_side[..., 0].mean() < top[..., 0].mean() - 10


def test_views_are_picked_until_all_is_seen_and_no_more_than_allowed(tiny) -> None:
    capture, sheets, _ = tiny
    occluders = Occluders(sheets, [[s.region] for s in sheets])
    for allowed in (1, 2, 7):
        views = choose_views(sheets[1], 1, capture.views, occluders, SegmentOptions(max_views=allowed))
        assert len(views) <= allowed
        assert len({v.view.name for v in views}) == len(views)
    assert {v.side for v in views} == {1, -1}


def test_wood_right_behind_cut_faces_is_certain():
    """Points on the right edge, and on a step 6 mm inside of the left one: only the right edge is where it seems."""
    grid = Grid(np.zeros(2), 1.0, (60, 80))
    mask = grid.mask(box(10, 10, 70, 50))
    along = np.linspace(12, 48, 60)
    points = np.concatenate([np.c_[np.full(60, x), along] for x in (69.8, 16.0)])
    walled = behind_cut_faces(mask, points, grid, 2.5)
    assert walled[30, 60] and walled[30, 66] and not walled[30, 69]
    assert not walled[30, 14] and not walled[30, 20]
    assert not behind_cut_faces(mask, points[:3], grid, 2.5).any()


def test_a_tongue_of_fringe_is_not_certain():
    grid = Grid(np.zeros(2), 1.0, (100, 120))
    mask = grid.mask(box(10, 10, 90, 90) | box(90, 40, 102, 52))
    ends = np.linspace(40, 52, 30)
    points = np.concatenate([np.c_[np.full(30, 102.0), ends], np.c_[np.full(60, 90.0), np.linspace(12, 36, 60)]])
    walled = behind_cut_faces(mask, points, grid, 2.5)
    assert walled[25, 80] and not walled[46, 97]
