#!/usr/bin/env python3
"""How identification's time and memory grow: with points of a capture, and with boards of cabinets. See README.md."""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from speed import BOARDS, POINTS, exponent
from tables import markdown
from variants import with_points

from kerfwright.capture import Capture
from kerfwright.synthetic import CaptureOptions, CloudOptions, DatasetOptions, in_memory, random_assembly

# Clouds alone, with so many points a board that small boards are seen as well in large cabinets as in small ones.
CABINET_POINTS, CABINET_POINTS_A_BOARD = 100_000, 8_000
PHASES = ("neighbours", "planes", "candidates", "evidence", "selection", "whole")


def cabinet(boards: int) -> Capture:
    """The cloud of a cabinet of so many boards."""
    cloud = CloudOptions(points=CABINET_POINTS + CABINET_POINTS_A_BOARD * boards)
    options = CaptureOptions(dataset=DatasetOptions(images=24, width=800, height=600), cloud=cloud)
    return in_memory(random_assembly("cabinet", 1, boards), options.seeded(boards), photographed=False)


def thinned(folder: Path) -> Capture:
    """A capture as the pipeline prepares it."""
    from kerfwright.pipeline import STAGES, ReconstructOptions

    return STAGES[0].run(folder, ReconstructOptions())


def measured(capture: Capture) -> dict[str, Any]:
    """CPU seconds a phase; wall seconds; peak memory of this process so far, GiB."""
    import kerfwright.identify as stage
    from kerfwright.identify import IdentifyOptions, primitives, selection, slabs, whole

    seconds: dict[str, float] = {}
    for module, name, phase in (
        (primitives, "look_around", "neighbours"), (primitives, "find_planes", "planes"),
        (slabs, "candidate_slabs", "candidates"), (selection, "gather_evidence", "evidence"),
        (stage, "choose", "selection"), (whole, "whole_boards", "whole"),
    ):  # fmt: skip
        setattr(module, name, timed(getattr(module, name), seconds, phase))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start, spent = time.monotonic(), time.process_time()
    parts = stage.identify(capture, IdentifyOptions())
    return {
        "points": len(capture.cloud), "seconds": seconds, "cpu": time.process_time() - spent,
        "wall": time.monotonic() - start, "before_gib": before / 2**20,
        "peak_gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, "planes": len(parts.primitives),
        "candidates": parts.selection["candidates"], "boards": len(parts.sheets),
    }  # fmt: skip


def timed(function: Callable[..., Any], seconds: dict[str, float], phase: str) -> Callable[..., Any]:
    """The function, its CPU seconds noted."""

    def run(*args, **kwargs):
        start = time.process_time()
        result = function(*args, **kwargs)
        seconds[phase] = time.process_time() - start
        return result

    return run


def table(title: str, sizes: Sequence[float], runs: Sequence[dict[str, Any]]) -> str:
    """A line a size, and the growth exponents of CPU seconds under it."""
    header = (title, "points", *(f"{p} s" for p in PHASES), "all CPU s", "wall s", "GiB (before)", "planes",
              "candidates", "boards")  # fmt: skip
    rows = [
        [
            f"{size:g}", str(r["points"]), *(f"{r['seconds'][p]:.2f}" for p in PHASES), f"{r['cpu']:.1f}",
            f"{r['wall']:.1f}", f"{r['peak_gib']:.2f} ({r['before_gib']:.2f})", str(r["planes"]), str(r["candidates"]),
            str(r["boards"]),
        ]
        for size, r in zip(sizes, runs, strict=True)
    ]  # fmt: skip
    fits = [exponent(sizes, [r["seconds"][p] for r in runs]) for p in PHASES]
    fits.append(exponent(sizes, [r["cpu"] for r in runs]))
    rows.append(["growth exponent", "", *("-" if k is None else f"{k:.2f}" for k in fits), "", "", "", "", ""])
    return markdown(header, rows)


def one(kind: str, size: int, capture: Path, out: Path) -> None:
    """Measure one size in this process."""
    made = cabinet(size) if kind == "boards" else thinned(capture)
    out.write_text(json.dumps(measured(made)) + "\n")


def main() -> None:
    """Measure every size in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("capture", type=Path, help="to be thinned")
    parser.add_argument("--out", type=Path, required=True, help="variants and figures; variants are kept")
    parser.add_argument("--only", choices=("points", "boards"))
    parser.add_argument("--sizes", type=int, nargs="*", help="instead of the usual ones; needs --only")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)  # in the process of its own
    o = parser.parse_args()
    if o.one:
        return one(o.only, o.sizes[0], o.capture, o.out)
    o.out.mkdir(parents=True, exist_ok=True)
    for kind, usual in (("points", POINTS), ("boards", BOARDS)):
        if o.only in (None, kind):
            sizes = o.sizes or usual
            print(table(kind, sizes, [child(kind, size, o.capture, o.out) for size in sizes]), flush=True)
    return None


def child(kind: str, size: int, capture: Path, out: Path) -> dict[str, Any]:
    """Figures of one size."""
    source = with_points(capture, out / f"points_{size}", size) if kind == "points" else capture
    figures = out / f"{kind}_{size}.json"
    command = [sys.executable, __file__, str(source), "--one", "--only", kind, "--sizes", str(size)]
    subprocess.run([*command, "--out", str(figures)], check=True)
    return json.loads(figures.read_text())


if __name__ == "__main__":
    main()
