"""Whatever is in a file: the reader reads it or says what is wrong, in one line, in little time and memory."""

from __future__ import annotations

import warnings

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import exports
from kerfwright.capture import Cloud, open_capture, write_colmap_text, write_ply
from kerfwright.capture.alicevision import read_alicevision
from kerfwright.capture.bundler import read_bundler
from kerfwright.capture.colmap import read_colmap
from kerfwright.capture.images import image_size
from kerfwright.capture.metashape import read_metashape
from kerfwright.capture.nerfstudio import read_nerfstudio
from kerfwright.capture.openmvg import read_openmvg
from kerfwright.capture.ply import read_ply
from kerfwright.capture.readers import read_cloud
from kerfwright.capture.realitycapture import read_rc_csv, read_rc_xmp
from kerfwright.errors import CaptureError

SNIPPETS = [
    b"",
    b"\0",
    b"\xff",
    b"\n",
    b"\r\n",
    b" ",
    b"-",
    b"nan",
    b"inf",
    b"1e999",
    b"1,5",
    b"999999999999",
    b"-1",
    b"#",
    b"\xff\xfe",
    b"\x00\x00\x00\x80",
    b"\xff\xff\xff\xff\xff\xff\xff\x7f",
    "é".encode(),
    b"../",
    b"list uchar int ",
    b"end_header\n",
    b"element vertex 7\n",
]
MUTATIONS = st.lists(
    st.tuples(st.floats(0, 1), st.floats(0, 0.1), st.sampled_from(SNIPPETS) | st.binary(max_size=9)),
    min_size=1,
    max_size=4,
)


def mutated(data: bytes, mutations) -> bytes:
    """Each mutation puts other bytes in the place of a stretch."""
    for start, length, other in mutations:
        at = int(start * len(data))
        data = data[:at] + other + data[at + int(length * len(data)) :]
    return data


def ply_bytes(encoding: str) -> bytes:
    header = (
        "ply\nformat {} 1.0\nelement edge 2\nproperty list uchar short n\nelement vertex 4\nproperty float x\n"
        "property float y\nproperty double z\nproperty list uchar int views\nproperty uchar red\nend_header\n"
    )
    if encoding == "ascii":
        return header.format(encoding).encode() + b"1 5\n0\n" + b"0.5 1 -2e3 2 7 8 255\n1 2 3 0 9\n" * 2
    order = "<" if "little" in encoding else ">"
    row = np.array(
        [(0.5, 1, -2e3, 1, 7, 255)],
        [("x", order + "f4"), ("y", order + "f4"), ("z", order + "f8"), ("n", "u1"), ("v", order + "i4"), ("r", "u1")],
    )
    return header.format(encoding).encode() + b"\1\0\5\0" + row.tobytes() * 4


@pytest.fixture(scope="module")
def good(tmp_path_factory, shapes, write_binary):
    """Whole files, by name."""
    folder = tmp_path_factory.mktemp("good")
    views = shapes["ring"](2, 1.0, 0.5, np.zeros(3), folder, (20, 10))
    write_colmap_text(folder, views)
    write_binary(folder, views)
    picture = np.random.default_rng(0).integers(0, 255, (10, 20, 3), np.uint8)
    for name in ("a.jpg", "a.png", "a.tif"):
        cv2.imwrite(str(folder / name), picture)
    write_ply(folder / "simple.ply", Cloud(np.eye(3), np.eye(3), np.zeros((3, 3), np.uint8)))
    (folder / "bundle.out").write_text(
        "# Bundle file v0.3\n2 0\n" + "50 0.1 -0.2\n1 0 0\n0 1 0\n0 0 1\n0.1 0.2 0.3\n" * 2
    )
    (folder / "list.txt").write_text("a.png 0 55.5\na.jpg\n")
    for encoding in ("ascii", "binary_little_endian", "binary_big_endian"):
        (folder / f"{encoding}.ply").write_bytes(ply_bytes(encoding))
    other_programs(folder)
    other_clouds(folder)
    return folder


def other_programs(folder):
    """cameras.csv, cameras.xml, cameras.sfm, transforms.json, sfm_data.json, and an XMP file."""
    exports.images(folder)
    for writer in (
        exports.rc_csv, exports.rc_xmp, exports.metashape, exports.meshroom, exports.nerfstudio, exports.openmvg,
    ):
        writer(folder, exports.scene())
    (folder / "images" / "x.xmp").rename(folder / "a.xmp")


def other_clouds(folder):
    import laspy
    import open3d as o3d
    import pye57

    points = np.random.default_rng(2).uniform(size=(40, 3))
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    o3d.io.write_point_cloud(str(folder / "ascii.pcd"), cloud, write_ascii=True)
    o3d.io.write_point_cloud(str(folder / "binary.pcd"), cloud)
    o3d.io.write_point_cloud(str(folder / "compressed.pcd"), cloud, compressed=True)
    (folder / "a.xyz").write_text("\n".join(" ".join(f"{v:.5f}" for v in [*p, 1, 0, -1, 9, 8, 7]) for p in points))
    las = laspy.LasData(laspy.LasHeader(point_format=2, version="1.2"))
    las.x, las.y, las.z = points.T
    las.write(str(folder / "a.las"))
    las.write(str(folder / "a.laz"))
    file = pye57.E57(str(folder / "a.e57"), mode="w")
    file.write_scan_raw({f"cartesian{axis}": points[:, k].copy() for k, axis in enumerate("XYZ")})
    file.close()


def readers(folder):
    """What reads each file."""

    def picture(name):
        return folder / "a.png"

    return {
        ".ply": lambda name: read_ply(folder / name),
        ".bin": lambda name: read_colmap(folder),
        ".txt": lambda name: (
            read_bundler(folder / "bundle.out", lambda image: folder / "a.png")
            if name == "list.txt"
            else read_colmap(folder)
        ),
        ".out": lambda name: read_bundler(folder / name, lambda image: folder / "a.png"),
        ".jpg": lambda name: image_size(folder / name),
        ".png": lambda name: image_size(folder / name),
        ".tif": lambda name: image_size(folder / name),
        ".csv": lambda name: read_rc_csv(folder / name, picture),
        ".xmp": lambda name: read_rc_xmp([folder / name], picture),
        ".xml": lambda name: read_metashape(folder / name, picture),
        ".sfm": lambda name: read_alicevision(folder / name, picture),
        ".json": lambda name: (read_openmvg if name == "sfm_data.json" else read_nerfstudio)(folder / name, picture),
        **dict.fromkeys((".pcd", ".xyz", ".las", ".laz", ".e57"), lambda name: read_cloud(folder / name)),
    }


FILES = [
    "cameras.txt",
    "images.txt",
    "cameras.bin",
    "images.bin",
    "bundle.out",
    "list.txt",
    "simple.ply",
    "ascii.ply",
    "binary_little_endian.ply",
    "binary_big_endian.ply",
    "a.jpg",
    "a.png",
    "a.tif",
    "cameras.csv",
    "a.xmp",
    "cameras.xml",
    "cameras.sfm",
    "transforms.json",
    "sfm_data.json",
    "ascii.pcd",
    "binary.pcd",
    "compressed.pcd",
    "a.xyz",
    "a.las",
    "a.e57",
]


@pytest.mark.parametrize("name", FILES)
def test_whole_files_are_read(good, tmp_path, name):
    read_only(good, tmp_path, name, (good / name).read_bytes())


def read_only(good, folder, name, data):
    """Read the file with these data beside whole ones; COLMAP text without the binary files that would come first."""
    beside = {"cameras.txt", "images.txt"} if name in ("cameras.txt", "images.txt") else set(FILES)
    for other in beside - {name}:
        if not (folder / other).exists():
            (folder / other).write_bytes((good / other).read_bytes())
    (folder / name).write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        readers(folder)["." + name.rsplit(".")[-1]](name)


@pytest.mark.parametrize("name", FILES)
@settings(max_examples=50, deadline=2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(mutations=MUTATIONS)
def test_only_our_own_errors(good, tmp_path, name, mutations):
    try:
        read_only(good, tmp_path, name, mutated((good / name).read_bytes(), mutations))
    except CaptureError as error:
        assert "\n" not in str(error) and len(str(error)) < 600


@pytest.mark.parametrize("name", ["../../outside.png", "..\\..\\outside.png"])
def test_names_in_a_capture_that_lead_out_are_refused(capture_folder, name):
    (capture_folder.parent / "outside.png").write_bytes((capture_folder / "images" / "0.png").read_bytes())
    poses = capture_folder / "sparse" / "0" / "images.txt"
    poses.write_text(poses.read_text().replace("0.png", name))
    with pytest.raises(CaptureError, match="outside of"):
        open_capture(capture_folder)


def test_terminal_codes_do_not_reach_the_terminal(capture_folder):
    poses = capture_folder / "sparse" / "0" / "images.txt"
    poses.write_text(poses.read_text().replace("0.png", "\x1b[31mred.png"))
    (note,) = open_capture(capture_folder).notes
    assert "31mred.png" in note and "\x1b" not in note


def test_unreadable_file_is_told(capture_folder):
    (capture_folder / "cloud.ply").unlink()
    (capture_folder / "cloud.ply").symlink_to(capture_folder / "nothing.ply")
    with pytest.raises(CaptureError, match="cloud"):
        open_capture(capture_folder)
