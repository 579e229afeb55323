"""Run `kerfwright reconstruct` on a capture and read what it says of itself."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

__all__ = ["Run", "captures_in", "reconstruct"]

COMMAND = (sys.executable, "-m", "kerfwright", "reconstruct")


@dataclass(frozen=True)
class Run:
    """One run: exit code, wall seconds, also a stage, peak memory in GiB, last line said, seconds of all cores."""

    code: int
    seconds: float
    stages: dict[str, float] = field(default_factory=dict)
    peak_gib: float | None = None
    last_line: str = ""
    cpu: dict[str, float] = field(default_factory=dict)


def captures_in(paths: Sequence[Path]) -> Iterator[Path]:
    """The captures with truth among the folders given and the folders in them."""
    for path in paths:
        found = [path] if (path / "truth").is_dir() else sorted(p for p in path.iterdir() if (p / "truth").is_dir())
        if not found:
            raise SystemExit(f"{path}: truth: none in it or in its folders: name captures that have one")
        yield from found


def reconstruct(capture: Path, out: Path, extra: Sequence[str] = (), reuse: bool = False) -> Run:
    """Run the program, or read the last run where `reuse` allows it and the results are there."""
    if reuse and (out / "run.json").exists():
        return _read(out, 0, 0.0, "")
    out.parent.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    done = subprocess.run([*COMMAND, str(capture), "-o", str(out), *extra], capture_output=True, text=True, check=False)
    lines = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
    return _read(out, done.returncode, time.monotonic() - start, lines[-1] if lines else "")


def _read(out: Path, code: int, seconds: float, last_line: str) -> Run:
    path = out / "run.json"
    if not path.exists():
        return Run(code, seconds, last_line=last_line)
    record = json.loads(path.read_text())
    stages, cpu = record["seconds"], record.get("cpu_seconds", {})
    return Run(code, seconds or sum(stages.values()), stages, record["peak_memory_gib"], last_line, cpu)
