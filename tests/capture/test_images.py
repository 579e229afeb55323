"""Finding photographs and their size without decoding them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from kerfwright.capture.images import ImageFinder, image_size
from kerfwright.errors import CaptureError


def picture(path, width=37, height=23):
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), np.random.default_rng(0).integers(0, 255, (height, width, 3), np.uint8))
    return path


@pytest.mark.parametrize("suffix", ["jpg", "jpeg", "JPG", "png", "tif", "tiff"])
def test_sizes(tmp_path, suffix):
    assert image_size(picture(tmp_path / f"a.{suffix}")) == (37, 23)


def test_size_of_a_progressive_jpeg_with_a_long_comment(tmp_path):
    path = tmp_path / "a.jpg"
    cv2.imwrite(str(path), np.zeros((23, 37, 3), np.uint8), [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])
    data = path.read_bytes()
    path.write_bytes(data[:2] + b"\xff\xfe\xff\xff" + b"\xff\xc0" * 32766 + b"\0" + b"\xff\xff" + data[2:])
    assert image_size(path) == (37, 23)


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif"])
def test_damaged_headers_are_told(tmp_path, suffix):
    path = picture(tmp_path / f"a.{suffix}")
    whole = path.read_bytes()
    for end in (0, 1, 2, 3, 8, 12, 20):
        path.write_bytes(whole[:end])
        with pytest.raises(CaptureError, match="whole JPEG, PNG or TIFF"):
            image_size(path)


@pytest.mark.parametrize(
    "data",
    [
        b"GIF89a" + bytes(40),
        b"\xff\xd8" + bytes(100),
        b"II*\0\xff\xff\xff\xff" + bytes(20),
        b"\xff\xd8\xff\xe0\0\0" * 9,
    ],
)
def test_other_data_is_told(tmp_path, data):
    (tmp_path / "a.jpg").write_bytes(data)
    with pytest.raises(CaptureError, match="image: no size"):
        image_size(tmp_path / "a.jpg")


@pytest.fixture
def folder(tmp_path):
    for name in ("images/a.jpg", "images/sub dir/b é.png", "c.jpg"):
        picture(tmp_path / "capture" / name)
    picture(tmp_path / "secret.jpg")
    return tmp_path / "capture"


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("a.jpg", "images/a.jpg"),
        ("images/a.jpg", "images/a.jpg"),
        ("./a.jpg", "images/a.jpg"),
        ("sub dir/b é.png", "images/sub dir/b é.png"),
        ("sub dir\\b é.png", "images/sub dir/b é.png"),
        ("images\\a.jpg", "images/a.jpg"),
        ("c.jpg", "c.jpg"),
        ("../c.jpg", "c.jpg"),
    ],
)
def test_names_are_found(folder, name, file):
    assert ImageFinder(folder).find(name, folder / "images.txt") == folder / file


def test_absolute_name_inside_the_capture_is_found(folder):
    assert (
        ImageFinder(folder).find(str(folder / "images" / "a.jpg"), folder / "images.txt") == folder / "images" / "a.jpg"
    )


def test_relative_capture_folder(folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    from pathlib import Path

    found = ImageFinder(Path("capture")).find("a.jpg", Path("images.txt"))
    assert found.samefile(folder / "images" / "a.jpg")


@pytest.mark.parametrize(
    "name",
    [
        "../../secret.jpg",
        "..\\..\\secret.jpg",
        "x/../../../secret.jpg",
        "a\0.jpg",
    ],
)
def test_names_that_leave_the_capture_are_refused(folder, name):
    with pytest.raises(CaptureError, match="outside of") as error:
        ImageFinder(folder).find(name, folder / "images.txt")
    assert "\n" not in str(error.value) and "\0" not in str(error.value)


def test_missing_files_are_remembered(folder):
    finder = ImageFinder(folder)
    secrets = ["/etc/passwd", str(folder.parent / "secret.jpg"), "C:\\x\\secret.jpg"]
    names = ["z.jpg", "n" * 5000 + ".jpg", "", "/", *secrets]
    assert [finder.find(name, folder / "images.txt") for name in names] == [None] * len(names)
    assert finder.missing == names


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("C:\\photos\\a.jpg", "images/a.jpg"),
        ("c:/photos/a.jpg", "images/a.jpg"),
        ("\\\\server\\share\\a.jpg", "images/a.jpg"),
        ("/home/me/my photos/sub dir/b é.png", "images/sub dir/b é.png"),
        ("/home/me/sub dir/b e\u0301.png", "images/sub dir/b é.png"),
        ("elsewhere/A.JPG", "images/a.jpg"),
        ("a", "images/a.jpg"),
        ("D:\\b é", "images/sub dir/b é.png"),
    ],
)
def test_names_of_other_machines_are_matched_by_their_ends(folder, name, file):
    assert ImageFinder(folder).find(name, folder / "images.txt") == folder / file


def test_names_that_two_files_end_like_are_refused(folder):
    for side in ("left", "right"):
        (folder / "images" / side).mkdir()
        (folder / "images" / side / "1.jpg").write_bytes((folder / "images" / "a.jpg").read_bytes())
    finder = ImageFinder(folder)
    assert finder.find("/photos/right/1.jpg", folder / "x.sfm") == folder / "images" / "right" / "1.jpg"
    with pytest.raises(CaptureError, match=r"x\.sfm: image: /photos/1\.jpg: could be images/left/1\.jpg or "):
        finder.find("/photos/1.jpg", folder / "x.sfm")


def test_linked_folder_of_images(folder, tmp_path):
    (folder / "images").rename(tmp_path / "elsewhere")
    (folder / "images").symlink_to(tmp_path / "elsewhere")
    assert ImageFinder(folder).find("a.jpg", folder / "images.txt") == folder / "images" / "a.jpg"


def test_no_photographs(tmp_path):
    with pytest.raises(CaptureError, match="images: none"):
        ImageFinder(tmp_path)
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "notes.txt").write_text("none")
    with pytest.raises(CaptureError, match="images: none"):
        ImageFinder(tmp_path)
