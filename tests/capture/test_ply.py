"""PLY files of every encoding and shape, and broken ones."""

from __future__ import annotations

import struct
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kerfwright.capture import Cloud, write_ply
from kerfwright.capture.ply import read_ply
from kerfwright.errors import CaptureError

CODES = {
    "char": "b",
    "uchar": "B",
    "short": "h",
    "ushort": "H",
    "int": "i",
    "uint": "I",
    "float": "f",
    "double": "d",
    "int8": "b",
    "uint8": "B",
    "float32": "f",
    "float64": "d",
}
ENCODINGS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}


def ply(encoding, elements, end="\n"):
    """A PLY file: elements are (name, [(type, name) or ("list", count type, type, name)], rows)."""
    lines = ["ply", f"format {encoding} 1.0", "comment made for a test, élan"]
    for name, properties, rows in elements:
        lines += [f"element {name} {len(rows)}", *("property " + " ".join(p) for p in properties)]
    data = (end.join([*lines, "end_header"]) + end).encode("latin-1")
    for _, properties, rows in elements:
        data += b"".join(row_bytes(ENCODINGS[encoding], properties, row, end) for row in rows)
    return data


def row_bytes(order, properties, row, end):
    if order is None:
        words = [w for p, v in zip(properties, row, strict=True) for w in ([len(v), *v] if p[0] == "list" else [v])]
        return (" ".join(map(str, words)) + end).encode()
    out = b""
    for p, v in zip(properties, row, strict=True):
        out += struct.pack(order + CODES[p[1]], len(v)) if p[0] == "list" else b""
        out += (
            struct.pack(f"{order}{len(v)}{CODES[p[2]]}", *v) if p[0] == "list" else struct.pack(order + CODES[p[0]], v)
        )
    return out


XYZ = [("float", "x"), ("float", "y"), ("float", "z")]
NORMAL = [("float", "nx"), ("float", "ny"), ("float", "nz")]
COLOUR = [("uchar", "red"), ("uchar", "green"), ("uchar", "blue")]
ROWS = [
    (1.5, -2.25, 3.0, 0.0, 0.0, 1.0, 255, 0, 7),
    (4.0, 5.0, 6.5, 1.0, 0.0, 0.0, 1, 2, 3),
    (0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 9, 8, 7),
]
POINTS, NORMALS, COLOURS = (np.array([row[i : i + 3] for row in ROWS]) for i in (0, 3, 6))


def read(tmp_path, data):
    path = tmp_path / "cloud.ply"
    path.write_bytes(data)
    return read_ply(path)


def assert_rows(got):
    np.testing.assert_array_equal(got.points, POINTS)
    np.testing.assert_array_equal(got.normals, NORMALS)
    np.testing.assert_array_equal(got.colours, COLOURS)
    assert got.points.dtype == np.float64 and got.colours.dtype == np.uint8


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_encoding_and_line_end(tmp_path, encoding, end):
    if end == "\r" and encoding != "ascii":
        end = "\n"
    assert_rows(read(tmp_path, ply(encoding, [("vertex", XYZ + NORMAL + COLOUR, ROWS)], end)))


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_other_elements_and_lists_are_passed_over(tmp_path, encoding):
    rows = [(*row, [1, 2, 3][:i], 0.5, *([7] * i,)) for i, row in enumerate(ROWS)]
    properties = [
        *XYZ,
        *NORMAL,
        *COLOUR,
        ("list", "uchar", "int", "views"),
        ("double", "quality"),
        ("list", "ushort", "float", "w"),
    ]
    elements = [
        ("camera", [("float", "x"), ("double", "y")], [(9.0, 9.0)]),
        ("odd", [("list", "uint", "short", "numbers"), ("char", "z")], [([], 1), ([5, 6], 2)]),
        ("vertex", properties, rows),
        ("face", [("list", "uchar", "int", "vertex_indices")], [([0, 1, 2],)]),
    ]
    assert_rows(read(tmp_path, ply(encoding, elements)))


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_list_before_the_coordinates(tmp_path, encoding):
    rows = [([4] * i, *row) for i, row in enumerate(ROWS)]
    assert_rows(
        read(tmp_path, ply(encoding, [("vertex", [("list", "uchar", "int", "n"), *XYZ, *NORMAL, *COLOUR], rows)]))
    )


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_doubles_are_kept_and_the_rest_is_optional(tmp_path, encoding):
    far = [(1234567.123456789, 0.1, -0.3)] * 3
    got = read(tmp_path, ply(encoding, [("vertex", [("double", "x"), ("double", "y"), ("double", "z")], far)]))
    np.testing.assert_array_equal(got.points, far)
    assert got.normals is None and got.colours is None


@pytest.mark.parametrize(
    ("kind", "values", "bytes_"),
    [
        ("uchar", (0, 128, 255), (0, 128, 255)),
        ("ushort", (0, 32896, 65535), (0, 128, 255)),
        ("float", (0.0, 0.5, 1.0), (0, 128, 255)),
        ("float", (0.0, 128.0, 255.0), (0, 128, 255)),
        ("int", (0, 128, 300), (0, 128, 255)),
    ],
)
def test_colours_of_every_type(tmp_path, kind, values, bytes_):
    properties = XYZ + [(kind, c) for c in ("diffuse_red", "diffuse_green", "diffuse_blue")]
    got = read(tmp_path, ply("binary_little_endian", [("vertex", properties, [(0.0, 0.0, 0.0, *values)] * 2)]))
    np.testing.assert_array_equal(got.colours, [bytes_] * 2)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 40), st.booleans(), st.booleans())
def test_written_is_read_back(tmp_path_factory, count, coloured, double):
    generator = np.random.default_rng(count)
    points = generator.normal(size=(count, 3)).astype(float if double else np.float32)
    normals = generator.normal(size=(count, 3)).astype(np.float32 if not double else float)
    cloud = Cloud(points, normals, generator.integers(0, 256, (count, 3), np.uint8) if coloured else None)
    path = tmp_path_factory.mktemp("ply") / "c.ply"
    write_ply(path, cloud, double=double)
    got = read_ply(path)
    np.testing.assert_array_equal(got.points, points)
    np.testing.assert_array_equal(got.normals, normals)
    assert (got.colours is None) == (not coloured)
    if coloured:
        np.testing.assert_array_equal(got.colours, cloud.colours)


HEADER = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("count", [3, 10**6, 10**12, 10**19 - 1])
def test_header_bombs_are_refused_before_allocation(tmp_path, encoding, count):
    tracemalloc.start()
    with pytest.raises(CaptureError, match=f"element vertex: {count}: more than the file holds"):
        read(tmp_path, HEADER.format(encoding, count).encode() + b"0 0 0\n")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10_000_000


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "first bytes"),
        (b"plywood", "no end_header"),
        (b"ply\nformat ascii 1.0\n", "no end_header"),
        (HEADER.format("ascii", 1).encode("utf-16"), "not a PLY file"),
        (HEADER.format("ebcdic", 1).encode() + b"0 0 0\n", "format"),
        (HEADER.format("ascii", -1).encode() + b"0 0 0\n", "element vertex: -1"),
        (HEADER.format("ascii", "1" * 5000).encode(), "element vertex: 111"),
        (HEADER.format("ascii", "1e3").encode(), "element vertex: 1e3"),
        (HEADER.format("ascii", 1).replace("float x", "vec3 x").encode() + b"0 0 0\n", "header line 4"),
        (
            HEADER.format("ascii", 1).replace("property float z", "property list uchar z").encode() + b"0 0 0\n",
            "header line 6",
        ),
        (HEADER.format("ascii", 1).replace("float z", "float w").encode() + b"0 0 0\n", "vertex properties: x y w"),
        (HEADER.format("ascii", 1).replace("vertex", "points").encode() + b"0 0 0\n", "element vertex: missing"),
        (b"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "header line 3"),
        (HEADER.format("ascii", 1).encode() + b"0,5 0 0\n", "0,5"),
        (HEADER.format("ascii", 1).encode() + b"0 zero 0\n", "zero"),
        (HEADER.format("ascii", 2).encode() + b"0 0 0\n \n       \n", "1 rows of 2"),
        (HEADER.format("ascii", 2).encode() + b"0 0 0 0 0 0\n0 0\n", "vertex"),
    ],
)
def test_bad_files_are_told(tmp_path, data, told):
    with pytest.raises(CaptureError, match=told) as error:
        read(tmp_path, data)
    assert "\n" not in str(error.value) and len(str(error.value)) < 500


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_cut_is_told(tmp_path, encoding):
    elements = [("other", [("list", "uchar", "int", "n")], [([1, 2],)]), ("vertex", XYZ + NORMAL + COLOUR, ROWS)]
    whole = ply(encoding, elements)
    for end in range(0, len(whole) - 2):
        try:
            got = read(tmp_path, whole[:end])
        except CaptureError:
            continue
        assert encoding == "ascii" and len(got.points) == 3  # only the digits of the last number may go unnoticed


def test_lists_that_promise_too_much(tmp_path):
    properties = [("list", "uint", "double", "n"), *XYZ]
    data = bytearray(ply("binary_little_endian", [("vertex", properties, [([1.0], 0.0, 0.0, 0.0)] * 3)]))
    at = data.index(b"end_header\n") + 11
    data[at : at + 4] = struct.pack("<I", 2**32 - 1)
    with pytest.raises(CaptureError, match="0 rows of 3"):
        read(tmp_path, bytes(data))


def test_no_such_file(tmp_path):
    with pytest.raises(CaptureError, match="file"):
        read_ply(tmp_path / "cloud.ply")
    with pytest.raises(CaptureError, match="file"):
        read_ply(tmp_path)


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_memory_is_in_proportion(tmp_path, encoding):
    """Large clouds are read by columns: a few copies of the data, not one object a number."""
    count = 100_000
    table = np.random.default_rng(0).normal(size=(count, 3)).astype("<f4")
    body = (
        table.tobytes() if encoding != "ascii" else b"".join(b"%.4f %.4f %.4f\n" % tuple(row) for row in table.tolist())
    )
    (tmp_path / "big.ply").write_bytes(HEADER.format(encoding, count).encode() + body)
    tracemalloc.start()
    start = time.process_time()
    points = read_ply(tmp_path / "big.ply").points
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert points.shape == (count, 3) and time.process_time() - start < 5
    assert peak < 6 * points.nbytes
