"""The truth of a capture as a model: boards drawn again from truth.step, contacts from truth.json.

What truth.json says of curves is only where they start and end, so that arcs and Beziers come from the STEP file's own
edges. The outlines of bevelled boards are polygons; each side is moved out to the solid's furthest point, because the
truth draws them at half thickness.
"""

import json
from functools import cache
from pathlib import Path

import numpy as np

from kerfwright.model import (
    Arc,
    Bevel,
    Bezier,
    Board,
    Circle,
    Contact,
    CutPath,
    Line,
    Loop,
    Model,
    Quantity,
)
from kerfwright.model.frames import rows, transform_points
from kerfwright.model.geometry import reverse_loop, signed_area

CAPTURES = Path("/work/shared/captures")
NAMES = ("bookholder", "bookshelf", "complex_stool", "nightstand", "stool", "tilted_stool", "tray")
AVAILABLE = tuple(n for n in NAMES if (CAPTURES / n / "truth" / "truth.step").exists())


@cache
def truth_data(name: str) -> dict:
    return json.loads((CAPTURES / name / "truth" / "truth.json").read_text())


@cache
def truth_solids(name: str) -> dict:
    """Name and solid of every board of truth.step, in the model frame."""
    from build123d import import_step

    root = import_step(str(CAPTURES / name / "truth" / "truth.step"))
    return {child.label: child.solids()[0] for child in root.children}


@cache
def truth_model(name: str) -> Model:
    data = truth_data(name)
    boards = tuple(_board(part, truth_solids(name)[part["name"]]) for part in data["parts"])
    contacts = tuple(_contact(c, boards, truth_solids(name)) for c in data["connections"])
    return Model(name=name, boards=boards, contacts=contacts)


def pose_of(part: dict) -> np.ndarray:
    """x_in_model = pose @ x_in_board, mm."""
    pose = np.array(part["pose"])
    pose[:3, 3] *= 1000
    return pose


def _board(part: dict, solid) -> Board:
    from kerfwright.solid.build import location

    pose = pose_of(part)
    thickness = part["thickness"] * 1000
    inverse = np.linalg.inv(pose)
    in_board = solid.moved(location(inverse))
    slanted = [f for f in in_board.faces() if _is_flat(f) and 0.01 < abs(f.normal_at().Z) < 0.99]
    path = _polygon_path(part, in_board) if slanted else _drawn_path(in_board, thickness)
    bevels = tuple(_bevel(path, face) for face in slanted)
    return Board(
        name=part["name"],
        model_from_board=rows(pose),
        thickness=Quantity(value=thickness),
        cut_path=path,
        bevels=tuple(sorted(bevels, key=lambda b: (b.start, b.angle.value))),
    )


def _is_flat(face) -> bool:
    from build123d import GeomType

    return face.geom_type == GeomType.PLANE


def _drawn_path(solid, thickness: float) -> CutPath:
    """The edges of the largest sheet face, as the STEP file has them."""
    sheets = [f for f in solid.faces() if _is_flat(f) and abs(f.normal_at().Z) > 0.99]
    face = max(sheets, key=lambda f: f.area)
    outer = _sense(_loop(face.outer_wire()), 1)
    holes = tuple(_sense(_loop(w), -1) for w in face.inner_wires())
    return CutPath(outer=outer, holes=holes)


def _sense(loop: Loop, sign: int) -> Loop:
    return loop if sign * signed_area(loop) > 0 else reverse_loop(loop)


def _loop(wire) -> Loop:
    edges = [e for edge in wire.order_edges() for e in _edges(edge)]
    merged = _full_circle(edges)
    if merged:
        return Loop(edges=(merged,))
    chained: list = []
    for index, edge in enumerate(edges):
        if index == 0 and len(edges) > 1:
            after = edges[1]
            ends = [np.hypot(*np.subtract(edge.end, p)) for p in (after.start, after.end)]
            if min(ends) > 1e-6:
                edge = _turned(edge)
        elif index and np.hypot(*np.subtract(edge.start, chained[-1].end)) > 1e-6:
            edge = _turned(edge)
        if chained:
            edge = edge.model_copy(update={"start": chained[-1].end})
        chained.append(edge)
    chained[-1] = chained[-1].model_copy(update={"end": chained[0].start})
    return Loop(edges=tuple(chained))


def _turned(edge):
    from kerfwright.model.geometry import reverse_edge

    return reverse_edge(edge)


def _full_circle(edges: list) -> Circle | None:
    """One circle, where the file has it as one or two arcs."""
    if len(edges) == 1 and isinstance(edges[0], Circle):
        return edges[0]
    return None


def _edges(edge) -> list:
    """A STEP edge as edges of a cut path, from its first parameter to its last."""
    from build123d import GeomType

    def at(t: float) -> tuple[float, float]:
        p = edge.position_at(t)
        return (p.X, p.Y)

    if edge.geom_type == GeomType.LINE:
        return [Line(start=at(0), end=at(1))]
    if edge.geom_type == GeomType.CIRCLE:
        if edge.is_closed:
            return [Circle(centre=tuple(edge.arc_center)[:2], radius=edge.radius)]
        return [Arc(start=at(0), mid=at(0.5), end=at(1))]
    return _beziers(edge)


def _beziers(edge) -> list[Bezier]:
    from OCP.BRep import BRep_Tool
    from OCP.GeomConvert import GeomConvert, GeomConvert_BSplineCurveToBezierCurve

    curve = BRep_Tool.Curve_s(edge.wrapped, 0.0, 1.0)
    spline = GeomConvert.CurveToBSplineCurve_s(curve)
    parts = GeomConvert_BSplineCurveToBezierCurve(spline)
    out = []
    for k in range(parts.NbArcs()):
        arc = parts.Arc(k + 1)
        assert arc.Degree() == 3 and not arc.IsRational()
        poles = [(arc.Pole(i).X(), arc.Pole(i).Y()) for i in range(1, 5)]
        out.append(Bezier(start=poles[0], control_1=poles[1], control_2=poles[2], end=poles[3]))
    return out


def _polygon_path(part: dict, solid) -> CutPath:
    """The loop's sides moved out to the solid's furthest vertices; the bevelled boards are convex."""
    points = np.array([[v.X, v.Y] for v in solid.vertices()])
    corners = np.array([e["start"] for e in part["loops"][0]["edges"]])
    area = np.linalg.det(np.stack([corners, np.roll(corners, -1, 0)], axis=1)).sum()
    corners = corners if area > 0 else corners[::-1]
    along = np.roll(corners, -1, 0) - corners
    normals = np.stack([along[:, 1], -along[:, 0]], 1) / np.hypot(*along.T)[:, None]
    offsets = (points @ normals.T).max(axis=0)
    count = len(corners)
    moved = [np.linalg.solve(normals[[k - 1, k]], offsets[[k - 1, k]]) for k in range(count)]
    moved = [(float(x), float(y)) for x, y in moved]
    return CutPath(outer=Loop(edges=tuple(Line(start=moved[k], end=moved[(k + 1) % count]) for k in range(count))))


def _bevel(path: CutPath, face) -> Bevel:
    """The bevel that makes a slanted face, on the side of the outline that it belongs to."""
    normal = np.array(tuple(face.normal_at()))
    point = tuple(float(x) for x in face.center())

    def fit(edge: Line) -> float:
        along = np.subtract(edge.end, edge.start)
        return float(np.array([along[1], -along[0]]) / np.hypot(*along) @ normal[:2])

    side = max(path.outer.edges, key=fit)
    angle = float(np.degrees(np.arcsin(normal[2])))
    return Bevel(start=side.start, end=side.end, point=point, normal=tuple(normal), angle=Quantity(value=angle))


def _contact(data: dict, boards: tuple[Board, ...], solids: dict) -> Contact:
    """A connection; the board whose sheet it is comes first, the interface is measured on truth.step."""
    from kerfwright.solid.contacts import interface_polygons
    from kerfwright.solid.faces import shape_of

    a, b, kinds, normal = data["a"], data["b"], (data["a_face"], data["b_face"]), np.array(data["normal"])
    if kinds == ("cut", "sheet"):
        a, b, kinds, normal = b, a, kinds[::-1], -normal
    kind = {("sheet", "cut"): 1, ("sheet", "sheet"): 3, ("cut", "cut"): 4}[kinds]
    by_name = {board.name: board for board in boards}
    polygons = interface_polygons(shape_of(a, solids[a]), shape_of(b, solids[b]), normal, 0.01, np.radians(0.5))
    faces = [_face(by_name[n], k, s * normal) for n, k, s in ((a, kinds[0], 1), (b, kinds[1], -1))]
    return Contact(
        type=kind,
        a=a,
        b=b,
        face_a=faces[0],
        face_b=faces[1],
        point=tuple(float(x) for x in polygons[0].mean(axis=0)),
        normal=tuple(float(x) for x in normal),
        interface=tuple(tuple(tuple(float(x) for x in p) for p in polygon) for polygon in polygons),
        area=data["area"],
        angle=min(data["angle"], 180 - data["angle"]),
    )


def _face(board: Board, kind: str, outward: np.ndarray) -> str:
    if kind == "cut":
        return "edge"
    up = transform_points(np.array(board.model_from_board), [[0, 0, 1], [0, 0, 0]])
    return "top" if (up[0] - up[1]) @ outward > 0 else "bottom"
