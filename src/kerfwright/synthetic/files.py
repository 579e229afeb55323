"""The truth beside a capture, as in ../shared/captures: metres, floor at z = 0, frame.json to lay it on the capture."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from kerfwright.model import Arc, Bezier, Board, Circle, Contact, Edge, Line, Loop, Model
from kerfwright.model.frames import matrix
from kerfwright.model.geometry import edge_end, edge_length, edge_start
from kerfwright.synthetic.meshes import board_mesh, mesh_in_model, volume

__all__ = ["write_frame", "write_truth"]

_KINDS = {Line: "line", Arc: "circle", Circle: "circle", Bezier: "bspline"}


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
