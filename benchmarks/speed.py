#!/usr/bin/env python3
"""Speed board: seconds a stage, peak memory, and how both grow with the size of what is given. See README.md."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from accuracy import RECORDS
from runs import Run, reconstruct
from tables import markdown
from variants import with_images, with_pixels, with_points

from kerfwright.synthetic import CaptureOptions, CloudOptions, DatasetOptions, random_assembly, write_capture

POINTS = (50_000, 100_000, 300_000, 1_000_000, 2_000_000)
IMAGES = (9, 18, 36)
FACTORS = (0.25, 0.5, 1.0)
BOARDS = (4, 8, 16, 32, 60)
CABINET = CaptureOptions(
    dataset=DatasetOptions(images=24, width=800, height=600), cloud=CloudOptions(points=200_000)
)  # fmt: skip
STAGES = ("capture", "planes", "identify", "assemble", "refine", "check")
NOISE = 0.2  # seconds below which a stage's growth is not worth a number


def cabinet(folder: Path, boards: int) -> Path:
    """A cabinet of so many boards; made once."""
    if not folder.exists():
        write_capture(random_assembly("cabinet", 1, boards), folder, CABINET.seeded(boards))
    return folder


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float | None:
    """k of seconds = c size^k by least squares of logarithms; None for what is too quick to time."""
    pairs = [(n, s) for n, s in zip(sizes, seconds, strict=True) if s > 0]
    if len(pairs) < 2 or max(s for _, s in pairs) < NOISE:
        return None
    logs = np.log(np.array(pairs, float))
    return float(np.polyfit(logs[:, 0], logs[:, 1], 1)[0])


def of_cores(run: Run) -> Run:
    """The run with the seconds that the cores worked instead of those that passed."""
    return replace(run, seconds=sum(run.cpu.values()), stages=run.cpu)


def _remark(run: Run) -> str:
    """Why a run has no results; exit code 1 beside results is for findings that forbid cutting."""
    if run.stages:
        return "errors found" if run.code == 1 else ""
    return f"exit {run.code}: {run.last_line[-60:]}"


def series(title: str, sizes: Sequence[float], runs: Sequence[Run]) -> str:
    """One table: a line a size, and the exponents under it; runs that failed are shown and not fitted."""
    rows = [
        [
            f"{size:g}",
            *(f"{run.stages[s]:.2f}" if s in run.stages else "-" for s in STAGES),
            f"{run.seconds:.1f}",
            "-" if run.peak_gib is None else f"{run.peak_gib:.2f}",
            _remark(run),
        ]
        for size, run in zip(sizes, runs, strict=True)
    ]
    whole = [(n, r) for n, r in zip(sizes, runs, strict=True) if all(s in r.stages for s in STAGES)]
    n = [size for size, _ in whole]
    fits = [exponent(n, [r.stages[s] for _, r in whole]) for s in STAGES]
    fits += [exponent(n, [r.seconds for _, r in whole]), exponent(n, [r.peak_gib or 0 for _, r in whole])]
    rows.append(["growth exponent", *("-" if k is None else f"{k:.2f}" for k in fits), ""])
    return f"## {title}\n\n" + markdown((title.lower(), *(f"{s} s" for s in STAGES), "all s", "GiB", ""), rows)


def main() -> None:
    """Run all series, or those named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("capture", type=Path, help="to be thinned")
    parser.add_argument("--out", type=Path, required=True, help="variants and results; variants are kept")
    parser.add_argument("--only", nargs="*", choices=("points", "images", "pixels", "boards"))
    parser.add_argument("--cpu", action="store_true", help="seconds of all cores together, for a busy machine")
    parser.add_argument("--record", action="store_true", help="write docs/benchmarks/speed.md and .json")
    o = parser.parse_args()
    make = o.out / "captures"
    all_series = {
        "points": ("Points", POINTS, lambda n: with_points(o.capture, make / f"points_{n}", n)),
        "images": ("Photographs", IMAGES, lambda n: with_images(o.capture, make / f"images_{n}", n)),
        "pixels": ("Pixels along a side, relative", FACTORS, lambda f: with_pixels(o.capture, make / f"pixels_{f}", f)),
        "boards": ("Boards", BOARDS, lambda n: cabinet(make / f"cabinet_{n}", n)),
    }
    parts, record = (
        [f"# Speed\n\nSeconds and peak memory on {o.capture.name} and its variants, one machine, one run.\n"],
        {},
    )
    for key, (title, sizes, variant) in all_series.items():
        if not o.only or key in o.only:
            runs = [reconstruct(variant(n), o.out / "results" / f"{key}_{n:g}") for n in sizes]
            parts.append(series(title, sizes, [of_cores(run) for run in runs] if o.cpu else runs))
            record[key] = [{"size": n, **asdict(r)} for n, r in zip(sizes, runs, strict=True)]
    print(page := "\n".join(parts))
    if o.record:
        RECORDS.mkdir(parents=True, exist_ok=True)
        (RECORDS / "speed.md").write_text(page)
        (RECORDS / "speed.json").write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
