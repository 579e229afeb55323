"""Whatever is in a file: the reader reads it or says what is wrong, in one line, in little time and memory."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kerfwright.capture import open_capture
from kerfwright.capture.ply import read_ply
from kerfwright.capture.readers import read_cloud
from kerfwright.errors import CaptureError
from samples import SNIPPETS, readers, write_samples

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


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Whole files, by name."""
    folder = tmp_path_factory.mktemp("good")
    write_samples(folder)
    return folder


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
    "b.las",
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


# What fuzzing found (benchmarks/fuzz.py), at its smallest: file, bytes in it, other bytes, what is told or None.
FOUND = [
    ("ascii.ply", b"2 7 8 255", b"9" * 30 + b" 7 8 255", None),  # took years
    ("binary_little_endian.ply", b"element vertex 4", b"element vertex 0", None),  # IndexError
    ("ascii.pcd", b"COUNT 1 1 1", b"COUNT 0 1 1", "FIELDS"),  # KeyError
    ("binary.pcd", b"COUNT 1 1 1", b"COUNT 0 1 1", "FIELDS"),  # ValueError
    ("cameras.xml", b"<transform>", b"<transform>1e308 ", "numbers belong here"),
]


@pytest.mark.parametrize(("name", "old", "new", "told"), FOUND)
def test_what_fuzzing_found(good, tmp_path, name, old, new, told):
    data = (good / name).read_bytes()
    assert old in data
    if told is None:
        read_only(good, tmp_path, name, data.replace(old, new, 1))
        return
    with pytest.raises(CaptureError, match=told):
        read_only(good, tmp_path, name, data.replace(old, new, 1))


def test_long_names_are_told_shortly(tmp_path):
    (tmp_path / "a.ply").write_text(f"ply\nformat ascii 1.0\nelement {'(' * 9000} 7\nproperty float x\nend_header\n")
    with pytest.raises(CaptureError) as caught:
        read_ply(tmp_path / "a.ply")
    assert len(str(caught.value)) < 600


@pytest.mark.filterwarnings("error")
def test_a_text_cloud_without_a_line_is_told_without_a_warning(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(f"property float {a}\n" for a in "xyz")
    (tmp_path / "a.ply").write_text(f"{header}end_header\n" + "\n" * 60)
    with pytest.raises(CaptureError, match="0 rows of 4"):
        read_ply(tmp_path / "a.ply")


def test_signalling_nan_in_binary_clouds_does_not_warn(good, tmp_path):
    data = (good / "binary.pcd").read_bytes()
    start = data.index(b"DATA binary\n") + len(b"DATA binary\n")
    read_only(good, tmp_path, "binary.pcd", data[:start] + b"\x01\x00\xa0\x7f" + data[start + 4 :])


@pytest.mark.parametrize("record", [bytes([165, 130]), bytes([19, 170]), bytes([218, 158])])
def test_damages_at_which_lazrs_aborts_leave_this_process_alone(good, tmp_path, record):
    """In the item record of the LAZ header: the library asks for more memory than there is, and ends its process."""
    data = bytearray((good / "a.laz").read_bytes())
    data[295:297] = record
    with pytest.raises(CaptureError, match=r"a\.laz: file: lazrs ended with SIGABRT: it is damaged"):
        read_only(good, tmp_path, "a.laz", bytes(data))


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("a.laz", b"laszip encoded", b"nobody encoded", "packing: not told"),
        ("a.laz", bytes([20, 0, 2, 0]), bytes([20, 0, 1, 0]), "LazrsError"),
        ("b.laz", b"\x0a\x00\x1e\x00\x03\x00", b"\x0a\x00\x1e\x00\x63\x00", "LazrsError"),
    ],
)
def test_what_laz_files_do_not_tell_or_tell_wrongly(good, tmp_path, name, old, new, told):
    data = (good / name).read_bytes()
    assert old in data
    with pytest.raises(CaptureError, match=told):
        read_only(good, tmp_path, name, data.replace(old, new, 1))


@pytest.mark.parametrize("name", ["a", "b"])
def test_laz_holds_what_las_holds(good, name):
    """Format 2 and, with normals in extra bytes, format 7, which is packed in layers."""
    plain, packed = (read_cloud(good / f"{name}.{ending}") for ending in ("las", "laz"))
    np.testing.assert_array_equal(plain.points, packed.points)
    np.testing.assert_array_equal(plain.colours, packed.colours)
    assert (packed.normals is not None) == (name == "b") == (plain.normals is not None)


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
