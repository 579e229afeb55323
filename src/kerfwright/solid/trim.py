"""Boards trimmed to each other: what a fitted outline runs into a neighbour is cut off, and contacts are measured.

Fits leave slits where an outline doubles back on itself, and outlines hundredths of a millimetre inside the boards
beside them. Where a board ends on another's sheet, or on its edge, the whole edge is put there; elsewhere only what
lies in the neighbour goes. A board that ends on one sheet only is then moved onto it, within its own plane. Deeper
overlaps are no slip of a fit and are left for the checker to report.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.errors import ModelError
from kerfwright.model import Board, Contact, CutPath, Line, Loop, Model
from kerfwright.model.clip import ConvexArea, clipped_loop
from kerfwright.model.frames import board_from_model, model_from_board, rows, transform_points
from kerfwright.model.geometry import edge_points, sample_loop, transform_path
from kerfwright.model.slits import without_idle_nodes, without_slits
from kerfwright.solid.build import board_solid, location
from kerfwright.solid.contacts import interface_polygons, meet
from kerfwright.solid.faces import FlatFace, Shape, shape_of
from kerfwright.solid.interference import common_solid, near_pairs, penetration
from kerfwright.solid.sound import solid_problem

if TYPE_CHECKING:
    from shapely.geometry import Polygon

__all__ = ["TrimOptions", "fitted_together"]

ENDING = (1, 2)  # types of contact at which b ends on a's sheet
PROBES = np.linspace(0, 1, 129)  # where an edge is asked how deep it runs into a neighbour
MOST_CUTS = 8  # of a pair: a board seldom runs into another in more places


@dataclass(frozen=True)
class TrimOptions:
    """What counts as a slip of a fit, as shares of the object's size, and what as rounding, in mm and mm3."""

    touch: float = 1e-3  # mm; boards less deep in each other do not run into each other
    volume: float = 0.01  # mm3, the same for what they share
    deepest: float = 1 / 1000  # a deeper overlap is no slip of a fit
    clear: float = 0.6  # mm left where boards without a contact are trimmed; nearer faces would pass for a gap
    end: float = 1 / 10000  # depth up to which a whole edge is moved onto the sheet that it ends on
    slit: float = 1 / 1000  # what doubles back on itself closer than this is a slip of a fit, no slot
    around: float = 1 / 500  # how far about the overlap an outline may change
    reach: float = 1 / 1000  # from which faces do not meet
    tilt: float = 1.0  # degrees by which faces that meet may turn from each other

    def of_size(self, size: float) -> TrimOptions:
        """With lengths in mm, for an object of that size."""
        lengths = ("deepest", "end", "slit", "around", "reach")
        return replace(self, **{name: size * getattr(self, name) for name in lengths})


def fitted_together(model: Model, options: TrimOptions | None = None) -> Model:
    """The model, boards trimmed where they run a little into each other, contacts as the solids have them.

    A board that has no solid is left as it is: the checker tells why.
    """
    if not model.boards:
        return model
    options = (options or TrimOptions()).of_size(_size(model))
    boards = _without_slits(model, options.slit)
    shapes = dict(_shapes(boards.values()))
    meeting = {frozenset((c.a, c.b)): c for c in model.contacts}
    for a, b in near_pairs(list(shapes.values()), 0.0):
        contact = meeting.get(frozenset((a.name, b.name)))
        for _ in range(MOST_CUTS):
            ways = _yielding(shapes[a.name], shapes[b.name], contact)
            tried = (_trimmed(boards, shapes[name], shapes[other], contact, options) for name, other in ways)
            trimmed = next((found for found in tried if found is not None), None)
            if trimmed is None:
                break
            boards |= trimmed
            shapes |= dict(_shapes(trimmed.values()))
    seated = dict(_seated(boards, shapes, model.contacts, options))
    boards |= seated
    shapes |= dict(_shapes(seated.values()))
    model = model.model_copy(update={"boards": tuple(boards[board.name] for board in model.boards)})
    return model.model_copy(update={"contacts": tuple(_measured(c, options, shapes) for c in model.contacts)})


def _size(model: Model) -> float:
    """The largest side of the boards' outlines, mm."""
    points = []
    for board in model.boards:
        flat = sample_loop(board.cut_path.outer)
        points.append(transform_points(model_from_board(board), np.column_stack([flat, np.zeros(len(flat))])))
    return float(np.ptp(np.concatenate(points), axis=0).max())


def _without_slits(model: Model, width: float) -> dict[str, Board]:
    """The boards by name, bridged where their outlines double back; repeats stay repeats."""
    boards = {board.name: board for board in model.boards}
    for board in model.boards:
        outline = boards[board.name].cut_path.outer
        loop = without_slits(outline, width)
        if loop != outline:
            family = _family(boards, board, loop)
            boards |= family if not any(map(solid_problem, family.values())) else {}
    return boards


def _shapes(boards: Iterable[Board]) -> Iterator[tuple[str, Shape]]:
    """Every board that has a solid, by name."""
    for board in boards:
        try:
            solid = board_solid(board).moved(location(model_from_board(board)))
        except ModelError:
            continue
        yield board.name, shape_of(board.name, solid)


def _measured(contact: Contact, options: TrimOptions, shapes: dict[str, Shape]) -> Contact:
    """The contact with the area and the outline on which its boards' solids meet; as it is, where they do not."""
    if not {contact.a, contact.b} <= shapes.keys():
        return contact
    asked = (shapes[contact.a], shapes[contact.b], np.array(contact.normal), options.reach, np.radians(options.tilt))
    meeting = meet(*asked)
    if meeting is None:
        return contact
    interface = tuple(tuple(tuple(map(float, p)) for p in outline) for outline in interface_polygons(*asked))
    return contact.model_copy(update={"area": meeting.area, "interface": interface})


def _yielding(a: Shape, b: Shape, contact: Contact | None) -> list[tuple[str, str]]:
    """Which of two boards is to be trimmed, and the other: the one that ends there, else the smaller one first."""
    if contact is not None and contact.type in ENDING:
        return [(contact.b, contact.a)]
    small, large = sorted((a, b), key=lambda shape: shape.solid.volume)
    return [(small.name, large.name), (large.name, small.name)]


def _trimmed(
    boards: dict[str, Board], own: Shape, other: Shape, contact: Contact | None, options: TrimOptions
) -> dict[str, Board] | None:
    """The board and its repeats without what the other fills; None where nothing is to be trimmed or it cannot be."""
    if penetration(own, other) <= options.touch:
        return None
    shared = common_solid(own, other)
    if shared.volume <= options.volume:
        return None
    board = boards[own.name]
    pieces = [shape_of(own.name, solid) for solid in shared.solids()]
    for area in _areas(board, other, pieces, contact, options):
        loop = clipped_loop(board.cut_path.outer, area)
        if loop is not None:
            loop = without_idle_nodes(loop, options.touch)
            family = _family(boards, board, loop)
            if not any(map(solid_problem, family.values())):
                return family
    return None


def _seated(
    boards: dict[str, Board], shapes: dict[str, Shape], contacts: tuple[Contact, ...], options: TrimOptions
) -> Iterator[tuple[str, Board]]:
    """Boards that end on one other only, turned and moved within their sheet planes by a hair so that they lie on it.

    Repeats have one outline, and turns that are not quite the same: cut to fit one of them, it leaves a gap at another.
    """
    ending = [contact for contact in contacts if contact.type in ENDING]
    for contact in ending:
        if sum(c.b == contact.b for c in ending) > 1 or not {contact.a, contact.b} <= shapes.keys():
            continue
        board = boards[contact.b]
        for normal, offset in _sheet_lines(board, shapes[contact.a], contact, options):
            edges = list(_edges_along(board, normal, offset, options.end))
            if len(edges) == 1 and np.abs(edges[0] @ normal - offset).max() > options.touch:
                pose = model_from_board(board) @ _motion_onto(edges[0], normal, offset)
                yield board.name, board.model_copy(update={"model_from_board": rows(pose)})


def _edges_along(board: Board, normal: np.ndarray, offset: float, within: float) -> Iterator[np.ndarray]:
    """Ends (2, 2) of the straight edges that all but lie on a line."""
    for edge in board.cut_path.outer.edges:
        if isinstance(edge, Line):
            ends = np.array([edge.start, edge.end])
            if np.abs(ends @ normal - offset).max() <= within:
                yield ends


def _motion_onto(edge: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """The motion (4, 4) in the board's plane about the middle of an edge that lays it on a line, the board inside."""
    (x, y), middle = edge[1] - edge[0], edge.mean(axis=0)
    turn = np.arctan2(-normal[0] * x - normal[1] * y, normal[1] * x - normal[0] * y)
    c, s = np.cos(turn), np.sin(turn)
    motion = np.eye(4)
    motion[:2, :2] = [[c, -s], [s, c]]
    motion[:2, 3] = middle + (offset - normal @ middle) * normal - motion[:2, :2] @ middle
    return motion


def _sheet_lines(
    board: Board, other: Shape, contact: Contact, options: TrimOptions
) -> Iterator[tuple[np.ndarray, float]]:
    """The faces of the other board on which this one ends, as lines in its own plane; at a seam either may yield."""
    for face in other.faces:
        along = float(face.normal @ np.array(contact.normal))
        along = along if contact.type in ENDING else abs(along)
        if along > np.cos(np.radians(options.tilt)) and (line := _line(board, face)):
            yield line


def _with_outline(board: Board, loop: Loop) -> Board:
    return board.model_copy(update={"cut_path": board.cut_path.model_copy(update={"outer": loop})})


def _family(boards: dict[str, Board], board: Board, loop: Loop) -> dict[str, Board]:
    """The board and all that have its cut path, or its mirror image, with the new outline."""
    first = board.same_as or board.name
    width = float(sample_loop(boards[first].cut_path.outer)[:, 0].max())
    flip = np.array([[-1.0, 0.0, width], [0.0, 1.0, 0.0]])
    turned = transform_path(CutPath(outer=loop), flip).outer
    return {
        other.name: _with_outline(other, loop if other.mirrored == board.mirrored else turned)
        for other in boards.values()
        if first in (other.name, other.same_as)
    }


def _areas(
    board: Board, other: Shape, shared: list[Shape], contact: Contact | None, options: TrimOptions
) -> Iterator[ConvexArea]:
    """What to take off the board: all beyond the face that it ends on, or only what lies in the other."""
    if contact is not None:
        outline = sample_loop(board.cut_path.outer)
        for line in _sheet_lines(board, other, contact, options):
            for end in _ends(board, *line, options):
                yield from _area(board, [end], outline, options.end, options)
    for piece in shared:
        faces = [face for face in other.faces if any(_same_plane(face, own, options.touch) for own in piece.faces)]
        clear = 0.0 if contact is not None else options.clear
        lines = [(line[0], line[1] + clear) for face in faces if (line := _line(board, face))]
        yield from _area(board, lines, _flat(board, piece.points), options.deepest + clear, options)


def _ends(board: Board, normal: np.ndarray, offset: float, options: TrimOptions) -> Iterator[tuple[np.ndarray, float]]:
    """New lines for the straight edges that a line runs along: it, or where it crosses the edge, one along the edge."""
    for edge in board.cut_path.outer.edges:
        if not isinstance(edge, Line):
            continue
        ends = np.array([edge.start, edge.end])
        depths = offset - ends @ normal
        if np.abs(depths).max() > options.end or depths.max() <= options.touch / 2:
            continue
        if depths.min() >= 0:
            yield normal, offset
        else:
            along = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
            inward = np.array([-along[1], along[0]])
            yield inward, float(inward @ ends[0] + depths.max())


def _same_plane(a: FlatFace, b: FlatFace, within: float) -> bool:
    return bool(a.normal @ b.normal > 1 - 1e-9 and abs(a.offset - b.offset) < within)


def _flat(board: Board, points: np.ndarray) -> np.ndarray:
    """Points (N, 3) of the model, seen from the top of the board."""
    pose = board_from_model(board)
    return points @ pose[:2, :3].T + pose[:2, 3]


def _area(
    board: Board, lines: list[tuple[np.ndarray, float]], around: np.ndarray, deepest: float, options: TrimOptions
) -> Iterator[ConvexArea]:
    """The part of a window about some points that lies behind all lines; none where an outline goes in deeper."""
    import shapely

    low, high = around.min(axis=0) - options.around, around.max(axis=0) + options.around
    window = shapely.box(*low, *high)
    span = 2 * float(np.hypot(*(high - low)))
    for normal, offset in lines:
        window = window.intersection(_half_plane(normal, offset, (low + high) / 2, span))
    if window.geom_type != "Polygon" or window.is_empty or not lines:
        return
    corners = shapely.get_coordinates(shapely.orient_polygons(window).exterior)[:-1]
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    cutting = np.any([np.abs(middles @ n - o) < options.touch for n, o in lines], axis=0)
    area = ConvexArea(corners, cutting)
    points = np.concatenate([edge_points(edge, PROBES) for edge in board.cut_path.outer.edges])
    points = points[area.depth(points) > 0]
    depths = [min(o - p @ n for n, o in lines) for p in points]
    if depths and max(depths) <= deepest:
        yield area


def _line(board: Board, face: FlatFace) -> tuple[np.ndarray, float] | None:
    """The face in the board's plane, at the height at which it reaches furthest: normal (2,) and offset."""
    pose = board_from_model(board)
    normal = pose[:3, :3] @ face.normal
    offset = face.offset + normal @ pose[:3, 3]
    length = float(np.hypot(*normal[:2]))
    if length < np.sin(np.radians(10)):  # the face lies flat on the board: no cut through it
        return None
    furthest = max(offset, offset - normal[2] * board.thickness.value)
    return normal[:2] / length, furthest / length


def _half_plane(normal: np.ndarray, offset: float, near: np.ndarray, span: float) -> Polygon:
    """A square that reaches far behind a line and along it, seen from a point nearby."""
    import shapely

    foot = near + (offset - near @ normal) * normal
    along = np.array([-normal[1], normal[0]])
    return shapely.Polygon([foot - span * along, foot - span * along - 2 * span * normal,
                            foot + span * along - 2 * span * normal, foot + span * along])  # fmt: skip
