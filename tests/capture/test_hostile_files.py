"""Files as other machines, countries and bad luck leave them: cut short, UTF-16, CRLF, comma decimals, NaN, bombs."""

from __future__ import annotations

import re
import struct
import zlib

import cv2
import numpy as np
import pytest

from e57 import content_of, paged
from kerfwright.capture import open_capture
from kerfwright.capture.types import View
from kerfwright.errors import CaptureError
from samples import readers, write_samples

TEXTS = (
    "cameras.txt", "images.txt", "bundle.out", "list.txt", "cameras.csv", "a.xmp", "cameras.xml", "cameras.sfm",
    "transforms.json", "sfm_data.json", "ascii.ply", "ascii.pcd", "a.xyz",
)  # fmt: skip
BINARIES = (
    "cameras.bin", "images.bin", "simple.ply", "binary_little_endian.ply", "binary_big_endian.ply", "binary.pcd",
    "compressed.pcd", "a.las", "b.las", "a.laz", "b.laz", "a.e57",
)  # fmt: skip
# Rows, such as photographs' names and points, that a file may have one fewer of.
CUT_IN_MID_ROW = {"list.txt": 5, "a.xyz": -12, "cameras.csv": -40}


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    folder = tmp_path_factory.mktemp("good")
    write_samples(folder)
    return folder


@pytest.fixture
def samples(good, tmp_path):
    for path in good.iterdir():
        if path.is_file():
            (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


def read(folder, name, data):
    """COLMAP's text without its binary files, which come first."""
    (folder / name).write_bytes(data)
    if name in ("cameras.txt", "images.txt"):
        for other in ("cameras.bin", "images.bin"):
            (folder / other).unlink(missing_ok=True)
    return readers(folder)["." + name.rsplit(".")[-1]](name)


def told(folder, name, data) -> str:
    """What the error says after the file's path."""
    with pytest.raises(CaptureError) as caught:
        read(folder, name, data)
    message = str(caught.value)
    assert "\n" not in message and len(message) < 600
    assert message.startswith(str(folder)) and message.count(str(folder)) == 1
    return message.split(": ", 1)[1]


def same(one, other) -> bool:
    """Poses or a cloud, number for number."""
    if not isinstance(one, list):
        return np.array_equal(one.points, other.points)
    pairs = zip(one, other, strict=True)
    return all(a.camera == b.camera and np.array_equal(a.camera_from_capture, b.camera_from_capture) for a, b in pairs)


@pytest.mark.parametrize("name", TEXTS + BINARIES)
@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_cut_short(samples, name, share):
    data = (samples / name).read_bytes()
    remedy = r"export|copy"
    assert re.search(remedy, told(samples, name, data[: CUT_IN_MID_ROW.get(name) or int(share * len(data))]))


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("end", [b"\r\n", b"\r"])
def test_lines_that_end_as_elsewhere(samples, name, end):
    data = (samples / name).read_bytes()
    whole = read(samples, name, data)
    if end == b"\r" and name == "ascii.pcd":
        assert "DATA: missing" in told(samples, name, data.replace(b"\n", end))
    else:
        assert same(read(samples, name, data.replace(b"\n", end)), whole)


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_utf_16(samples, name, encoding):
    """XML says itself what it is encoded in; whatever else is UTF-16 is told."""
    data = (samples / name).read_bytes()
    other = data.decode("utf-8").encode(encoding)
    if name.endswith(("xml", "xmp")):
        other = data.decode("utf-8").replace('encoding="UTF-8"', "").encode(encoding)
        assert same(read(samples, name, other), read(samples, name, data))
    else:
        assert re.search("save the file as UTF-8|not a PLY file|DATA: missing", told(samples, name, other))


BOMB = (
    "<!DOCTYPE a [<!ENTITY a 'aaaaaaaaaa'>"
    + "".join(f"<!ENTITY {b} '{f'&{a};' * 10}'>" for a, b in zip("abcdefgh", "bcdefghi", strict=True))
    + "]>"
)


@pytest.mark.parametrize("name", ["a.xmp", "cameras.xml"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("entity", [BOMB, '<!DOCTYPE a [<!ENTITY i SYSTEM "file:///etc/passwd">]>', "<!DOCTYPE a>"])
def test_entities_are_refused(samples, name, encoding, entity):
    text = re.sub(r"<\?xml.*?\?>", "", (samples / name).read_text())
    first = re.search(r"<[^>]*>", text)[0]
    bomb = f"{entity}{text.replace(first, first + '&i;', 1)}".encode(encoding)
    assert told(samples, name, bomb).startswith("XML: <!DOCTYPE")


@pytest.mark.parametrize(
    ("name", "old", "new", "expected"),
    [
        ("cameras.txt", "18.0", "18,0", "parameter 1: 18,0: use a decimal point, not a comma"),
        ("cameras.txt", "18.0", "nan", "parameter 1: nan: a finite number"),
        ("images.txt", " 0.6015", " 0,6015", "use a decimal point, not a comma"),
        ("images.txt", " 0.6015", " inf ", "QX: inf: a finite number"),
        ("bundle.out", "0.1 -0.2", "0,1 -0.2", "camera 0: 0,1: use a decimal point, not a comma"),
        ("bundle.out", "0.1 0.2 0.3", "0.1 nan 0.3", "camera 0: nan: a finite number"),
        ("cameras.csv", ",27.5,", ',"27,5",', "row 1 f: 27,5: use a decimal point, not a comma"),
        ("cameras.csv", ",27.5,", ",inf,", "row 1 f: inf: a finite number"),
        ("a.xmp", 'FocalLength35mm="', 'FocalLength35mm="1,', "use a decimal point, not a comma"),
        ("a.xmp", 'FocalLength35mm="', 'FocalLength35mm="nan', "FocalLength35mm: nan"),
        ("cameras.xml", "<b1>", "<b1>0,5", "use a decimal point, not a comma"),
        ("cameras.xml", "<f>610.0", "<f>nan", "f: nan: a finite number"),
        ("cameras.sfm", '"7.2', '"7,2', "sensorWidth: 7,2.*: use a decimal point, not a comma"),
        ("cameras.sfm", '"7.2', '"nan', "sensorWidth: nan"),
        ("transforms.json", '"fl_x": ', '"fl_x": NaN, "x": ', "fl_x: nan: a finite number"),
        ("transforms.json", '"fl_x": ', '"fl_x": "1,5", "x": ', "fl_x: 1,5: use a decimal point, not a comma"),
        ("sfm_data.json", '"focal_length": ', '"focal_length": -Infinity, "x": ', "focal_length: -inf: a finite"),
        ("ascii.ply", "0.5 1", "0,5 1", "numbers with decimal points belong here"),
        ("ascii.pcd", "DATA ascii\n0.", "DATA ascii\n0,", "column x: .*numbers belong here"),
    ],
)
def test_numbers_that_are_none(samples, name, old, new, expected):
    text = (samples / name).read_text()
    assert old in text
    assert re.search(expected, told(samples, name, text.replace(old, new, 1).encode()))


@pytest.mark.parametrize("row", ["1,5 2,5 3,5", "1,5;2,5;3,5", "1,5\t2,5\t3,5"])
def test_points_with_commas_for_decimal_points(samples, row):
    assert "decimal points" in told(samples, "a.xyz", f"{row}\n{row}\n".encode())


@pytest.mark.parametrize("points", [10**9, 90_000_000])
def test_more_points_than_an_e57_file_can_hold(samples, points):
    """With right check sums."""
    content = content_of((samples / "a.e57").read_bytes())
    bomb = content.replace(b'recordCount="40"', b'recordCount="%d"' % (points - 40), 1)  # of two scans
    xml = len(bomb) - len(content)
    length = struct.unpack_from("<Q", content, 32)[0]
    bomb = bomb[:32] + struct.pack("<Q", length + xml) + bomb[40 : len(content)]
    assert told(samples, "a.e57", paged(bomb)).startswith(f"points: {points}: ")


def png_header(width, height):
    """A whole PNG file of so many pixels, but for these."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(bytes(10**5))) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(65535, 65535), (30000, 30000)])
def test_photographs_of_absurd_size(capture_folder, size):
    (capture_folder / "images" / "3.png").write_bytes(png_header(*size))
    cameras = capture_folder / "sparse" / "0" / "cameras.txt"
    cameras.write_text(cameras.read_text().replace(" 64 48 ", " {} {} ".format(*size), 1))
    for path in (capture_folder / "images").iterdir():
        path.write_bytes(png_header(*size))
    with pytest.raises(CaptureError, match=r"image size: {}x{}: at most \d+ pixels: shrink it".format(*size)):
        open_capture(capture_folder)


def test_a_photograph_that_opencv_will_not_take(tmp_path, capture_folder):
    (tmp_path / "a.png").write_bytes(png_header(65535, 65535))
    view = open_capture(capture_folder).views[0]
    with pytest.raises(CaptureError, match=r"a\.png: image: cannot be read"):
        View("a", tmp_path / "a.png", view.camera, view.camera_from_world).image()


@pytest.mark.parametrize("share", [0.5, 0.9, 0.99])
@pytest.mark.parametrize("preview", [False, True])
def test_a_photograph_cut_short_is_not_painted_grey(capture_folder, share, preview):
    """A preview in the file has an end mark of its own."""
    names = [path.stem for path in sorted((capture_folder / "images").iterdir())]
    noise = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
    whole = cv2.imencode(".jpg", noise)[1].tobytes()
    if preview:
        whole = whole[:2] + b"\xff\xe1" + struct.pack(">H", len(whole) + 2) + whole + whole[2:]
    for name in names:
        (capture_folder / "images" / f"{name}.png").unlink()
        (capture_folder / "images" / f"{name}.jpg").write_bytes(whole + b"what some phones append")
    poses = capture_folder / "sparse" / "0" / "images.txt"
    poses.write_text(poses.read_text().replace(".png", ".jpg"))
    assert len(open_capture(capture_folder).views) == len(names)
    start = len(whole) // 2 if preview else 0
    (capture_folder / "images" / "4.jpg").write_bytes(whole[: start + int(share * (len(whole) - start))])
    with pytest.raises(CaptureError, match=r"4\.jpg: image: cut short: copy or export it again"):
        open_capture(capture_folder)


@pytest.mark.parametrize("name", ["/etc/passwd.png", "C:\\secret.png", "\\\\server\\secret.png"])
def test_absolute_names_are_matched_by_their_ends_inside(capture_folder, name):
    """Other machines' paths are common; what lies there is never opened."""
    poses = capture_folder / "sparse" / "0" / "images.txt"
    poses.write_text(poses.read_text().replace("0.png", name))
    opened = open_capture(capture_folder)
    assert len(opened.views) == 7 and name.rsplit("/")[-1].rsplit("\\")[-1] in opened.notes[0]
    assert all(capture_folder in view.path.parents for view in opened.views)


def test_no_room_to_unpack_is_not_taken_for_damage(samples, monkeypatch):
    from kerfwright.capture import laz

    monkeypatch.setattr(laz, "UNPACK", "raise OSError(28, 'No space left on device', 'points')")
    message = told(samples, "a.laz", (samples / "a.laz").read_bytes())
    assert "No space left on device" in message and "free some space in /" in message and "damaged" not in message


def test_want_of_memory_is_not_taken_for_damage(samples, monkeypatch):
    import pye57

    def want(*_, **__):
        raise MemoryError("Unable to allocate 2.4 GiB")

    monkeypatch.setattr(pye57.E57, "read_scan", want)
    assert "thin the cloud" in told(samples, "a.e57", (samples / "a.e57").read_bytes())
