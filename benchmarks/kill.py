"""Kill a reconstruction with SIGKILL at random times, run it again, and compare with a run that nobody disturbed.

The first half of the kills falls on fresh runs, one in each of as many equal parts of a whole run's time; the second
half on runs that find all stages kept, so that they fall on the writing. Only the process that a user would kill is
killed; its child has to die by itself.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from runs import COMMAND
from tables import markdown

HEADER = [
    "killed after, s", "of", "stages kept by then", "found half done", "again, s", "left behind", "files that differ",
]  # fmt: skip
HALF_DONE = (".partial", ".ready", ".lock")


@dataclass(frozen=True)
class Bench:
    """What every run has in common."""

    capture: Path
    out: Path

    def start(self, folder: Path) -> subprocess.Popen:
        return subprocess.Popen(
            [*COMMAND, str(self.capture), "-o", str(folder), "-q"],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True,
        )

    def run(self, folder: Path) -> float:
        """Run to the end; seconds."""
        begin = time.monotonic()
        process = self.start(folder)
        said = process.communicate()[1]
        if process.returncode:
            raise SystemExit(f"{folder}: exit code {process.returncode}: {said}")
        return time.monotonic() - begin

    def kill_one(self, folder: Path, after: float, whole: float, wanted: dict[str, str]) -> list[str]:
        """Kill one run, run it again, and say what came of it: a row of the table."""
        process = self.start(folder)
        time.sleep(after)
        ended = process.poll() is not None
        process.send_signal(signal.SIGKILL)
        process.wait()
        _wait_for_group(process.pid)
        kept, half = _kept(folder), _half_done(folder)
        seconds = self.run(folder)
        differ = _differences(_digests(folder), wanted)
        return [
            f"{after:.2f}" + (" (had ended)" if ended else ""), f"{whole:.1f}", kept, ", ".join(half) or "-",
            f"{seconds:.1f}", ", ".join(_half_done(folder)) or "-", ", ".join(differ) or "0",
        ]  # fmt: skip


def _wait_for_group(group: int, patience: float = 5.0) -> None:
    """The child has to die with its parent; SystemExit when it does not."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return
        time.sleep(0.01)
    raise SystemExit(f"process group {group}: alive {patience:g} s after its leader was killed")


def _kept(folder: Path) -> str:
    order = ("capture", "planes", "identify", "assemble", "refine", "check")
    there = {p.name.rsplit("-", 1)[0] for p in (folder / ".cache").glob("*-*") if p.suffix != ".partial"}
    return ", ".join(name for name in order if name in there) or "-"


def _half_done(folder: Path) -> list[str]:
    """What no finished run has: folders and files in the making."""
    cached = [p.name for p in (folder / ".cache").glob("*.partial")]
    parts = [p.name for p in folder.rglob("*.part")]
    return [name for name in HALF_DONE if (folder / name).exists()] + sorted({*cached, *parts})


def _digests(folder: Path) -> dict[str, str]:
    """Files by name, and the hash of their bytes; run.json, which has times, and the cache apart."""
    files = [p for p in sorted(folder.rglob("*")) if p.is_file() and ".cache" not in p.parts and p.name != "run.json"]
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def _differences(found: dict[str, str], wanted: dict[str, str]) -> list[str]:
    return sorted(name for name in found.keys() | wanted.keys() if found.get(name) != wanted.get(name))


def _only_cache(source: Path, folder: Path) -> None:
    """A folder in which all stages are kept and nothing is written yet."""
    folder.mkdir(parents=True)
    shutil.copytree(source / ".cache", folder / ".cache")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--kills", type=int, default=16)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    shutil.rmtree(given.out / "kill", ignore_errors=True)
    bench, chance = Bench(given.capture.resolve(), given.out / "kill"), random.Random(given.seed)
    straight = bench.out / "straight"
    bench.run(straight)  # the first run of an installation compiles
    shutil.rmtree(straight)
    whole = bench.run(straight)
    wanted = _digests(straight)
    rows, fresh = [], given.kills // 2
    for k in range(fresh):
        rows.append(bench.kill_one(bench.out / f"fresh_{k}", whole * (k + chance.random()) / fresh, whole, wanted))
        print(rows[-1], flush=True)
        shutil.rmtree(bench.out / f"fresh_{k}")
    _only_cache(straight, bench.out / "kept")
    short = bench.run(bench.out / "kept")
    for k in range(given.kills - fresh):
        folder = bench.out / f"kept_{k}"
        _only_cache(straight, folder)
        after = short * (k + chance.random()) / (given.kills - fresh)
        rows.append(bench.kill_one(folder, after, short, wanted))
        print(rows[-1], flush=True)
        shutil.rmtree(folder)
    table = markdown(HEADER, rows)
    (given.out / "kill.md").write_text(table)
    (given.out / "kill.json").write_text(json.dumps({"seconds": whole, "files": len(wanted), "rows": rows}, indent=1))
    print(f"{len(wanted)} files compared\n\n{table}")
    if any(row[-1] != "0" or row[-2] != "-" for row in rows):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
