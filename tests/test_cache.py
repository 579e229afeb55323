"""Stages that ran once are not run again, unless anything they depend on has changed."""

import errno
import hashlib
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from shapely.geometry import Polygon

from kerfwright import cache as cache_module
from kerfwright.cache import StageCache, folder_hash, program_hash, read_kept
from kerfwright.capture.camera import Camera
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.errors import OutputError
from kerfwright.identify.types import Parts, Primitive, Sheet
from kerfwright.model import Origin, Quantity, Scale


class Counter:
    """A stage that counts how often it ran."""

    def __init__(self, result):
        self.result, self.runs = result, 0

    def __call__(self):
        self.runs += 1
        return self.result


def run(folder: Path, stages: dict, basis: str = "b") -> dict:
    """Run stages, each needing the one before; returns which came from the cache."""
    cache = StageCache(folder, lambda: basis)
    reused, before = {}, "path"
    for name, stage in stages.items():
        _, reused[name] = cache.get(name, (before,), stage)
        before = name
    cache.prune()
    return reused


def test_results_are_the_same_bytes_whatever_orders_sets(tmp_path):
    """A stage that is run again in another process and finds the same must not seem to have found something else."""
    script = (
        "from pathlib import Path; from kerfwright.cache import StageCache; from kerfwright.model import Scale;"
        "result = [Scale(millimetres_per_unit=2, origin='given', note='n'), frozenset('abcdef'), set('fedcba'), set()];"
        "found = StageCache(Path({!r})).get('a', (), lambda: result)[0]"
    )
    for seed in "0123":
        folder = tmp_path / seed
        command = [sys.executable, "-c", script.format(str(folder))]
        subprocess.run(command, check=True, env=os.environ | {"PYTHONHASHSEED": seed})
    assert len({next((tmp_path / seed).iterdir()).read_bytes() for seed in "0123"}) == 1
    scale, *sets = read_kept(tmp_path / "3", "a")
    assert scale.model_fields_set == {"millimetres_per_unit", "origin", "note"}
    assert sets == [set("abcdef"), set("abcdef"), set()] and [type(s) for s in sets] == [frozenset, set, set]


def test_arrays_without_anything_in_them_are_kept(tmp_path):
    fixed = np.zeros((0, 2))
    fixed.flags.writeable = False
    arrays = [np.zeros(0), np.zeros((0, 3)), fixed, fixed.copy(), np.arange(6.0).reshape(2, 3)[:, ::2], np.arange(3)]
    StageCache(tmp_path).get("a", (), lambda: arrays)
    for kept, array in zip(read_kept(tmp_path, "a"), arrays, strict=True):
        assert kept.shape == array.shape
        assert (kept == array).all()


def test_a_second_run_runs_nothing(tmp_path):
    stages = {"a": Counter(1), "b": Counter(2)}
    assert run(tmp_path, stages) == {"a": False, "b": False}
    assert run(tmp_path, stages) == {"a": True, "b": True}
    assert [s.runs for s in stages.values()] == [1, 1]


def test_another_basis_runs_all_and_drops_the_old(tmp_path):
    stages = {"a": Counter(1), "b": Counter(2)}
    run(tmp_path, stages)
    old = set(tmp_path.iterdir())
    assert run(tmp_path, stages, "other") == {"a": False, "b": False}
    assert len(old) == 2 and not old & set(tmp_path.iterdir())


def test_a_stage_whose_inputs_come_out_as_before_is_not_run_again(tmp_path):
    """The capture's folder changed, but what was read from it did not."""
    stages = {"a": Counter(1), "b": Counter(2)}

    def run_with(path: str) -> list[int]:
        cache = StageCache(tmp_path, str, lambda: path)
        cache.get("a", ("path",), stages["a"])
        cache.get("b", ("a",), stages["b"])
        return [s.runs for s in stages.values()]

    assert run_with("one") == [1, 1]
    assert run_with("two") == [2, 1]
    stages["a"].result = 5
    assert run_with("three") == [3, 2]


def test_what_a_result_depends_on_besides_is_in_its_key(tmp_path):
    stage, cache = Counter(1), StageCache(tmp_path)
    assert [cache.get("a", (), stage, lambda said=said: said)[1] for said in "xxyy"] == [False, True, False, True]


def test_a_folder_where_a_result_should_be_is_told(tmp_path):
    StageCache(tmp_path).get("a", (), Counter(1))
    (entry,) = tmp_path.iterdir()
    entry.unlink()
    entry.mkdir()
    with pytest.raises(OutputError, match="Is a directory: delete"):
        StageCache(tmp_path).get("a", (), Counter(1))


def test_a_stage_cut_short_is_run_again(tmp_path):
    stages = {"a": Counter(list(range(100))), "b": Counter(2)}
    run(tmp_path, stages)
    damaged = next(p for p in tmp_path.iterdir() if p.name.startswith("a-"))
    whole = damaged.read_bytes()
    for broken in (whole[:-1], whole[:40], b"", whole[:50] + b"x" + whole[51:]):
        damaged.write_bytes(broken)
        assert run(tmp_path, stages) == {"a": False, "b": True}
        assert damaged.read_bytes() == whole


def test_results_of_stages_come_back_as_they_were(tmp_path):
    camera = Camera("PINHOLE", 4, 3, (5.0, 5.0, 2.0, 1.5))
    cloud = Cloud(np.arange(6.0).reshape(2, 3), np.eye(3)[:2], np.ones((2, 3), np.uint8))
    capture = Capture("c", (View("v", Path("v.jpg"), camera, np.eye(4)),), cloud, Scale(millimetres_per_unit=1000))
    hole = Polygon([(0, 0), (9, 0), (9, 9)], [[(5, 1), (6, 2), (6, 1)]])
    idx = np.arange(2)
    sheet = Sheet("s", np.eye(4), Quantity(value=18), True, hole, idx, idx, idx)
    plane = Primitive(np.eye(3)[0], 1.0, idx, np.zeros(3), 0.1)
    parts = Parts((sheet,), (plane,), 0.1, notes=("a note",), selection={"gap": np.float64(0)})
    stages = {"capture": Counter(capture), "identify": Counter(parts)}
    run(tmp_path, stages)
    again = StageCache(tmp_path, lambda: "b")
    back = again.get("capture", ("path",), stages["capture"])[0]
    found = again.get("identify", ("capture",), stages["identify"])[0]
    assert [s.runs for s in stages.values()] == [1, 1]
    assert (back.cloud.points == cloud.points).all() and back.cloud.colours.dtype == np.uint8
    assert back.views[0].camera == camera and back.views[0].path == Path("v.jpg") and back.scale == capture.scale
    assert found.sheets[0].region.equals_exact(hole, 0) and found.sheets[0].thickness == sheet.thickness
    assert (found.primitives[0].point_idx == idx).all() and found.selection == {"gap": 0}


def test_provenance_is_pickled_by_value_on_every_python():
    assert all(origin.__reduce_ex__(5) == (Origin, (origin.value,)) for origin in Origin)


@pytest.mark.parametrize("what", [os.system, subprocess.Popen, eval, os.unlink])
def test_a_stranger_s_cache_cannot_run_anything(tmp_path, what):
    class Evil:
        def __reduce__(self):
            return what, ("true",)

    run(tmp_path, {"a": Counter(1)})
    entry = next(iter(tmp_path.iterdir()))
    body = pickle.dumps(Evil(), 5)
    entry.write_bytes(cache_module.hashlib.sha256(body).digest() + body)
    with pytest.raises(OutputError, match="delete the folder"):
        run(tmp_path, {"a": Counter(1)})


def test_only_classes_of_ours_can_be_named():
    body = b"\x80\x05\x8c\x14kerfwright.supervise\x8c\x0asupervised\x93."
    with pytest.raises(OutputError, match="supervised"):
        cache_module._Unpickler(cache_module.io.BytesIO(body)).load()


def test_a_full_disk_is_a_clear_error_and_leaves_no_half_result(tmp_path, monkeypatch):
    def full(path, data):
        path.open("wb").write(data[:10])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match=r"No space left.*free some space"):
        run(tmp_path, {"a": Counter(1)})
    assert list(tmp_path.iterdir()) == []


def test_without_a_folder_nothing_is_kept():
    stage = Counter(1)
    assert StageCache(None).get("a", ("path",), stage) == (1, False)


def test_folder_hash_sees_content_names_and_nothing_else(tmp_path):
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "a.jpg").write_bytes(b"a")
    first = folder_hash(tmp_path)
    os.utime(tmp_path / "images" / "a.jpg", (1, 1))
    (tmp_path / ".DS_Store").write_bytes(b"x")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "model.json").write_bytes(b"x")
    assert folder_hash(tmp_path, leave_out=tmp_path / "out") == first
    seen = {first, folder_hash(tmp_path)}
    (tmp_path / "out" / "model.json").unlink()
    (tmp_path / "images" / "a.jpg").write_bytes(b"b")
    seen.add(folder_hash(tmp_path))
    (tmp_path / "images" / "a.jpg").rename(tmp_path / "images" / "b.jpg")
    seen.add(folder_hash(tmp_path))
    assert len(seen) == 4


def test_the_program_s_hash_is_the_same_in_every_process():
    script = "from kerfwright.cache import program_hash; print(program_hash())"
    seeded = os.environ | {"PYTHONHASHSEED": "7"}
    other = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=seeded)
    assert other.stdout.strip() == program_hash()


@pytest.mark.parametrize("data", [b"", b"\x00", b"\x80\x05\x95", b"\x80\x05Q.", pickle.dumps([1])[:-1]])
def test_a_kept_result_that_is_no_pickle_is_told(tmp_path, data):
    """With the right hash, as somebody may make it: unpickling raises whatever it likes."""
    (tmp_path / "capture-0").write_bytes(hashlib.sha256(data).digest() + data)
    with pytest.raises(OutputError, match=r"cache: \w+: not what kerfwright keeps there"):
        read_kept(tmp_path, "capture")


def test_names_in_a_stranger_s_cache_are_told_in_one_line(tmp_path):
    data = b"cnumpy\ndt\rpe\n."
    (tmp_path / "capture-0").write_bytes(hashlib.sha256(data).digest() + data)
    with pytest.raises(OutputError) as caught:
        read_kept(tmp_path, "capture")
    assert str(caught.value).isprintable()


def forged(callable_, arguments, state):
    """A pickle of what the callable makes, with another state."""

    class Forged:
        def __reduce__(self):
            return callable_, arguments, state

    return pickle.dumps(Forged(), protocol=5)


@pytest.mark.parametrize(
    ("thing", "arguments", "state"),
    [
        (np.dtype, ("f8", False, True), (3, "N", None, -1, -1, 0)),  # NumPy reads past the end of it: SIGSEGV
        (np.dtype, ("f8", False, True), (3, "<", None, None, None, 1 << 40, 1, 0)),
        (np.dtype, ("V8", False, True), (3, "|", None, ("a",), {"a": (np.dtype("f8"), 1 << 40)}, 8, 1, 0)),
        (Camera, ("PINHOLE", 4, 3, (5.0, 5.0, 2.0, 1.5)), None),
        (frozenset, ((),), {"a": 1}),
    ],
)
def test_states_that_are_not_those_of_plain_things_are_refused(tmp_path, thing, arguments, state):
    data = forged(thing, arguments, state)
    (tmp_path / "capture-0").write_bytes(hashlib.sha256(data).digest() + data)
    if state is None:
        assert read_kept(tmp_path, "capture").model == "PINHOLE", "without a state it is a plain thing"
        return
    with pytest.raises(OutputError, match="not what kerfwright keeps there"):
        read_kept(tmp_path, "capture")


def test_functions_are_given_no_state():
    body = b"cnumpy._core.numeric\n_frombuffer\n}S'__doc__'\nS'x'\nsb."
    with pytest.raises(OutputError, match="function: not what"):
        cache_module._Unpickler(cache_module.io.BytesIO(body)).load()


@pytest.mark.parametrize("kind", ["<f8", "<i8", "<i4", "|u1", "|b1", "<U3", "|S2"])
def test_arrays_of_plain_things_are_kept(tmp_path, kind):
    """Also those that are not in one piece, of which NumPy writes another pickle."""
    whole = np.arange(12).reshape(3, 4).astype(kind)
    stage = Counter([whole, whole[:, ::2], whole[:0], whole[0, 0]])
    run(tmp_path, {"a": stage})
    back = StageCache(tmp_path, lambda: "b").get("a", ("path",), stage)[0]
    assert stage.runs == 1 and all(np.array_equal(a, b) for a, b in zip(back, stage.result, strict=True))
    assert [b.dtype.str for b in back[:3]] == [kind] * 3 and isinstance(back[3], np.generic)
