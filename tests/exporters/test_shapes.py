"""BREP and glTF read back by other readers."""

import json
import struct

import numpy as np
import pytest

from kerfwright.model import Model
from kerfwright.solid import assembly_solids
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.brep import export as export_brep
from kerfwright_exporters.gltf import export as export_gltf
from simple import board, cracked, stool
from truths import AVAILABLE, truth_model

MODELS = {"stool of three": stool, **{name: (lambda name=name: truth_model(name)) for name in AVAILABLE}}


@pytest.mark.parametrize("name", MODELS)
def test_brep_keeps_volumes_and_places(name, tmp_path):
    import cadquery

    model = MODELS[name]()
    (path,) = export_brep(model, tmp_path, ExportOptions())
    found = cadquery.Shape.importBrep(str(path)).Solids()
    expected = assembly_solids(model)
    assert [s.Volume() for s in found] == pytest.approx([s.volume for _, s in expected], rel=1e-9)
    for a, (_, b) in zip(found, expected, strict=True):
        assert (np.array(a.Center().toTuple()) - np.array(tuple(b.center()))) == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_gltf_is_the_same_body_in_metres_with_y_up(name, tmp_path):
    import open3d

    model = MODELS[name]()
    (path,) = export_gltf(model, tmp_path, ExportOptions(mesh_tolerance=0.01))
    mesh = open3d.io.read_triangle_mesh(str(path))
    x = np.asarray(mesh.vertices) @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) * 1000  # back to z up, mm
    a, b, c = (x[np.asarray(mesh.triangles)[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(sum(s.volume for _, s in assembly_solids(model)), rel=2e-4)
    boxes = [s.bounding_box() for _, s in assembly_solids(model)]
    assert x.min(axis=0) == pytest.approx(np.min([tuple(b.min) for b in boxes], axis=0), abs=0.02)
    assert x.max(axis=0) == pytest.approx(np.max([tuple(b.max) for b in boxes], axis=0), abs=0.02)


def test_gltf_names_colours_and_normals(tmp_path):
    (path,) = export_gltf(stool(), tmp_path, ExportOptions(unverified=True))
    data = path.read_bytes()
    magic, version, length, size, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    document = json.loads(data[20 : 20 + size])
    assert [n["name"] for n in document["nodes"]] == ["stool NOT VERIFIED", "top", "leg left", "leg right"]
    assert len({tuple(m["pbrMetallicRoughness"]["baseColorFactor"]) for m in document["materials"]}) == 3
    start = 20 + size + 8
    view = document["bufferViews"][document["accessors"][1]["bufferView"]]
    normals = np.frombuffer(data, np.float32, view["byteLength"] // 4, start + view["byteOffset"]).reshape(-1, 3)
    assert np.abs(normals).max(axis=1) == pytest.approx(1, abs=1e-6)  # a box: every normal along an axis


@pytest.mark.parametrize("export", [export_brep, export_gltf], ids=["brep", "gltf"])
def test_same_bytes_twice(export, tmp_path):
    for folder in "ab":
        (tmp_path / folder).mkdir()
    (first,), (second,) = (export(stool(), tmp_path / folder, ExportOptions()) for folder in "ab")
    assert first.read_bytes() == second.read_bytes()
    assert len(list((tmp_path / "a").iterdir())) == 1


def test_gltf_has_a_normal_where_a_face_has_none(tmp_path):
    """OCCT's mesh of a cracked face has corners that no triangle uses."""
    (path,) = export_gltf(Model(boards=(board(cracked(0.03)),)), tmp_path, ExportOptions())
    assert path.stat().st_size > 1000
