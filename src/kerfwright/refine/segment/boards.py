"""All boards of an object, in rounds.

Each round every board is cut out of the photographs, the others being as the last round left them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from shapely import union_all
from shapely.geometry import LineString, Polygon

from kerfwright.assemble.types import ConstraintSegment
from kerfwright.capture.types import Capture
from kerfwright.errors import OptionError
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.types import Sheet
from kerfwright.parallel import each
from kerfwright.refine.segment._pixels import add_contrast
from kerfwright.refine.segment.boundary import Chain, chain_of, loops_of, open_chain, registration, settle, snap
from kerfwright.refine.segment.constraints import Limit, carve, fill_to_contacts, limits_of, margins
from kerfwright.refine.segment.drilled import drilled_holes, drilled_seeds
from kerfwright.refine.segment.edges import EdgeScan, agreed_strength, scan_edges
from kerfwright.refine.segment.evidence import (
    Bounds,
    Seeds,
    ViewEvidence,
    average,
    backed_pixels,
    behind_cut_faces,
    classes_on_grid,
    cut_face_band,
    free_pixels,
    gather,
    grown,
    seeds_of,
    side_sums,
)
from kerfwright.refine.segment.graphcut import STEPS, cut, smoothness_weights
from kerfwright.refine.segment.grid import Grid, grid_over
from kerfwright.refine.segment.holes import without_false_holes
from kerfwright.refine.segment.openings import disagreement, open_seeds, openings
from kerfwright.refine.segment.options import BoardOutlines, SegmentOptions
from kerfwright.refine.segment.rectify import Photos, even_out, rectify
from kerfwright.refine.segment.scene import OCCLUDED, Occluders
from kerfwright.refine.segment.straight import straightened
from kerfwright.refine.segment.topology import clean, pieces
from kerfwright.refine.segment.views import BoardView, choose_views
from kerfwright.refine.types import Outline

__all__ = ["segment_boards"]

CORNER_REACH = 2.0  # thicknesses over which an open corner between constraint segments is closed
DISAGREES = 1.2  # mm that a registered view may still differ by from the others before it is left out
LEAST_AGREEMENT = 0.1  # clearness of a view's boundary, in that of the others, below which it is left out; good views
# against wood or in the dark have .17 and more
LEAST_KNOWN = 0.5  # of a further piece's area that the rough outline had too
LARGEST_SHIFT = 3.0  # mm; poses good to half a pixel need far less


@dataclass(frozen=True, eq=False)
class _Board:
    """One board between rounds."""

    idx: int
    sheet: Sheet
    limits: list[Limit]
    grid: Grid
    views: list[BoardView]
    shifts: list[np.ndarray]  # (2,) mm a view
    excluded: np.ndarray  # by constraint segments
    crossing: np.ndarray
    masks: list[np.ndarray]  # one a piece
    regions: list[Polygon]  # the same as polygons
    beyond: np.ndarray  # just past the segments it is known to touch: there the outline's error has no say
    backed: np.ndarray  # pixels whose nearest place on the rough outline has a cut face or a contact
    walled: np.ndarray  # pixels close behind cut faces: wood for certain
    rough: np.ndarray  # the mask before the first round
    free: np.ndarray  # pixels where cameras saw through the board's middle
    face: np.ndarray  # (N, 2) the cloud's points on the sheet faces, mm
    left_out: tuple[str, ...] = ()

    @property
    def mask(self) -> np.ndarray:
        return np.any(self.masks, axis=0)


@dataclass(frozen=True, eq=False)
class _Looks:
    """What the photographs show of a board in one round, an entry a view, all on the board's raster."""

    labs: np.ndarray  # (V, rows, cols, 3)
    seen: np.ndarray  # (V, rows, cols)
    kinds: list[np.ndarray]
    cores: list[np.ndarray]  # seen, and inside for certain
    sides: list[int]

    @cached_property
    def apart(self) -> np.ndarray:
        """(rows, cols) disagreement of the photographs, LAB units squared."""
        return disagreement(self.labs, self.seen, self.sides)


def segment_boards(
    sheets: Sequence[Sheet], constraints: Sequence[Sequence[ConstraintSegment]], capture: Capture,
    options: SegmentOptions | None = None, free: FreeSpace | None = None,
) -> list[BoardOutlines]:
    """Outlines of all boards (paper, Joint Image-Based Segmentation).

    Parameters
    ----------
    sheets : rough boards, world frame of `capture`, millimetres.
    constraints : `constraints[i]` belongs to `sheets[i]`.
    capture : prepared: +z up, floor at z = 0.
    free : what the cameras saw through; there is no wood.

    Returns
    -------
    One BoardOutlines a sheet, in order: one Outline a connected piece, largest first. A board that no photograph
    shows well keeps the cloud's outline, and `fallback` says why.

    Raises
    ------
    OptionError when there is not one list of constraints a sheet; CaptureError when a photograph cannot be read.
    """
    options = options or SegmentOptions()
    if len(sheets) != len(constraints):
        raise OptionError(f"constraints: length: {len(constraints)} for {len(sheets)} sheets: give one list a sheet")
    photos = Photos()
    occluders = Occluders(sheets, [[s.region] for s in sheets])
    boards = each(
        lambda i: _begin(i, sheets[i], constraints[i], capture, occluders, free, options), range(len(sheets)),
        options.threads,
    )
    for round_idx in range(options.rounds):
        last = boards
        boards = each(
            lambda b: _round(b, last, occluders, photos, options, round_idx), boards, options.threads  # noqa: B023
        )
        occluders = Occluders(sheets, [b.regions for b in boards])
    return each(lambda b: _finish(b, capture, occluders, photos, options), boards, options.threads)


def _begin(
    idx: int, sheet: Sheet, constraints: Sequence[ConstraintSegment], capture: Capture, occluders: Occluders,
    free: FreeSpace | None, options: SegmentOptions,
) -> _Board:
    """A board before its first round: views, raster, constraints."""
    views = choose_views(sheet, idx, capture.views, occluders, options) if options.use_images else []
    densities = [v.density for v in views] or [1.0]
    pixel = options.pixel or float(np.clip(1 / np.median(densities), options.min_pixel, options.max_pixel))
    limits = limits_of(constraints, sheet.thickness.value, CORNER_REACH * sheet.thickness.value)
    covered = _ground_covered(sheet.region, limits, options.contact_reach)
    grid = grid_over(covered, options.unbacked_margin + 4 * pixel, pixel, options.max_grid)
    excluded, crossing = carve(limits, grid)
    mask = fill_to_contacts(grid.mask(sheet.region) & ~excluded, limits, grid, options.contact_reach)
    shifts = [np.zeros(2) for _ in views]
    beyond = grid.mask(margins(limits, 2 * options.outline_error))
    cut_points = sheet.to_board(capture.cloud.points[sheet.cut_idx])[:, :2]
    backed = backed_pixels(mask, beyond, cut_points, grid, options.outline_error)
    walled = behind_cut_faces(mask, cut_points, grid, options.cut_face_error)
    seen_through = free_pixels(sheet, grid, free) if free else np.zeros(grid.shape, bool)
    faces = np.concatenate([sheet.top_idx, sheet.bottom_idx])
    return _Board(idx, sheet, limits, grid, views, shifts, excluded, crossing, [mask], [sheet.region], beyond, backed,
                  walled, mask, seen_through & ~mask, sheet.to_board(capture.cloud.points[faces])[:, :2])


def _ground_covered(region: Polygon, limits: Sequence[Limit], reach: float) -> Polygon:
    """The region and the segments near enough for the board to be run on to them."""
    lines = [LineString([m.start, m.end]) for m in limits if m.touching]
    return union_all([region, *(line for line in lines if line.distance(region) < reach)]).envelope


def _round(
    board: _Board, boards: Sequence[_Board], occluders: Occluders, photos: Photos, options: SegmentOptions,
    round_idx: int,
) -> _Board:
    """One round of a board: evidence, cut, pieces, and how far its views must be moved."""
    if not board.views:
        return board
    error, bounds = _bounds(board, options, first=round_idx == 0)
    forbidden = board.excluded | board.free | _taken(board, boards, error)
    seeds = seeds_of(board.mask, board.beyond, forbidden, bounds, board.grid.pixel)
    if not seeds.inside.any():
        return replace(board, views=[], shifts=[])
    looks = _look(board, seeds, error, occluders, photos)
    opened, drilled = _opened(board, looks, options) if round_idx > 0 else [np.zeros(board.grid.shape, bool)] * 2
    seeds = replace(seeds, inside=seeds.inside | board.walled & ~forbidden)
    seeds = drilled_seeds(open_seeds(seeds, opened, board.grid.pixel), drilled & ~opened, board.grid.pixel)
    evidences, contrasts = _evidence(board, looks, opened | drilled, seeds, error, options)
    if not evidences:
        return replace(board, views=[], shifts=[])
    weights = smoothness_weights(contrasts, board.crossing, options.smoothness)
    mask = cut(average(evidences, seeds), weights, seeds.inside, seeds.outside)
    masks = [without_false_holes(m, looks.labs, looks.seen, looks.apart, board.grid.pixel)
             for m in _own(clean(mask, board.grid.pixel, options), board.rough)]
    if not masks:
        return replace(board, views=[], shifts=[])
    board = replace(board, masks=masks, regions=[pieces(m, board.grid) for m in masks])
    return _registered(board, occluders, photos, options)


def _opened(board: _Board, looks: _Looks, options: SegmentOptions) -> tuple[np.ndarray, np.ndarray]:
    """Openings and drilled holes, the rough outline may not know of them; from the second round, when what hides the
    board is known.
    """
    rest = (board.mask, board.face, board.grid)
    opened = openings(looks.labs, looks.seen, looks.apart, *rest, options.refined_error)
    return opened, drilled_holes(looks.labs, looks.seen, looks.sides, looks.apart, *rest)


def _own(masks: list[np.ndarray], rough: np.ndarray) -> list[np.ndarray]:
    """The largest piece, and those others that the cloud knew of: dark places beside a board look like anything."""
    return masks[:1] + [m for m in masks[1:] if (m & rough).sum() > LEAST_KNOWN * m.sum()]


def _bounds(board: _Board, options: SegmentOptions, first: bool) -> tuple[float, Bounds]:
    """How wrong the outline so far may be: mm where it is backed, and pixel by pixel."""
    if not first:
        return options.refined_error, Bounds(options.refined_error, options.outline_error)
    errors = np.where(board.backed, options.outline_error, options.unbacked_error).astype(np.float32)
    margins_ = np.where(board.backed, options.search_margin, options.unbacked_margin).astype(np.float32)
    return options.outline_error, Bounds(errors, margins_)


def _taken(board: _Board, boards: Sequence[_Board], error: float) -> np.ndarray:
    """Pixels whose point half way through the board lies inside another board, its margin of error taken off."""
    taken = np.zeros(board.grid.shape, bool)
    for other in boards:
        if other.idx == board.idx:
            continue
        other_from_board = np.linalg.inv(other.sheet.world_from_board) @ board.sheet.world_from_board
        middle = other_from_board @ [0, 0, board.sheet.thickness.value / 2, 1]
        at = board.grid.affine(np.column_stack([other_from_board[:3, :2], middle[:3]]))
        depth = np.minimum(at[2], other.sheet.thickness.value - at[2])
        near = depth > min(1.0, other.sheet.thickness.value / 8)
        if near.any():
            core = grown(other.mask & ~other.excluded, -error, other.grid.pixel)
            taken[near] |= other.grid.lookup(core, at[:2, near].T, False)
    return taken


def _look(
    board: _Board, seeds: Seeds, error: float, occluders: Occluders, photos: Photos
) -> _Looks:
    """The board's views on its raster, exposure evened out, and what they see at each pixel."""
    rectified = [rectify(photos, board.sheet, v, board.grid, s) for v, s in zip(board.views, board.shifts, strict=True)]
    kinds = [classes_on_grid(board.sheet, board.idx, v, board.grid, occluders, error) for v in board.views]
    cores = [seeds.inside & held & (k < OCCLUDED) for (_, held), k in zip(rectified, kinds, strict=True)]
    sides = [v.side for v in board.views]
    labs = even_out([image for image, _ in rectified], cores, sides)
    seen = np.stack([held & (kind != OCCLUDED) for (_, held), kind in zip(rectified, kinds, strict=True)])
    return _Looks(labs, seen, kinds, cores, sides)


def _evidence(
    board: _Board, looks: _Looks, opened: np.ndarray, seeds: Seeds, error: float, options: SegmentOptions
) -> tuple[list[ViewEvidence], np.ndarray]:
    """Every view's evidence, and the contrast averaged over the views that see a pixel."""
    rng = np.random.default_rng([options.seed, board.idx])
    sums = side_sums(looks.labs, looks.seen, looks.sides)
    shape, solid = board.grid.shape, board.mask & ~opened
    evidences, total, count = [], np.zeros((len(STEPS), *shape), np.float32), np.full(shape, 1e-6, np.float32)
    for view, lab, side, shown, kind, core in zip(
        board.views, looks.labs, looks.sides, looks.seen, looks.kinds, looks.cores, strict=True
    ):
        band = grown(cut_face_band(solid, view, board.grid), error / 2, board.grid.pixel) & ~seeds.inside
        said = gather(lab, sums[side], shown, kind, band, seeds, options, rng)
        if said is not None:
            evidences.append(said)
            add_contrast(lab, shown, core, total)
            count += shown
    return evidences, total / count


def _chain(board: _Board, k: int, options: SegmentOptions) -> Chain:
    return chain_of(board.regions[k], options.step)


def _scans(
    board: _Board, chain: Chain, occluders: Occluders, photos: Photos, options: SegmentOptions
) -> list[EdgeScan]:
    return [
        scan_edges(chain.points, chain.normals, chain.ring, board.sheet, board.idx, view, photos, occluders,
                   board.mask, board.grid, shift, options.reach)
        for view, shift in zip(board.views, board.shifts, strict=True)
    ]


def _registered(board: _Board, occluders: Occluders, photos: Photos, options: SegmentOptions) -> _Board:
    """Views that disagree with the others are moved to them, or left out."""
    if len(board.views) < 3:
        return board
    chain = _chain(board, 0, options)
    shifts, remains, agrees = registration(chain, _scans(board, chain, occluders, photos, options))
    moved = [old + new for old, new in zip(board.shifts, shifts, strict=True)]
    keep = [k for k, (s, r, a) in enumerate(zip(moved, remains, agrees, strict=True))
            if not r > DISAGREES and not a < LEAST_AGREEMENT and np.linalg.norm(s) < LARGEST_SHIFT]
    if len(keep) < 2:
        return board
    names = tuple(v.view.name for k, v in enumerate(board.views) if k not in keep)
    return replace(
        board, views=[board.views[k] for k in keep], shifts=[moved[k] for k in keep], left_out=board.left_out + names
    )


def _finish(
    board: _Board, capture: Capture, occluders: Occluders, photos: Photos, options: SegmentOptions
) -> BoardOutlines:
    """Exact boundaries of every piece, or the cloud's outline."""
    if not board.views:
        return _from_cloud(board, options)
    outlines = [_outline(board, k, capture, occluders, photos, options) for k in range(len(board.regions))]
    largest = max((float(np.linalg.norm(s)) for s in board.shifts), default=0.0)
    names = tuple(v.view.name for v in board.views)
    return BoardOutlines(tuple(outlines), names, board.left_out, None, board.grid.pixel, largest)


def _outline(
    board: _Board, k: int, capture: Capture, occluders: Occluders, photos: Photos, options: SegmentOptions
) -> Outline:
    chain = chain_of(straightened(board.regions[k], partial(_shown, board, occluders, photos, options)), options.step)
    scans = _scans(board, chain, occluders, photos, options)
    cut_points = board.sheet.to_board(capture.cloud.points[board.sheet.cut_idx])[:, :2]
    offset, error = settle(chain, scans, cut_points, board.grid.pixel, options)
    points, error = snap(chain.moved(offset), error, chain.normals, board.limits, 2 * board.grid.pixel)
    return Outline(loops_of(chain, points, error), "images", len(board.views))


def _shown(
    board: _Board, occluders: Occluders, photos: Photos, options: SegmentOptions, points: np.ndarray
) -> np.ndarray:
    """How clearly the views together show an edge at (N, 2) points of an open line; NaN where none shows the place."""
    chain = open_chain(points)
    return agreed_strength(_scans(board, chain, occluders, photos, options))


def _from_cloud(board: _Board, options: SegmentOptions) -> BoardOutlines:
    """The rough region, cut back to its constraints."""
    why = "no photograph shows the board well" if options.use_images else "photographs were not to be used"
    carved = clean(board.grid.mask(board.sheet.region) & ~board.excluded, board.grid.pixel, options)
    chain = chain_of(pieces(carved[0], board.grid) if carved else board.sheet.region, options.step)
    error = np.full(len(chain.points), options.outline_error / 2)
    points, error = snap(chain.points, error, chain.normals, board.limits, options.outline_error)
    outline = Outline(loops_of(chain, points, error), "cloud", 0)
    return BoardOutlines((outline,), fallback=why, pixel=board.grid.pixel)
