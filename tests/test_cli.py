"""The command line as a user meets it, in a process of its own; the stages are replaced by quick ones."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kerfwright import __version__

# Stages that do nothing but what `action` says, and an empty model.
FAKE = """
import ctypes, sys, time
from kerfwright import pipeline, results
from kerfwright.cli import main
from kerfwright.errors import CaptureError
from kerfwright.model import Finding, Model

def act(path, options):
    {action}

def final(*_):
    return Model(name="stool", findings={findings})

def written(found, folder):
    (folder / "model.json").write_text(found.model.model_dump_json())

pipeline.STAGES = (
    pipeline.Stage("capture", "Reading", ("path",), act),
    pipeline.Stage("identify", "Finding", (), lambda options: None),
    pipeline.Stage("check", "Checking", (), final),
)
results.write_results = written
main()
"""
ERROR = "(Finding(code='K100', severity='error', message='two boards overlap', remedy='move one', boards=('a', 'b')),)"


def fake(*arguments, action: str = "pass", findings: str = "()") -> list[str]:
    return [sys.executable, "-c", FAKE.format(action=action, findings=findings), *map(str, arguments)]


def run(command: list, **options) -> subprocess.CompletedProcess:
    return subprocess.run(command, capture_output=True, text=True, timeout=60, **options)


def kerfwright(*arguments, **options) -> subprocess.CompletedProcess:
    return run([sys.executable, "-m", "kerfwright", *map(str, arguments)], **options)


@pytest.mark.parametrize("flag", ["-V", "--version"])
def test_version(flag):
    assert kerfwright(flag).stdout == f"kerfwright {__version__}\n"


def test_version_works_when_a_dependency_is_broken(tmp_path):
    for name in ("typer", "rich", "numpy", "pydantic"):
        (tmp_path / f"{name}.py").write_text("raise ImportError('broken')")
    assert kerfwright("-V", env={**os.environ, "PYTHONPATH": str(tmp_path)}).returncode == 0


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], [], ["reconstruct", "-h"], ["export", "--help"]])
def test_help_imports_nothing_heavy(arguments):
    script = (
        "import atexit, sys\n"
        "heavy = {'numpy', 'scipy', 'cv2', 'open3d', 'OCP', 'build123d', 'casadi', 'numba', 'shapely'}\n"
        "atexit.register(lambda: print('heavy:', sorted(heavy & set(sys.modules)), file=sys.stderr))\n"
        "from kerfwright.cli import main\nmain()"
    )
    done = run([sys.executable, "-c", script, *arguments])
    assert done.returncode == 0 and "Usage" in done.stdout
    assert done.stderr == "heavy: []\n"


@pytest.mark.parametrize(("arguments", "words"), [
    (["nonsense"], ["No such command 'nonsense'", "kerfwright --help"]),
    (["reconstruct"], ["CAPTURE", "kerfwright reconstruct --help"]),
    (["reconstruct", "here"], ["--out"]),
    (["reconstruct", "here", "-o", "out", "--seed", "x"], ["--seed"]),
    (["reconstruct", "here", "-o", "out", "--up", "w"], ["--up: w", "-x, -y, -z"]),
    (["reconstruct", "here", "-o", "out", "--scale", "-5"], ["--scale: -5", "millimetres"]),
    (["reconstruct", "here", "-o", "out", "--scale", "nan"], ["--scale: nan"]),
])
def test_wrong_arguments_are_one_line_and_exit_code_2(arguments, words, tmp_path):
    done = kerfwright(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == "" and done.stderr.startswith("kerfwright: error: ") and done.stderr.count("\n") == 1
    assert all(word in done.stderr for word in words), done.stderr
    assert list(tmp_path.iterdir()) == []


def test_reconstruct_writes_and_tells(tmp_path):
    done = run(fake("reconstruct", tmp_path / "capture", "-o", tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert str(tmp_path / "out") in done.stdout
    steps = [line.split()[:2] for line in done.stderr.splitlines()]
    assert steps == [["1/4", "Reading"], ["2/4", "Finding"], ["3/4", "Checking"], ["4/4", "Writing"]]
    assert sorted(os.listdir(tmp_path / "out")) == [".cache", ".kerfwright.json", "model.json", "run.json"]
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert list(record["seconds"]) == ["capture", "identify", "check", "write"]
    assert 0.01 < record["peak_memory_gib"] < 1
    assert record["kerfwright"] == __version__ and "numpy" in record["versions"]


def test_quiet_and_json(tmp_path):
    done = run(fake("reconstruct", "c", "-o", tmp_path / "out", "--quiet"))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    done = run(fake("reconstruct", "c", "-o", tmp_path / "out", "--json"))
    events = [json.loads(line) for line in done.stdout.splitlines()]
    assert [e["stage"] for e in events if e["event"] == "finished"] == ["capture", "identify", "check", "write"]


def test_what_the_checker_forbids_is_written_but_exits_with_1(tmp_path):
    done = run(fake("reconstruct", "c", "-o", tmp_path / "out", "-q", findings=ERROR))
    assert done.returncode == 1 and done.stderr == "kerfwright: K100: two boards overlap: move one\n"
    assert (tmp_path / "out" / "model.json").exists()


def test_bad_input_is_one_line_and_makes_no_folder(tmp_path):
    action = 'raise CaptureError(f"{path}/cloud.ply: vertex count:\\n3: give it more")'
    done = run(fake("reconstruct", "c", "-o", tmp_path / "a" / "out", action=action))
    assert done.returncode == 2
    assert done.stderr == "kerfwright: error: c/cloud.ply: vertex count: 3: give it more\n"
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_other_files_is_refused_before_any_work(tmp_path):
    (tmp_path / "holiday.jpg").write_text("x")
    done = run(fake("reconstruct", "c", "-o", tmp_path, action="print('worked')"))
    assert done.returncode == 2 and "holiday.jpg" in done.stderr and "worked" not in done.stdout
    assert sorted(os.listdir(tmp_path)) == ["holiday.jpg"]


def test_our_own_failure_shows_where_and_asks_for_a_report(tmp_path):
    done = run(fake("reconstruct", "c", "-o", tmp_path / "out", action="raise KeyError('oops')"))
    assert done.returncode == 1
    assert "Traceback" in done.stderr and "report" in done.stderr.splitlines()[-1] and not (tmp_path / "out").exists()


def test_a_library_that_crashes_is_said(tmp_path):
    action = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
    done = run(fake("reconstruct", "c", "-o", tmp_path / "out", action=action))
    assert done.returncode == 128 + signal.SIGSEGV and "SIGSEGV" in done.stderr and not (tmp_path / "out").exists()


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_ends_it_at_once_and_keeps_the_old_results(tmp_path, number, code):
    out = tmp_path / "out"
    run(fake("reconstruct", "c", "-o", out), check=True)
    before = {p: p.read_bytes() for p in out.iterdir() if p.is_file()}
    stuck = "print('stuck', flush=True); ctypes.PyDLL(None).sleep(30)"
    process = subprocess.Popen(
        fake("reconstruct", "c", "-o", out, "--seed", 1, action=stuck), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
    )
    assert process.stdout.readline() == "stuck\n"
    began = time.monotonic()
    os.killpg(process.pid, number)
    _, errors = process.communicate(timeout=5)
    assert time.monotonic() - began < 3 and process.returncode == code
    assert errors.startswith("kerfwright: interrupted") and errors.count("\n") == 1
    assert {p: p.read_bytes() for p in out.iterdir() if p.is_file()} == before


def test_a_terminal_gets_its_cursor_back_after_ctrl_c(tmp_path):
    leader, follower = pty.openpty()
    stuck = "print('stuck', flush=True); ctypes.PyDLL(None).sleep(30)"
    process = subprocess.Popen(
        fake("reconstruct", "c", "-o", tmp_path / "out", action=stuck), stdout=subprocess.PIPE, stderr=follower,
        text=True, start_new_session=True, env={**os.environ, "TERM": "xterm"},
    )
    assert process.stdout.readline() == "stuck\n"
    os.killpg(process.pid, signal.SIGINT)
    process.wait(5)
    os.close(follower)
    shown = os.read(leader, 10000).decode()
    assert shown.rindex("\x1b[?25h") > shown.rindex("\x1b[?25l") and not (tmp_path / "out").exists()


def test_the_same_bytes_but_for_run_json(tmp_path):
    for name in ("one", "two"):
        run(fake("reconstruct", "c", "-o", tmp_path / name), check=True)
    for path in sorted((tmp_path / "one").iterdir()):
        if path.is_file() and path.name != "run.json":
            assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes(), path.name


def test_the_demo_finds_its_capture():
    from kerfwright.demo import demo_capture

    assert len(list((demo_capture() / "images").iterdir())) == 20


def test_the_shipped_capture_is_as_small_as_promised():
    from kerfwright.demo import demo_capture

    files = [p for p in Path(demo_capture()).rglob("*") if p.is_file()]
    assert sum(p.stat().st_size for p in files) < 8e6
    header = (demo_capture() / "cloud.ply").read_bytes()[:400].decode("latin-1")
    assert "element vertex 120000" in header


# Three stages that tell when they run; the process is killed in stage `dies`, or in mid-write.
RESUMING = """
import os, sys
from pathlib import Path
from kerfwright import pipeline, results
from kerfwright.cli import main
from kerfwright.model import Model
dies, log = sys.argv.pop(1), Path(sys.argv.pop(1))

def stage(name, needs):
    def run(*arguments):
        with log.open("a") as lines:
            lines.write(name + " ")
        if name == dies:
            os.kill(os.getppid() if len(arguments) % 2 else os.getpid(), 9)  # now the parent, now the child
            import time; time.sleep(5)
        return Model(name=name) if name == "check" else name
    return pipeline.Stage(name, name, needs, run)

def written(found, folder):
    (folder / "model.json").write_text(found.model.model_dump_json())
    if dies == "write":
        os.kill(os.getppid(), 9)
        import time; time.sleep(5)

NEEDS = {"capture": ("path",), "identify": ("capture",), "check": ("identify", "capture")}
pipeline.STAGES = tuple(stage(name, needs) for name, needs in NEEDS.items())
results.write_results = written
main()
"""


@pytest.mark.parametrize(("dies", "again"), [
    ("capture", "capture identify check"), ("identify", "identify check"), ("check", "check"), ("write", ""),
])
def test_killed_and_run_again_it_goes_on_and_gives_the_same_files(tmp_path, dies, again):
    log = tmp_path / "log"

    def reconstruct(out: str, dies: str) -> subprocess.CompletedProcess:
        log.write_text("")
        arguments = ["reconstruct", tmp_path / "c", "-o", tmp_path / out, "-q"]
        return run([sys.executable, "-c", RESUMING, dies, log, *arguments])

    (tmp_path / "c").mkdir()
    assert reconstruct("straight", "never").returncode == 0
    assert reconstruct("resumed", dies).returncode in (-9, 137)
    assert reconstruct("resumed", "never").returncode == 0
    assert log.read_text().strip() == again
    for name in ("model.json", ".kerfwright.json"):
        assert (tmp_path / "resumed" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()
    assert sorted(os.listdir(tmp_path / "resumed")) == sorted(os.listdir(tmp_path / "straight"))
    kept = json.loads((tmp_path / "resumed" / "run.json").read_text())["cached"]
    assert kept == [s for s in ("capture", "identify", "check") if s not in again]


def test_a_second_run_on_the_same_folder_is_refused(tmp_path):
    stuck = "print('stuck', flush=True); time.sleep(30)"
    first = subprocess.Popen(
        fake("reconstruct", "c", "-o", tmp_path / "out", action=stuck), stdout=subprocess.PIPE, text=True
    )
    assert first.stdout.readline() == "stuck\n"
    second = run(fake("reconstruct", "c", "-o", tmp_path / "out"))
    first.terminate()
    first.wait(5)
    assert second.returncode == 2 and f"process {first.pid} is writing" in second.stderr
    assert run(fake("reconstruct", "c", "-o", tmp_path / "out")).returncode == 0, "the lock goes with its holder"


def test_jobs_bounds_the_cores(tmp_path):
    action = "import os; print('cores', len(os.sched_getaffinity(0)), os.environ.get('OMP_NUM_THREADS'))"
    done = run(fake("reconstruct", "c", "-o", tmp_path / "out", "-q", "-j", 1, action=action))
    assert done.stdout == "cores 1 1\n", done.stderr
