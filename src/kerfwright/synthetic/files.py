"""The capture folder: photographs, COLMAP text, PLY, and the truth beside them.

The formats are those of ../shared/captures: capture files in the capture's frame and unit, truth in metres with the
floor at z = 0 and frame.json to lay one on the other.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from kerfwright.capture import Camera, Cloud
from kerfwright.model import Arc, Bezier, Board, Circle, Contact, Edge, Line, Loop, Model
from kerfwright.model.frames import matrix
from kerfwright.model.geometry import edge_end, edge_length, edge_start
from kerfwright.synthetic.meshes import board_mesh, mesh_in_model, volume

__all__ = ["write_cloud", "write_colmap", "write_frame", "write_truth"]

_KINDS = {Line: "line", Arc: "circle", Circle: "circle", Bezier: "bspline"}


def write_cloud(path: Path, cloud: Cloud) -> None:
    """Binary little-endian PLY: x y z nx ny nz float, red green blue uchar."""
    fields = [(n, "<f4") for n in ("x", "y", "z", "nx", "ny", "nz")] + [(n, "u1") for n in ("red", "green", "blue")]
    rows = np.zeros(len(cloud), fields)
    for k, name in enumerate("xyz"):
        rows[name], rows[f"n{name}"] = cloud.points[:, k], cloud.normals[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        rows[name] = 200 if cloud.colours is None else cloud.colours[:, k]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(cloud)}"]
    header += [f"property {'float' if kind == '<f4' else 'uchar'} {name}" for name, kind in fields]
    path.write_bytes("\n".join([*header, "end_header\n"]).encode() + rows.tobytes())


def write_colmap(folder: Path, camera: Camera, names: list[str], poses: np.ndarray) -> None:
    """COLMAP's text model; poses (V, 4, 4) are camera_from_capture."""
    folder.mkdir(parents=True, exist_ok=True)
    parameters = " ".join(f"{p:.9g}" for p in camera.params)
    (folder / "cameras.txt").write_text(
        f"# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 {camera.model} {camera.width} {camera.height} {parameters}\n"
    )
    lines = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "# POINTS2D[] as (X, Y, POINT3D_ID)"]
    for k, (name, pose) in enumerate(zip(names, poses, strict=True), 1):
        numbers = " ".join(f"{v:.12g}" for v in (*_quaternion(pose[:3, :3]), *pose[:3, 3]))
        lines += [f"{k} {numbers} 1 {name}", ""]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    (folder / "points3D.txt").write_text("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n")


def _quaternion(turn: np.ndarray) -> np.ndarray:
    """(w, x, y, z) of a rotation matrix."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(turn).as_quat()
    return np.array([w, x, y, z]) * (1 if w >= 0 else -1)


def write_truth(folder: Path, model: Model) -> None:
    """truth.json and truth.step."""
    folder.mkdir(parents=True, exist_ok=True)
    meshes = [mesh_in_model(b) for b in model.boards]
    points = np.concatenate([v for v, _ in meshes]) / 1000
    record = {
        "name": model.name,
        "units": "m",
        "parts": [_part(k, b) for k, b in enumerate(model.boards)],
        "connections": [_connection(c) for c in model.contacts],
        "bounds": [points.min(axis=0).tolist(), points.max(axis=0).tolist()],
    }
    (folder / "truth.json").write_text(json.dumps(record))
    _write_step(folder / "truth.step", model)


def write_frame(folder: Path, scale: float, turn: np.ndarray, shift: np.ndarray) -> None:
    """frame.json: how the truth (metres) is laid on the capture."""
    record = {
        "comment": "x_in_capture = scale * turn @ x_in_truth + shift (metres)",
        "scale": scale,
        "turn": np.asarray(turn).tolist(),
        "shift": np.asarray(shift).tolist(),
    }
    (folder / "frame.json").write_text(json.dumps(record))


def _part(index: int, board: Board) -> dict:
    pose = matrix(board.model_from_board)
    pose[:3, 3] /= 1000
    vertices, triangles = board_mesh(board)
    loops = [(board.cut_path.outer, False), *((hole, True) for hole in board.cut_path.holes)]
    return {
        "name": board.name,
        "thickness": board.thickness.value / 1000,
        "pose": pose.tolist(),
        "wood": index,
        "volume": volume((vertices, triangles)) * 1e-9,
        "loops": [_loop(loop, hole) for loop, hole in loops],
        "bevels": [list(b.normal) for b in board.bevels],
        "mesh": {"vertices": np.round(vertices / 1000, 8).tolist(), "faces": triangles.tolist()},
    }


def _loop(loop: Loop, hole: bool) -> dict:
    return {"hole": hole, "edges": [_edge(e) for e in loop.edges]}


def _edge(edge: Edge) -> dict:
    """One edge; kinds as OCCT calls them."""
    return {
        "kind": _KINDS[type(edge)],
        "start": list(edge_start(edge)),
        "end": list(edge_end(edge)),
        "length": edge_length(edge),
    }


def _connection(contact: Contact) -> dict:
    kind = {"top": "sheet", "bottom": "sheet", "edge": "cut"}
    return {
        "a": contact.a,
        "b": contact.b,
        "area": contact.area,
        "a_face": kind[contact.face_a],
        "b_face": kind[contact.face_b],
        "normal": list(contact.normal),
        "angle": contact.angle,
    }


def _write_step(path: Path, model: Model) -> None:
    """The boards as solids, in the model's frame."""
    from build123d import Color, Compound, export_step

    from kerfwright.synthetic.solids import truth_solid

    solids = []
    for board in model.boards:
        solid = truth_solid(board)
        solid.label, solid.color = board.name, Color(0.76, 0.6, 0.42)
        solids.append(solid)
    export_step(Compound(label=model.name, children=solids), str(path))
