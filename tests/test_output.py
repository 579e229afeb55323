"""The output folder keeps what is not ours, and is whole or untouched."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from kerfwright.errors import OutputError
from kerfwright.output import OutputFolder


def fill_with(**files):
    """A fill that writes each file; `__` in a name stands for a slash and `_` for a dot."""

    def fill(folder: Path) -> None:
        for name, text in files.items():
            path = folder / name.replace("__", "/").replace("_", ".")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    return fill


def write(path: Path, **files) -> list[Path]:
    with OutputFolder(path).claimed() as folder:
        return folder.write(fill_with(**files))


def visible(path: Path) -> dict[str, str]:
    files = (p for p in path.rglob("*") if p.is_file() and not p.name.startswith("."))
    return {p.relative_to(path).as_posix(): p.read_text() for p in files}


def test_writes_and_replaces_its_own_files(tmp_path):
    out = tmp_path / "a" / "out"
    assert write(out, model_json="1", parts__leg_dxf="L") == [out / "model.json", out / "parts" / "leg.dxf"]
    write(out, model_json="2")
    assert visible(out) == {"model.json": "2"}
    assert not (out / "parts").exists(), "a folder that no longer holds anything goes too"


def test_keeps_other_files_when_asked(tmp_path):
    write(tmp_path / "out", model_json="1")
    with OutputFolder(tmp_path / "out").claimed() as folder:
        folder.write(fill_with(cut_svg="s"), keep_others=True)
    assert visible(tmp_path / "out") == {"model.json": "1", "cut.svg": "s"}
    write(tmp_path / "out", model_json="2")
    assert visible(tmp_path / "out") == {"model.json": "2"}, "kept files are still known as ours"


@pytest.mark.parametrize("name", ["notes.txt", "parts/mine.dxf", ".git/config", "model.step"])
def test_refuses_a_folder_with_anything_else_in_it(tmp_path, name):
    out = tmp_path / "out"
    write(out, model_json="1", parts__leg_dxf="L")
    (out / name).parent.mkdir(exist_ok=True)
    (out / name).write_text("mine")
    with pytest.raises(OutputError, match=r"did not write.*choose another folder") as caught:
        write(out, model_json="2")
    assert str(out / name) in str(caught.value)
    assert (out / name).read_text() == "mine" and (out / "model.json").read_text() == "1"


def test_refuses_a_file_that_was_edited_since(tmp_path):
    write(tmp_path / "out", model_json="1", run_json="t")
    (tmp_path / "out" / "run.json").write_text("times may differ")
    write(tmp_path / "out", model_json="1", run_json="t")
    (tmp_path / "out" / "model.json").write_text("edited by hand")
    with pytest.raises(OutputError, match=r"model\.json.*changed since"):
        write(tmp_path / "out", model_json="2")


def test_accepts_an_empty_folder_and_one_whose_files_were_deleted(tmp_path):
    (tmp_path / "out").mkdir()
    write(tmp_path / "out", model_json="1", cut_svg="s")
    (tmp_path / "out" / "cut.svg").unlink()
    write(tmp_path / "out", model_json="2")
    assert visible(tmp_path / "out") == {"model.json": "2"}


def test_a_failed_run_leaves_the_old_results(tmp_path):
    out = tmp_path / "out"
    write(out, model_json="1")

    def fails(folder: Path) -> None:
        (folder / "model.json").write_text("half")
        raise ValueError("in mid-write")

    with pytest.raises(ValueError), OutputFolder(out).claimed() as folder:
        folder.write(fails)
    assert visible(out) == {"model.json": "1"}
    assert sorted(os.listdir(out)) == [".kerfwright.json", "model.json"]


def test_a_failed_first_run_leaves_nothing(tmp_path):
    with pytest.raises(ValueError), OutputFolder(tmp_path / "a" / "b").claimed():
        raise ValueError
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_a_clear_error(tmp_path):
    def fill(folder: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder / "model.step"))

    with pytest.raises(OutputError, match=r"model\.step.*No space left.*free some space"), \
            OutputFolder(tmp_path / "out").claimed() as folder:
        folder.write(fill)
    assert not (tmp_path / "out").exists()


def test_a_file_in_the_way(tmp_path):
    (tmp_path / "out").write_text("x")
    with pytest.raises(OutputError, match="is a file"):
        write(tmp_path / "out", model_json="1")
    with pytest.raises(OutputError, match="Not a directory"):
        write(tmp_path / "out" / "deeper", model_json="1")


@pytest.mark.parametrize("name", ["../precious.txt", "/etc/passwd", "a/../../precious.txt", ""])
def test_a_manifest_cannot_name_files_outside(tmp_path, name):
    out = tmp_path / "out"
    write(out, model_json="1")
    (tmp_path / "precious.txt").write_text("keep")
    (out / ".kerfwright.json").write_text(json.dumps({"files": {name: None, "model.json": None}}))
    with pytest.raises(OutputError, match="not as kerfwright writes it"):
        write(out, model_json="2")
    assert (tmp_path / "precious.txt").read_text() == "keep"


DYING = """
import os, sys
from pathlib import Path
from kerfwright.output import OutputFolder
moves = 0
replace = os.replace
def counting(a, b):
    global moves
    if moves == {after}:
        os.kill(os.getpid(), 9)
    moves += 1
    replace(a, b)
os.replace = counting
def fill(folder):
    for name in ("a", "b", "c"):
        (folder / name).write_text("new")
        if {after} < 0 and name == "b":
            os.kill(os.getpid(), 9)
with OutputFolder(Path(sys.argv[1])).claimed() as folder:
    folder.write(fill)
"""


@pytest.mark.parametrize("after", [-1, 0, 1, 2, 3])
def test_killed_in_mid_write_it_is_all_old_or_all_new(tmp_path, after):
    out = tmp_path / "out"
    write(out, a="old", b="old", d="old")
    dead = subprocess.run([sys.executable, "-c", DYING.format(after=after), out], capture_output=True)
    assert dead.returncode == -9
    with OutputFolder(out).claimed():
        pass
    expected = dict.fromkeys("abd", "old") if after < 0 else dict.fromkeys("abc", "new")
    assert visible(out) == expected
    assert sorted(os.listdir(out)) == sorted([".kerfwright.json", *expected])


def test_two_runs_on_one_folder_refuse_each_other(tmp_path):
    out = tmp_path / "out"
    with OutputFolder(out).claimed() as first:
        with pytest.raises(OutputError, match=f"process {os.getpid()} is writing"), OutputFolder(out).claimed():
            pass
        first.write(fill_with(model_json="1"))
    write(out, model_json="2")
    assert visible(out) == {"model.json": "2"}


def test_the_manifest_is_the_same_from_run_to_run(tmp_path):
    for name, seconds in (("one", "1"), ("two", "2")):
        write(tmp_path / name, model_json="m", run_json=seconds)
    assert (tmp_path / "one/.kerfwright.json").read_bytes() == (tmp_path / "two/.kerfwright.json").read_bytes()


def test_a_manifest_nested_without_end_is_told(tmp_path):
    write(tmp_path / "out", a_txt="1")
    (tmp_path / "out" / ".kerfwright.json").write_text("[" * 20_000)
    folder = OutputFolder(tmp_path / "out")
    with pytest.raises(OutputError, match="manifest: not as kerfwright writes it"), folder.claimed():
        pass
