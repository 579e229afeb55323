#!/usr/bin/env python3
"""The final models without parts of the method: segmentation, several views, constraints, seams. See README.md."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from runs import captures_in
from tables import markdown

from kerfwright.errors import KerfwrightError
from kerfwright.evaluate import evaluate_model, read_truth
from kerfwright.pipeline import LEFT_OUT, STAGES, ReconstructOptions, run_stages
from kerfwright.progress import Reporter

FIRST = ("capture", "planes", "identify", "assemble")  # what no ablation changes
HEADER = (
    "object", "without", "boards", "IoU seen", "seen to model %", "cloud to model %", "contacts typed (found)",
    "cut mm, worst board", "nodes right (spurious)", "overlap mm3",
)  # fmt: skip


def models(capture: Path, parts: list[str]) -> dict[str, Callable[[], Any]]:
    """What makes the model as it is (""), and without each part; the first stages are run once."""
    options = ReconstructOptions()
    stages = [stage for stage in STAGES if stage.name in FIRST]
    results = run_stages(capture, options, Reporter(), stages=stages)
    return {part: lambda part=part: _finished(results, replace(options, without=part)) for part in parts}


def _finished(results: dict[str, Any], options: ReconstructOptions) -> Any:
    results = dict(results)
    for stage in STAGES:
        if stage.name not in results:
            results[stage.name] = stage.run(*(results[name] for name in stage.needs), options)
    return results["check"]


def cells(name: str, part: str, score: dict[str, Any]) -> list[str]:
    """One line of the table."""
    cuts = [board["cut_mm"][0] for board in score["boards"].values() if board["cut_mm"]]
    return [
        name, part or "-", f"{score['parts_matched']}/{score['parts_true']}", f"{score['mean_iou_seen']:.3f}",
        f"{score['rmse_pct_seen_to_model']:.3f}", f"{score['rmse_pct_cloud_to_model']:.3f}",
        f"{score['contacts_typed_right']}/{score['contacts_true']} ({score['contacts_found']})",
        f"{max(cuts, default=0):.2f}", f"{score['nodes_right_kind']}/{score['nodes_true']} ({score['nodes_spurious']})",
        f"{score['interference_mm3']:.1f}",
    ]  # fmt: skip


def main() -> None:
    """Run, score, print; every row is kept as soon as it is there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("captures", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True, help="folder of ablations.md and ablations.json")
    parser.add_argument("--only", nargs="*", choices=LEFT_OUT, default=list(LEFT_OUT))
    o = parser.parse_args()
    o.out.mkdir(parents=True, exist_ok=True)
    rows, scores = [], {}
    for capture in captures_in(o.captures):
        truth = read_truth(capture / "truth")
        for part, make in models(capture, ["", *o.only]).items():
            try:
                score = evaluate_model(make(), truth)
                scores[f"{capture.name} {part}"], row = score, cells(capture.name, part, score)
            except (KerfwrightError, KeyError) as error:  # of a model without boards, or no model
                row = [capture.name, part or "-", f"{type(error).__name__}: {error}"[:90], *["-"] * (len(HEADER) - 3)]
            rows.append(row)
            print(*row, sep=" | ", flush=True)
            (o.out / "ablations.md").write_text(markdown(HEADER, rows))
            (o.out / "ablations.json").write_text(json.dumps(scores, indent=1) + "\n")


if __name__ == "__main__":
    main()
