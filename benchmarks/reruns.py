"""Run again after a change, with fewer cores and other hashes, two at once, on a full disk.

Every result is compared with that of a fresh run of the same capture and options, run.json apart, which has times. Full
disks are small file systems in memory, which only root can mount.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from kill import _differences, _digests, _half_done
from runs import COMMAND
from tables import markdown

RERUNS = ("what changed", "stages run again", "s", "fresh, s", "files that differ from a fresh run's")
AS_BEFORE = ("nothing", "a note beside", "a photograph without camera")  # these have the first run's results
DISKS = ("size, KiB", "exit code", "said", "left there")


def run(capture: Path, out: Path, extra: Sequence[str] = (), **variables: str) -> tuple[float, str]:
    """Seconds of a run, and the stages that were not kept."""
    begin = time.monotonic()
    command = [*COMMAND, str(capture), "-o", str(out), "-q", *extra]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | variables)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: exit code {done.returncode}: {done.stderr}")
    record = json.loads((out / "run.json").read_text())
    again = [name for name in record["seconds"] if name not in (*record["cached"], "write")]
    return time.monotonic() - begin, ", ".join(again) or "none"


def changes(capture: Path) -> dict[str, tuple[Callable[[], object], list[str]]]:
    """What is done to the capture, and the options of the run; each comes on top of those before."""
    photographs, poses = capture / "images", capture / "sparse" / "0" / "images.txt"
    whole, some = poses.read_text(), min(photographs.glob("*.jpg"))
    lines = whole.splitlines(keepends=True)
    first = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    poses.write_text("".join(lines[:first] + lines[first + 2 :]))  # a photograph whose camera comes later

    def nothing() -> None:
        pass

    return {
        "nothing": (nothing, []),
        "a note beside": (lambda: (capture / "notes.txt").write_text("walnut"), []),
        "a photograph without camera": (lambda: shutil.copy(some, photographs / "x.jpg"), []),
        "--scale 1003": (nothing, ["--scale", "1003"]),
        "--scale 1003 --stock 18,22": (nothing, ["--scale", "1003", "--stock", "18,22"]),
        "a photograph with its camera": (lambda: poses.write_text(whole), []),
    }


def reruns(capture: Path, work: Path) -> list[list[str]]:
    """Rows of the first table."""
    mine, out, rows = work / "capture", work / "again", []
    shutil.copytree(capture, mine)
    todo = changes(mine)
    fresh, _ = run(mine, out)
    wanted = _digests(out)
    for name, (change, extra) in todo.items():
        change()
        seconds, again = run(mine, out, extra)
        if name not in AS_BEFORE:
            fresh, _ = run(mine, work / "fresh", extra)
            wanted = _digests(work / "fresh")
            shutil.rmtree(work / "fresh")
        differ = _differences(_digests(out), wanted)
        rows.append([name, again, f"{seconds:.1f}", f"{fresh:.1f}", ", ".join(differ) or "0"])
        print(rows[-1], flush=True)
    for name, extra, seed in (("one core", ["--jobs", "1"], "0"), ("two, hash seed 12345", ["--jobs", "2"], "12345")):
        fresh, _ = run(mine, work / "steady", extra, PYTHONHASHSEED=seed)
        differ = _differences(_digests(work / "steady"), _digests(out))
        rows.append([name, "all", "-", f"{fresh:.1f}", ", ".join(differ) or "0"])
        print(rows[-1], flush=True)
        shutil.rmtree(work / "steady")
    return rows


def two_at_once(capture: Path, out: Path) -> str:
    """What the second of two runs on one folder says, and how both end."""
    command = [*COMMAND, str(capture), "-o", str(out), "-q"]
    first = subprocess.Popen(command)
    while not (out / ".lock").exists():
        time.sleep(0.01)
    second = subprocess.run(command, capture_output=True, text=True, check=False)
    return f"the second ended with {second.returncode}: {second.stderr.strip()}; the first ended with {first.wait()}"


def full_disks(capture: Path, work: Path, sizes: Sequence[int]) -> list[list[str]]:
    """Rows of the second table: a fresh run on a file system of so many KiB."""
    rows = []
    for size in sizes:
        disk = work / "disk"
        disk.mkdir(exist_ok=True)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", str(disk)], check=True)
        try:
            command = [*COMMAND, str(capture), "-o", str(disk / "out"), "-q"]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            left = sorted(p.relative_to(disk).as_posix() for p in disk.rglob("*") if p.is_file())
            half = _half_done(disk / "out") if (disk / "out").exists() else []
            told = " ".join(done.stderr.split()).replace(str(disk), "DISK")
            there = f"{len(left)} files, half done: {', '.join(half) or '-'}"
            rows.append([str(size), str(done.returncode), told, there])
            print(rows[-1], left[:8], flush=True)
        finally:
            subprocess.run(["umount", str(disk)], check=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--disks", type=int, nargs="*", default=[], help="sizes in KiB; needs root")
    parser.add_argument("--only-disks", action="store_true")
    given = parser.parse_args()
    capture, work = given.capture.resolve(), given.out / "reruns"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    text = ""
    if not given.only_disks:
        rows = reruns(capture, work)
        text = markdown(RERUNS, rows) + "\n" + two_at_once(capture, work / "two") + "\n\n"
    if given.disks:
        text += markdown(DISKS, full_disks(capture, work, given.disks))
    (given.out / "reruns.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
