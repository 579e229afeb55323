#!/usr/bin/env python3
"""Identification alone against the truth: boards, thicknesses, cost; the same with annealing. See README.md."""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from runs import captures_in
from tables import markdown

from kerfwright.errors import KerfwrightError

SEEDS = 3  # of the annealing
HEADER = (
    "capture", "boards", "extra", "thickness error mm: median", "worst seen", "candidates", "CPU s", "GiB",
    "annealing, total", "extra", "annealing, mean", "extra",
)  # fmt: skip
Figures = dict[str, Any]


def measured(path: Path) -> Figures:
    """Everything about one capture; to be run in a process of its own, for its peak memory."""
    from kerfwright.evaluate import read_truth
    from kerfwright.evaluate.score import boards_in_cloud
    from kerfwright.identify import IdentifyOptions, choose, find_candidates, made_whole
    from kerfwright.pipeline import STAGES, ReconstructOptions

    capture = STAGES[0].run(path, ReconstructOptions())
    options = IdentifyOptions()
    start, spent = time.monotonic(), time.process_time()
    candidates = find_candidates(capture, options)
    parts = made_whole(choose(candidates, options), candidates)
    took, spent = time.monotonic() - start, time.process_time() - spent
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    truth = read_truth(path / "truth")
    points, shown = boards_in_cloud(truth)
    cloud = {b.name: {"points": n, "seen": s} for b, n, s in zip(truth.boards, points, shown, strict=True)}
    out = {"seconds": took, "cpu_seconds": spent, "peak_gib": peak, "points": len(capture.cloud), "truth": cloud}
    out["exact"] = figures(parts, capture, truth)
    for energy in ("total", "mean"):
        walks = [replace(options, selection="annealing", annealing_energy=energy, seed=s) for s in range(SEEDS)]
        out[energy] = [figures(made_whole(choose(candidates, walk), candidates), capture, truth) for walk in walks]
    return out


def figures(parts, capture, truth) -> Figures:
    """What one selection gets."""
    from kerfwright.evaluate.rough import rough_figures
    from kerfwright.evaluate.stages import rough_model

    model = rough_model(capture.name, parts.sheets, capture)
    truth_from_model = np.linalg.inv(truth.capture_from_truth) @ np.array(model.capture_from_model)
    unit = float(np.cbrt(np.linalg.det(truth_from_model[:3, :3])))
    said = {
        s.name: {
            "origin": str(s.thickness.origin.value), "mm": unit * s.thickness.value,
            "standard_error": unit * (s.thickness.standard_error or 0.0),
        }
        for s in parts.sheets
    }  # fmt: skip
    return rough_figures(truth, model, truth_from_model) | {"said": said, "selection": parts.selection}


def found(score: Figures) -> int:
    """Boards found, where those glued edge to edge may be found as one."""
    as_one = {name for group in score["rough_as_one"] for name in group}
    return score["rough_found"] + len(as_one & set(score["rough_missing"]))


def row(name: str, m: Figures) -> list[str]:
    """One line of the table."""
    whole, exact = len(m["truth"]), m["exact"]
    errors = {board: abs(e) for board, e in exact["rough_thickness_mm"].items()}
    seen = [e for board, e in errors.items() if m["truth"][board]["seen"]]
    return [
        name, f"{found(exact)}/{whole}", str(len(exact["rough_extra"])),
        f"{statistics.median(errors.values()):.2f}" if errors else "-", f"{max(seen):.2f}" if seen else "-",
        str(exact["selection"]["candidates"]), f"{m['cpu_seconds']:.1f}", f"{m['peak_gib']:.2f}",
        *(cell for energy in ("total", "mean") for cell in walks(m[energy], whole)),
    ]  # fmt: skip


def walks(scores: Sequence[Figures], whole: int) -> tuple[str, str]:
    """Boards found and extra boards of annealing, over its seeds."""
    hits, extra = [found(s) for s in scores], [len(s["rough_extra"]) for s in scores]
    return f"{spread(hits)}/{whole}", spread(extra)


def spread(counts: Sequence[int]) -> str:
    """One number, or the least and the largest."""
    low, high = min(counts), max(counts)
    return str(low) if low == high else f"{low}-{high}"


def remarks(name: str, m: Figures) -> list[str]:
    """Boards not found or extra, and what was said of thicknesses that the cloud does not show."""
    exact, out = m["exact"], []
    for board in exact["rough_missing"]:
        out.append(f"- {name}: {board}: not found alone; {m['truth'][board]['points']} points in the cloud")
    out += [f"- {name}: as one board: {', '.join(group)}" for group in exact["rough_as_one"]]
    out += [f"- {name}: extra: {board}" for board in exact["rough_extra"]]
    for board, pair in exact["rough_pairs"].items():
        if not m["truth"][board]["seen"]:
            told, error = exact["said"][pair], exact["rough_thickness_mm"][board]
            out.append(
                f"- {name}: {board}: thickness not seen; said to be {told['origin']}, "
                f"{told['mm']:.2f} ± {told['standard_error']:.2f} mm, error {error:+.2f} mm"
            )
    return out


def page(results: dict[str, Figures]) -> str:
    """The table and what is to be said of single boards."""
    right = {name: m for name, m in results.items() if "exact" in m}
    told = [line for name, m in right.items() for line in remarks(name, m)]
    told += [f"- {name}: no figures: {m['error']}" for name, m in results.items() if "exact" not in m]
    errors = [abs(e) for m in right.values() for e in m["exact"]["rough_thickness_mm"].values()]
    whole = f"Median thickness error of all {len(errors)} boards: {statistics.median(errors):.2f} mm." if errors else ""
    return "\n".join([markdown(HEADER, [row(name, m) for name, m in right.items()]), whole, "", *told, ""])


def main() -> None:
    """Measure every capture in a process of its own; print the page and keep the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("captures", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True, help="a JSON file a capture")
    parser.add_argument("--reuse", action="store_true", help="keep figures that are there")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)  # in the process of its own
    o = parser.parse_args()
    if o.one:
        try:
            o.out.write_text(json.dumps(measured(o.captures[0]), indent=1) + "\n")
        except KerfwrightError as error:
            o.out.write_text(json.dumps({"error": str(error)}) + "\n")
        return
    o.out.mkdir(parents=True, exist_ok=True)
    results = {}
    for path in captures_in(o.captures):
        kept = o.out / f"{path.name}.json"
        if not (o.reuse and kept.exists()):
            subprocess.run([sys.executable, __file__, str(path), "--one", "--out", str(kept)], check=True)
        results[path.name] = json.loads(kept.read_text())
    print(page(results))


if __name__ == "__main__":
    main()
