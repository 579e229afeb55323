"""Clouds of other kinds: what their own libraries, or their descriptions, write is read back."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from kerfwright.capture.pcd import read_pcd
from kerfwright.capture.readers import find_cloud, read_cloud
from kerfwright.capture.scans import read_e57, read_las
from kerfwright.capture.xyz import read_xyz
from kerfwright.errors import CaptureError

RNG = np.random.default_rng(5)
POINTS = np.round(RNG.uniform(-2, 2, (300, 3)), 4).astype(np.float32).astype(float)
NORMALS = RNG.normal(size=(300, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
COLOURS = RNG.integers(0, 256, (300, 3)).astype(np.uint8)


def same(read, normals=True, colours=True, tolerance=1e-6):
    np.testing.assert_allclose(read.points, POINTS, atol=tolerance)
    assert (read.normals is not None) == normals and (read.colours is not None) == colours
    if normals:
        np.testing.assert_allclose(read.normals, NORMALS, atol=1e-5)
    if colours:
        np.testing.assert_array_equal(read.colours, COLOURS)


@pytest.mark.parametrize(("ascii_text", "compressed"), [(True, False), (False, False), (False, True)])
def test_pcd_of_open3d(tmp_path, ascii_text, compressed):
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
    cloud.normals = o3d.utility.Vector3dVector(NORMALS)
    cloud.colors = o3d.utility.Vector3dVector(COLOURS / 255)
    path = str(tmp_path / "cloud.pcd")
    assert o3d.io.write_point_cloud(path, cloud, write_ascii=ascii_text, compressed=compressed)
    same(read_pcd(tmp_path / "cloud.pcd"), tolerance=1e-5)


def test_pcd_with_padding_and_repeats(tmp_path):
    rows = np.zeros(300, [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("_", "u1", 4), ("h", "<f4", 3), ("rgb", "<u4")])
    rows["x"], rows["y"], rows["z"] = POINTS.T
    rows["rgb"] = COLOURS.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z _ h rgb\nSIZE 8 8 8 1 4 4\nTYPE F F F U F U\nCOUNT 1 1 1 4 3 1\n"
        "WIDTH 300\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 300\nDATA binary\n"
    )
    (tmp_path / "cloud.pcd").write_bytes(head.encode() + rows.tobytes())
    same(read_pcd(tmp_path / "cloud.pcd"), normals=False)


@pytest.mark.parametrize("mark", [" ", ", ", ";", "\t"])
@pytest.mark.parametrize(
    ("columns", "normals", "colours"),
    [("p", 0, 0), ("pn", 1, 0), ("pc", 0, 1), ("pnc", 1, 1), ("pcn", 1, 1), ("pic", 0, 1), ("pi", 0, 0), ("pr", 0, 1)],
)
def test_lines_of_numbers(tmp_path, mark, columns, normals, colours):
    parts = {"p": POINTS, "n": NORMALS, "c": COLOURS, "i": np.full((300, 1), -512), "r": COLOURS / 255}
    rows = np.hstack([parts[c] for c in columns])
    text = "\n".join(mark.join(f"{v:.8g}" for v in row) for row in rows)
    (tmp_path / "cloud.xyz").write_text(text + "\n")
    same(read_xyz(tmp_path / "cloud.xyz"), bool(normals), bool(colours))
    (tmp_path / "cloud.pts").write_text(f"{len(rows)}\r\n" + text.replace("\n", "\r\n"))
    same(read_xyz(tmp_path / "cloud.pts"), bool(normals), bool(colours))


def test_a_heading_goes_before_guesses(tmp_path):
    rows = np.hstack([COLOURS, POINTS, NORMALS])
    text = "//R G B X Y Z Nx Ny Nz\n" + "\n".join(" ".join(f"{v:.8g}" for v in row) for row in rows)
    (tmp_path / "cloud.asc").write_text(text)
    same(read_xyz(tmp_path / "cloud.asc"))


@pytest.mark.parametrize("ending", ["las", "laz"])
@pytest.mark.parametrize("bits", [8, 16])
def test_las(tmp_path, ending, bits):
    laspy = pytest.importorskip("laspy")
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales, header.offsets = [1e-4] * 3, [-1.0, 5.0, 100.0]
    las = laspy.LasData(header)
    las.x, las.y, las.z = POINTS.T
    las.red, las.green, las.blue = COLOURS.T.astype(np.uint16) * (257 if bits == 16 else 1)
    las.write(str(tmp_path / f"cloud.{ending}"))
    same(read_las(tmp_path / f"cloud.{ending}"), normals=False, tolerance=6e-5)


def test_e57(tmp_path):
    pye57 = pytest.importorskip("pye57")
    file = pye57.E57(str(tmp_path / "cloud.e57"), mode="w")
    turn = np.array([np.cos(0.3), 0, 0, np.sin(0.3)])  # w x y z
    for half in (slice(0, 100), slice(100, 300)):
        local = np.stack(
            [  # written in the scanner's frame, which lies elsewhere
                *(np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]]) @ (POINTS[half, :2] - [1, 2]).T),
                POINTS[half, 2] - 3,
            ]
        )
        data = {f"cartesian{axis}": np.ascontiguousarray(row) for axis, row in zip("XYZ", local, strict=True)}
        data |= {f"color{c}": np.ascontiguousarray(COLOURS[half, k]) for k, c in enumerate(("Red", "Green", "Blue"))}
        file.write_scan_raw(data, rotation=turn, translation=np.array([1.0, 2.0, 3.0]))
    file.close()
    read = read_e57(tmp_path / "cloud.e57")
    same(read, normals=False)
    assert read.metres, "by the standard"


def test_the_unit_of_e57_is_taken(capture_folder):
    pye57 = pytest.importorskip("pye57")
    from kerfwright.capture import open_capture
    from kerfwright.capture.ply import read_ply

    points = read_ply(capture_folder / "cloud.ply").points
    (capture_folder / "cloud.ply").unlink()
    file = pye57.E57(str(capture_folder / "cloud.e57"), mode="w")
    file.write_scan_raw({f"cartesian{a}": np.ascontiguousarray(points[:, k]) for k, a in enumerate("XYZ")})
    file.close()
    scale = open_capture(capture_folder).scale
    assert (scale.millimetres_per_unit, scale.origin) == (1000, "file")
    assert open_capture(capture_folder, millimetres_per_unit=3).scale.origin == "given"


def test_without_the_library_the_remedy_is_told(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "laspy", None)
    (tmp_path / "cloud.las").write_bytes(b"LASF" + bytes(400))
    with pytest.raises(CaptureError, match=r"cloud\.las: file: needs laspy: run `pip install 'laspy\[lazrs\]'`"):
        read_las(tmp_path / "cloud.las")


def test_which_cloud(tmp_path):
    def put(name, size):
        (tmp_path / name).write_bytes(bytes(size))
        return find_cloud(tmp_path).name

    with pytest.raises(CaptureError, match=r"cloud: none: put .* or as one of ply, pcd"):
        find_cloud(tmp_path)
    assert put("b.xyz", 20) == "b.xyz"
    assert put("a.LAS", 30) == "a.LAS"
    assert put("fused.e57", 3) == "fused.e57"
    assert put("cloud.pts", 2) == "cloud.pts"
    assert put("cloud.ply", 1) == "cloud.ply"


@pytest.mark.parametrize(
    ("name", "data", "told"),
    [
        ("c.pcd", b"", "DATA: missing"),
        ("c.pcd", b"FIELDS x y\nSIZE 4 4\nTYPE F F\nCOUNT 1 1\nPOINTS 0\nDATA ascii\n", "FIELDS: x y: x, y and z"),
        ("c.pcd", b"FIELDS x\nSIZE 4\nTYPE F\nPOINTS 99999999999\nDATA binary\n", "POINTS: 99999999999"),
        ("c.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA ascii\n1 2 3\n", "cut short"),
        ("c.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 a\n", "column z"),
        ("c.xyz", b"\n", "line 1"),
        ("c.xyz", b"1 2 3\n4 5\n", "after line 0"),
        ("c.xyz", b"x y z\nred green blue\n", "line 1: x y z"),
        ("c.las", b"PK", "not of this format"),
        ("c.laz", b"LASF" + b"\xff" * 300, "more than the file can hold"),
        ("c.e57", b"ASTM-E57" + struct.pack("<IIQQQ", 1, 0, 99, 48, 10) + bytes(100), "damaged"),
    ],
)
def test_damage_is_told(tmp_path, name, data, told):
    (tmp_path / name).write_bytes(data)
    if name[-3:] in ("laz", "e57"):
        pytest.importorskip({"laz": "laspy", "e57": "pye57"}[name[-3:]])
    with pytest.raises(CaptureError, match=told) as error:
        read_cloud(tmp_path / name)
    assert "\n" not in str(error.value) and name in str(error.value)
