"""Captures that cannot be used: one line that names file, field, value and remedy; exit code 2; no output folder."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from kerfwright.demo import demo_capture

HEADER = "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


def no_images(capture: Path) -> None:
    shutil.rmtree(capture / "images")


def no_cameras(capture: Path) -> None:
    shutil.rmtree(capture / "sparse")


def no_cloud(capture: Path) -> None:
    (capture / "cloud.ply").unlink()


def most_images_are_missing(capture: Path) -> None:
    for path in sorted((capture / "images").iterdir())[:11]:
        path.unlink()


def an_image_is_outside(capture: Path) -> None:
    edit(capture / "sparse/0/images.txt", "IMG_0010.jpg", "../../secret.jpg")


def three_points(capture: Path) -> None:
    write_cloud(capture, "0 0 0\n0 0 1\n0 1 0\n", 3)


def not_a_number(capture: Path) -> None:
    rows = np.random.default_rng(0).random((500, 3)).round(4).tolist()
    rows[123][1] = "nan"
    write_cloud(capture, "".join(f"{x} {y} {z}\n" for x, y, z in rows), 500)


def header_promises_more(capture: Path) -> None:
    data = (capture / "cloud.ply").read_bytes()
    (capture / "cloud.ply").write_bytes(data.replace(b"element vertex 120000", b"element vertex 99999999999"))


def cut_short(capture: Path) -> None:
    data = (capture / "cloud.ply").read_bytes()
    (capture / "cloud.ply").write_bytes(data[: len(data) // 2])


def unknown_camera_model(capture: Path) -> None:
    edit(capture / "sparse/0/cameras.txt", "PINHOLE", "FISHEYE9")


def focal_length_zero(capture: Path) -> None:
    edit(capture / "sparse/0/cameras.txt", "803.679014", "0")


def a_ball(capture: Path) -> None:
    points = np.random.default_rng(0).normal(size=(4000, 3))
    points = 0.2 * points / np.linalg.norm(points, axis=1, keepdims=True) + [0, 0, 0.2]
    write_cloud(capture, "".join(f"{x:.5f} {y:.5f} {z:.5f}\n" for x, y, z in points), 4000)


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def write_cloud(capture: Path, rows: str, count: int) -> None:
    (capture / "cloud.ply").write_text(HEADER.format(count) + rows)


CASES = {
    no_images: ["images", "none"],
    no_cameras: ["cameras", "sparse"],
    no_cloud: ["cloud.ply"],
    most_images_are_missing: ["sparse/0", "IMG_0000.jpg", "nor 10 more"],
    an_image_is_outside: ["sparse/0", "secret.jpg"],
    three_points: ["3"],
    not_a_number: ["cloud.ply", "nan"],
    header_promises_more: ["cloud.ply", "99999999999"],
    cut_short: ["cloud.ply"],
    unknown_camera_model: ["cameras.txt", "FISHEYE9", "PINHOLE"],
    focal_length_zero: ["cameras.txt", "0"],
    a_ball: ["cloud"],
}


@pytest.fixture
def capture(tmp_path) -> Path:
    """A copy of the shipped capture."""
    return shutil.copytree(demo_capture(), tmp_path / "capture", ignore=shutil.ignore_patterns("truth"))


def reconstruct(capture: Path) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "kerfwright", "reconstruct", str(capture), "-q", "-o", str(capture.parent / "out")]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


@pytest.mark.parametrize("spoil", CASES, ids=lambda f: f.__name__)
def test_one_line_that_says_what_is_wrong(capture, spoil):
    spoil(capture)
    done = reconstruct(capture)
    assert done.returncode == 2, done.stderr
    assert done.stdout == "" and done.stderr.startswith("kerfwright: error: ") and done.stderr.count("\n") == 1
    assert all(word in done.stderr for word in CASES[spoil]), done.stderr
    assert done.stderr.count(": ") >= 3, "where, what, and what to do"
    assert [p.name for p in capture.parent.iterdir()] == ["capture"]


def test_no_such_folder(tmp_path):
    done = reconstruct(tmp_path / "nowhere")
    assert done.returncode == 2 and "nowhere" in done.stderr and done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_capture_is_never_written_to(capture):
    command = [sys.executable, "-m", "kerfwright", "reconstruct", str(capture), "-q", "-o", str(capture)]
    before = sorted(p.relative_to(capture) for p in capture.rglob("*"))
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2 and "did not write" in done.stderr
    assert sorted(p.relative_to(capture) for p in capture.rglob("*")) == before
