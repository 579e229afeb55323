"""What of a model depends on what: the reading that makes a parametric program of it.

A board's sheet keeps one reference plane (a face on the object's border, a face that lies on another board's sheet,
or the middle where its end is pointed) and grows from there with its stock. Where its outline ends on another
board's sheet or on the floor, the outline is drawn over and cut off at that face, so that length and bevel follow from
the neighbour. A bevel whose plane would cut off more than the bevel does is kept as the body that it takes away.
Everything else is stretched with the object's width, depth and height.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kerfwright.model import Board, Contact, Edge, Line, Loop, Model
from kerfwright.model.frames import model_from_board, transform_points, transform_vectors
from kerfwright.model.geometry import edge_length, edge_start, edge_tangents, sample_loop, transform_loop
from kerfwright.solid import assembly_solids
from kerfwright.solid.bevels import HalfSpace, bevel_bodies, polyhedron_faces
from kerfwright.solid.faces import Shape, shape_of
from kerfwright_exporters.extend import extended_edge

__all__ = ["BoardDesign", "FreeCut", "NeighbourCut", "design_boards", "model_box"]

ON_PLANE = 0.01  # mm between an outline's edge and the face that it ends on: what counts as snug
OVERDRAW = 30.0  # mm that an outline is drawn over a face that will cut it
RUN_ON = 3.0  # mm that a curve is drawn on past such a face
NEARLY_STRAIGHT = 0.05  # rad of turn below which an edge is not moved out along the one that goes on from it
PARALLEL = 1e-3  # rad between an edge and a plane along it


@dataclass(frozen=True, eq=False)
class NeighbourCut:
    """The board ends on a face ("top" or "bottom") of another, by number."""

    board: int
    face: str


@dataclass(frozen=True, eq=False)
class FreeCut:
    """The board ends on a plane of its own: the floor, or a bevel that touches nothing. The normal looks towards it."""

    point: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True, eq=False)
class BoardDesign:
    """How one board is drawn: frame (origin, x, y in the model, mm), outline about the origin, and what cuts it."""

    board: Board
    origin: np.ndarray
    x: np.ndarray
    y: np.ndarray
    below: float
    size: tuple[float, float]
    outline: Loop
    holes: tuple[Loop, ...]
    cuts: tuple[NeighbourCut | FreeCut, ...]
    bodies: tuple[tuple[np.ndarray, ...], ...] = ()  # faces (N, 3) of what other bevels take off, z from the bottom
    rests_on: NeighbourCut | None = None  # face that its sheet lies on


def model_box(model: Model) -> np.ndarray:
    """Lowest and highest corner (2, 3) of the object, mm."""
    return _box(_shapes(model))


def _shapes(model: Model) -> list[Shape]:
    return [shape_of(name, solid) for name, solid in assembly_solids(model)]


def _box(shapes: list[Shape]) -> np.ndarray:
    boxes = np.stack([shape.box for shape in shapes])
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def _corners(board: Board) -> np.ndarray:
    """Points (N, 3) of both faces' outlines, model frame."""
    flat = sample_loop(board.cut_path.outer)
    faces = [np.column_stack([flat, np.full(len(flat), z)]) for z in (0.0, board.thickness.value)]
    return transform_points(model_from_board(board), np.concatenate(faces))


def design_boards(model: Model) -> list[BoardDesign]:
    """The design of every board, in the model's order."""
    shapes = _shapes(model)
    return [_design(model, k, shapes[k].points, _box(shapes)) for k in range(len(model.boards))]


def _design(model: Model, index: int, solid: np.ndarray, box: np.ndarray) -> BoardDesign:
    board = model.boards[index]
    pose = model_from_board(board)
    flat = sample_loop(board.cut_path.outer)
    centre, size = (flat.min(axis=0) + flat.max(axis=0)) / 2, np.ptp(flat, axis=0)
    rests_on, face = _rests(model, index)
    below = face if face is not None else _reference(board, box)
    cuts = _Cuts(board, solid)
    cuts.take(model, index)
    return BoardDesign(
        board=board,
        origin=transform_points(pose, [*centre, below * board.thickness.value]),
        x=pose[:3, 0],
        y=pose[:3, 1],
        below=below,
        size=(float(size[0]), float(size[1])),
        outline=_centred(_overdrawn(board.cut_path.outer, cuts.edges), centre),
        holes=tuple(_centred(hole, centre) for hole in board.cut_path.holes),
        cuts=tuple(cuts.found),
        bodies=tuple(tuple(f - [*centre, 0] for f in body) for body in cuts.bodies()),
        rests_on=rests_on,
    )


def _centred(loop: Loop, centre: np.ndarray) -> Loop:
    return transform_loop(loop, np.array([[1, 0, -centre[0]], [0, 1, -centre[1]]], float))


def _reference(board: Board, box: np.ndarray) -> float:
    """Share of the thickness under the plane that stays: 0 the bottom, 1 the top, a half the middle."""
    stretches = [(b.start, b.end) for b in board.bevels]
    if len(set(stretches)) < len(stretches):
        return 0.5
    points = _corners(board)
    half = len(points) // 2
    for below, face in ((0.0, points[:half]), (1.0, points[half:])):
        flat = np.abs(np.ptp(face, axis=0)) < ON_PLANE
        if (flat & (np.abs(face[0] - box).min(axis=0) < ON_PLANE)).any():
            return below
    return 0.0


def _rests(model: Model, index: int) -> tuple[NeighbourCut | None, float | None]:
    """The earlier board's face that this board's sheet lies on, and which of its own faces that is."""
    names = [board.name for board in model.boards]
    for contact in model.contacts:
        if contact.type != 3:
            continue
        a, b = names.index(contact.a), names.index(contact.b)
        if max(a, b) == index:
            other, face, own = (
                (a, contact.face_a, contact.face_b) if b == index else (b, contact.face_b, contact.face_a)
            )
            return NeighbourCut(other, face), 1.0 if own == "top" else 0.0
    return None, None


class _Cuts:
    """What cuts a board off, and the edges of its outline that are drawn over for it."""

    def __init__(self, board: Board, solid: np.ndarray) -> None:
        self.board, self.solid = board, solid  # the board's solid lies in the hull of these points (N, 3), model frame
        self.found: list[NeighbourCut | FreeCut] = []
        self.edges: set[int] = set()
        self.planes: list[tuple[np.ndarray, np.ndarray]] = []

    def take(self, model: Model, index: int) -> None:
        """The neighbours' faces first, then planes of the board's own bevels that no neighbour has."""
        names = [board.name for board in model.boards]
        for contact in model.contacts:
            if other := _sheet_of(contact, self.board.name):
                name, face, normal = other
                self._try(np.array(contact.point), normal, NeighbourCut(names.index(name), face))
        for point, normal in _own_planes(self.board):
            if not self._has(point, normal):
                self._try(point, normal, FreeCut(point, normal))

    def _has(self, point: np.ndarray, normal: np.ndarray) -> bool:
        return any(abs(normal @ n) > 1 - PARALLEL**2 and abs((point - p) @ n) < ON_PLANE for p, n in self.planes)

    def _try(self, point: np.ndarray, normal: np.ndarray, cut: NeighbourCut | FreeCut) -> None:
        """Take the cut if the board ends on that plane along a straight edge, and no part of it lies beyond."""
        found = _edges_on(self.board, point, normal)
        if found and ((self.solid - point) @ normal).min() >= -ON_PLANE:
            self.found.append(cut)
            self.edges |= found
            self.planes.append((point, normal))

    def bodies(self) -> list[list[np.ndarray]]:
        """Faces, board frame, of what the bevels take off whose planes are not among the cuts."""
        planes = zip(self.board.bevels, _own_planes(self.board), strict=True)
        rest = tuple(bevel for bevel, plane in planes if not self._has(*plane))
        if not rest:
            return []
        bodies = bevel_bodies(self.board.model_copy(update={"bevels": rest}))
        return [polyhedron_faces([_taller(h) for h in body]) for body in bodies]


def _taller(space: HalfSpace) -> HalfSpace:
    """A half-space that keeps to the board's sheet let out, so that its body cuts thicker stock as well."""
    return HalfSpace(space.normal, space.offset - OVERDRAW) if abs(space.normal[2]) == 1 else space


def _sheet_of(contact: Contact, name: str) -> tuple[str, str, np.ndarray] | None:
    """The neighbour whose sheet the named board's cut face lies on, that face, and the normal towards the board."""
    normal = np.array(contact.normal)
    if contact.b == name and contact.face_b == "edge" and contact.face_a != "edge":
        return contact.a, contact.face_a, normal
    if contact.a == name and contact.face_a == "edge" and contact.face_b != "edge":
        return contact.b, contact.face_b, -normal
    return None


def _own_planes(board: Board) -> list[tuple[np.ndarray, np.ndarray]]:
    """Point and inward normal, model frame, of the board's bevels."""
    pose = model_from_board(board)
    normals = [np.array(b.normal) / np.linalg.norm(b.normal) for b in board.bevels]
    return [
        (transform_points(pose, b.point), -transform_vectors(pose, n))
        for b, n in zip(board.bevels, normals, strict=True)
    ]


def _edges_on(board: Board, point: np.ndarray, normal: np.ndarray) -> set[int]:
    """Straight edges of the outline that the plane runs along, within the thickness."""
    pose = model_from_board(board)
    n = pose[:3, :3].T @ normal
    offset = n @ (pose[:3, :3].T @ (point - pose[:3, 3]))
    found = set()
    for k, edge in enumerate(board.cut_path.outer.edges):
        if not isinstance(edge, Line):
            continue
        along = edge_tangents(edge, np.zeros(1))[0]
        outward = np.array([along[1], -along[0]])
        heights = np.array([n[:2] @ edge.start, n[:2] @ edge.start + n[2] * board.thickness.value]) - offset
        reached = heights.min() <= ON_PLANE and heights.max() >= -ON_PLANE
        if abs(n[:2] @ along) < PARALLEL and -(n[:2] @ outward) > 0.2 and reached:
            found.add(k)
    return found


def _overdrawn(loop: Loop, over: set[int]) -> Loop:
    """The outline with some straight edges moved out by OVERDRAW; curves beside them are run on."""
    if not over:
        return loop
    joints = _joints(loop, over, set())
    joints = _joints(loop, over, {k for k in over if _turned_round(loop, joints, k)})
    edges: list[Edge] = []
    for k, edge in enumerate(loop.edges):
        begin, (end, onward) = joints[k][1], joints[(k + 1) % len(joints)]
        if isinstance(edge, Line):
            edges.append(Line(start=begin, end=end))
        else:
            edge = _run_on(loop, k, over)
            edges += [Line(start=begin, end=edge.start), edge, Line(start=edge.end, end=end)]
        edges.append(Line(start=end, end=onward))
    return Loop(edges=tuple(e for e in edges if edge_length(e) > ON_PLANE))


def _run_on(loop: Loop, k: int, over: set[int]) -> Edge:
    """A curve drawn on past the faces that cut it, so that none of its ends lies on one: OCCT cuts badly there."""
    edge, count = loop.edges[k], len(loop.edges)
    for neighbour, at_end in (((k - 1) % count, False), ((k + 1) % count, True)):
        t = np.array([float(at_end)])
        u, v = edge_tangents(edge, t)[0], edge_tangents(loop.edges[neighbour], 1 - t)[0]
        if neighbour in over and abs(u[0] * v[1] - u[1] * v[0]) >= NEARLY_STRAIGHT:
            edge = extended_edge(edge, RUN_ON, at_end)
    return edge


def _joints(loop: Loop, over: set[int], square: set[int]) -> list[tuple[tuple, tuple]]:
    """For every corner, where the edge before it ends and the one after it starts once some edges are moved out."""
    count = len(loop.edges)
    return [_joint(loop, (k - 1) % count, k, over, square) for k in range(count)]


def _turned_round(loop: Loop, joints: list[tuple[tuple, tuple]], k: int) -> bool:
    """Whether an edge, moved out along its neighbours, runs the wrong way: they meet before they are that far out."""
    begin, end = joints[k][1], joints[(k + 1) % len(joints)][0]
    return float(edge_tangents(loop.edges[k], np.zeros(1))[0] @ np.subtract(end, begin)) <= ON_PLANE


def _joint(loop: Loop, before: int, after: int, over: set[int], square: set[int]) -> tuple[tuple, tuple]:
    """The two ends at one corner; edges in `square` are moved out square to themselves."""
    corner = np.array(edge_start(loop.edges[after]))
    if before not in over and after not in over:
        return tuple(corner), tuple(corner)
    u = edge_tangents(loop.edges[before], np.ones(1))[0]
    v = edge_tangents(loop.edges[after], np.zeros(1))[0]
    normals = np.array([[u[1], -u[0]], [v[1], -v[0]]])
    if {before, after} & square or abs(np.linalg.det(normals)) < NEARLY_STRAIGHT:
        ends = (corner + OVERDRAW * n * (k in over) for n, k in zip(normals, (before, after), strict=True))
        return tuple(tuple(map(float, end)) for end in ends)
    out = corner + np.linalg.solve(normals, [OVERDRAW * (k in over) for k in (before, after)])
    return tuple(map(float, out)), tuple(map(float, out))
