"""glTF 2.0 binary (ISO/IEC 12113): named, coloured meshes for viewers and web pages.

Metres and y up, as the standard asks; the root node turns and scales the model's millimetres and z up. Every board
keeps its own frame: its node's matrix is the board's pose.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kerfwright.model import Model
from kerfwright.model.frames import model_from_board
from kerfwright.model.io import write_bytes
from kerfwright.solid import board_solid
from kerfwright_exporters.naming import board_colours, plain_name, title
from kerfwright_exporters.options import ExportOptions
from kerfwright_exporters.steady import NOISE

if TYPE_CHECKING:
    import build123d

__all__ = ["export"]

_FLOAT, _UNSIGNED_INT, _VERTICES, _INDICES = 5126, 5125, 34962, 34963  # numbers of the standard


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `model.glb`."""
    path = Path(out_dir) / "model.glb"
    buffer = bytearray()
    document = _document(model, options)
    for index, (board, rgb) in enumerate(zip(model.boards, board_colours(model), strict=True)):
        points, normals, triangles = _mesh(board_solid(board), options.mesh_tolerance)
        accessors = [_add(document, buffer, data) for data in (points, normals, triangles)]
        document["materials"].append(_material(rgb))
        document["meshes"].append(_primitive(plain_name(board.name), accessors, index))
        pose = model_from_board(board).T.ravel().tolist()  # glTF keeps matrices by column
        document["nodes"].append({"name": plain_name(board.name), "mesh": index, "matrix": pose})
    document["buffers"] = [{"byteLength": len(buffer)}]
    write_bytes(path, _container(document, bytes(buffer)))
    return [path]


def _document(model: Model, options: ExportOptions) -> dict[str, Any]:
    root = {
        "name": title(model, options.unverified),
        "children": list(range(1, len(model.boards) + 1)),
        "matrix": [0.001, 0, 0, 0, 0, 0, -0.001, 0, 0, 0.001, 0, 0, 0, 0, 0, 1],
    }
    return {
        "asset": {"version": "2.0", "generator": "kerfwright"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [root],
        "meshes": [],
        "materials": [],
        "accessors": [],
        "bufferViews": [],
    }


def _mesh(solid: build123d.Solid, tolerance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, normals (N, 3) float32 and triangles (M, 3) uint32; no vertex belongs to two faces of the solid."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh

    BRepMesh_IncrementalMesh(solid.wrapped, tolerance, False, 0.2)  # not relative to the edges' sizes
    parts = [_face(face) for face in solid.faces()]
    shifts = np.cumsum([0, *(len(p) for p, _, _ in parts)])[:-1]
    points, normals = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    points, normals = (np.where(np.abs(x) < NOISE, 0.0, x).astype(np.float32) for x in (points, normals))
    triangles = np.concatenate([t + s for (_, _, t), s in zip(parts, shifts, strict=True)]).astype(np.uint32)
    return points, normals, triangles


def _face(face: build123d.Face) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A face's triangles, with normals averaged over the triangles at a vertex."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopLoc import TopLoc_Location

    place = TopLoc_Location()  # filled by the call: OCCT may share one mesh between faces in several places
    mesh = BRep_Tool.Triangulation_s(face.wrapped, place)
    nodes = [mesh.Node(k + 1).Transformed(place.Transformation()) for k in range(mesh.NbNodes())]
    points = np.array([(p.X(), p.Y(), p.Z()) for p in nodes])
    triangles = np.array([mesh.Triangle(k + 1).Get() for k in range(mesh.NbTriangles())]) - 1
    if face.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
        triangles = triangles[:, ::-1]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    facets = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, triangles[:, k], facets)
    return points, _unit(normals, facets.sum(axis=0)), triangles


def _unit(normals: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """The directions (N, 3) at length 1; the usual one where there is none: at corners of no triangle but slivers."""
    usual = usual if usual.any() else np.array([0.0, 0.0, 1.0])
    found = np.where((np.linalg.norm(normals, axis=1) > 0)[:, None], normals, usual)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def _add(document: dict[str, Any], buffer: bytearray, data: np.ndarray) -> int:
    """Append an array to the buffer; the number of its accessor."""
    integers = data.dtype == np.uint32
    view = {"buffer": 0, "byteOffset": len(buffer), "byteLength": data.nbytes,
            "target": _INDICES if integers else _VERTICES}  # fmt: skip
    accessor: dict[str, Any] = {
        "bufferView": len(document["bufferViews"]),
        "componentType": _UNSIGNED_INT if integers else _FLOAT,
        "count": data.size if integers else len(data),
        "type": "SCALAR" if integers else "VEC3",
    }
    if not integers:
        accessor |= {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
    buffer += data.tobytes()
    document["bufferViews"].append(view)
    document["accessors"].append(accessor)
    return len(document["accessors"]) - 1


def _material(rgb: tuple[float, float, float]) -> dict[str, Any]:
    """A dull material; the standard wants linear colours."""
    linear = [round(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4, 6) for c in rgb]
    return {"pbrMetallicRoughness": {"baseColorFactor": [*linear, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}}


def _primitive(name: str, accessors: list[int], material: int) -> dict[str, Any]:
    points, normals, triangles = accessors
    primitive = {"attributes": {"POSITION": points, "NORMAL": normals}, "indices": triangles, "material": material}
    return {"name": name, "primitives": [primitive]}


def _container(document: dict[str, Any], buffer: bytes) -> bytes:
    """Header, JSON chunk padded with blanks, binary chunk padded with zeros."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode("ascii")
    text += b" " * (-len(text) % 4)
    buffer += b"\0" * (-len(buffer) % 4)
    length = 12 + 8 + len(text) + 8 + len(buffer)
    return (
        struct.pack("<4sII", b"glTF", 2, length)
        + struct.pack("<I4s", len(text), b"JSON") + text
        + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    )  # fmt: skip
