"""A small whole file of every format that is read, and what reads it: what hostile files are made from."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

import exports
from kerfwright.capture import Camera, Cloud, View, write_colmap_text, write_ply
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

__all__ = ["SNIPPETS", "colmap_binary", "look_at", "quaternion", "readers", "ring_of_views", "write_samples"]

MODEL_IDS = {
    "SIMPLE_PINHOLE": 0, "PINHOLE": 1, "SIMPLE_RADIAL": 2, "RADIAL": 3, "OPENCV": 4, "OPENCV_FISHEYE": 5,
    "FULL_OPENCV": 6, "SIMPLE_RADIAL_FISHEYE": 8, "RADIAL_FISHEYE": 9,
}


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

def look_at(centre: np.ndarray, target: np.ndarray) -> np.ndarray:
    """camera_from_world of a camera at `centre` that sees `target` in mid-image, world z upwards."""
    forward = (target - centre) / np.linalg.norm(target - centre)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = -pose[:3, :3] @ centre
    return pose


def ring_of_views(
    count: int, radius: float, height: float, target: np.ndarray, folder: Path, size=(64, 48)
) -> list[View]:
    """Views from all sides; the files of their images need not exist."""
    camera = Camera("PINHOLE", *size, (0.9 * size[0], 0.9 * size[0], size[0] / 2, size[1] / 2))
    angles = 2 * np.pi * np.arange(count) / count
    centres = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(count, height)], axis=1) + target
    return [View(f"{i}.png", folder / "images" / f"{i}.png", camera, look_at(c, target)) for i, c in enumerate(centres)]


def colmap_binary(folder: Path, views: list[View]) -> None:
    """cameras.bin and images.bin as https://colmap.github.io/format.html has them; two 2-D points a view."""
    folder.mkdir(parents=True, exist_ok=True)
    cameras, images = [struct.pack("<Q", len(views))], [struct.pack("<Q", len(views))]
    for i, view in enumerate(views, 1):
        camera = view.camera
        cameras.append(struct.pack("<IiQQ", i, MODEL_IDS[camera.model], camera.width, camera.height))
        cameras.append(struct.pack(f"<{len(camera.params)}d", *camera.params))
        pose = view.camera_from_world
        images.append(struct.pack("<I7dI", i, *quaternion(pose[:3, :3]), *pose[:3, 3], i) + view.name.encode() + b"\0")
        images.append(struct.pack("<Q", 2) + struct.pack("<ddq", 1.5, 2.5, -1) * 2)
    (folder / "cameras.bin").write_bytes(b"".join(cameras))
    (folder / "images.bin").write_bytes(b"".join(images))


def quaternion(turn: np.ndarray) -> np.ndarray:
    """(w, x, y, z): the eigenvector of Bar-Itzhack's matrix with the largest eigenvalue."""
    (a, b, c), (d, e, f), (g, h, i) = turn
    k = np.array(
        [
            [a + e + i, h - f, c - g, d - b],
            [h - f, a - e - i, b + d, c + g],
            [c - g, b + d, e - a - i, f + h],
            [d - b, c + g, f + h, i - a - e],
        ]
    )
    return np.linalg.eigh(k)[1][:, -1]


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


def write_samples(folder: Path) -> None:
    """Write a small whole file of every format that is read."""
    views = ring_of_views(2, 1.0, 0.5, np.zeros(3), folder, (20, 10))
    write_colmap_text(folder, views)
    colmap_binary(folder, views)
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


def other_programs(folder: Path) -> None:
    """cameras.csv, cameras.xml, cameras.sfm, transforms.json, sfm_data.json, and an XMP file."""
    exports.images(folder)
    for writer in (
        exports.rc_csv, exports.rc_xmp, exports.metashape, exports.meshroom, exports.nerfstudio, exports.openmvg,
    ):
        writer(folder, exports.scene())
    (folder / "images" / "x.xmp").rename(folder / "a.xmp")


def other_clouds(folder: Path) -> None:
    import laspy
    import open3d as o3d

    points = np.random.default_rng(2).uniform(size=(40, 3))
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    o3d.io.write_point_cloud(str(folder / "ascii.pcd"), cloud, write_ascii=True)
    o3d.io.write_point_cloud(str(folder / "binary.pcd"), cloud)
    o3d.io.write_point_cloud(str(folder / "compressed.pcd"), cloud, compressed=True)
    (folder / "a.xyz").write_text("\n".join(" ".join(f"{v:.5f}" for v in [*p, 1, 0, -1, 9, 8, 7]) for p in points))
    _las(folder, "a", laspy.LasHeader(point_format=2, version="1.2"), points)
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.add_extra_dims([laspy.ExtraBytesParams(name=f"Normal{a}", type="float32") for a in "XYZ"])
    _las(folder, "b", header, points)
    _e57(folder / "a.e57", points)


def _las(folder: Path, name: str, header, points: np.ndarray) -> None:
    """The same points plain and packed; not packed by threads, so that this process can still be forked."""
    import laspy

    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.write(str(folder / f"{name}.las"))
    las.write(str(folder / f"{name}.laz"), laz_backend=laspy.LazBackend.Lazrs)


def _e57(path: Path, points: np.ndarray) -> None:
    """Two scans, the first coloured and with points that are marked as not valid."""
    import pye57

    file = pye57.E57(str(path), mode="w")
    data = {f"cartesian{axis}": points[:, k].copy() for k, axis in enumerate("XYZ")}
    more = {f"color{c}": np.arange(len(points), dtype=np.uint8) for c in ("Red", "Green", "Blue")}
    more["cartesianInvalidState"] = (np.arange(len(points)) % 5 == 0).astype(np.int8)
    file.write_scan_raw(data | more, rotation=np.array([0.6, 0, 0, 0.8]), translation=np.array([1.0, 2, 3]))
    file.write_scan_raw(data)
    file.close()


def readers(folder: Path) -> dict[str, Callable]:
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
