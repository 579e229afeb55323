#!/usr/bin/env python3
"""Accuracy board: every capture x every figure, with the change against the last recorded run. See README.md."""

from __future__ import annotations

import argparse
import json
import shlex
import statistics
from dataclasses import asdict
from pathlib import Path
from typing import Any

from runs import Run, captures_in, reconstruct
from tables import changed, markdown, ratio

from kerfwright.errors import KerfwrightError
from kerfwright.evaluate import evaluate

RECORDS = Path(__file__).resolve().parents[1] / "docs" / "benchmarks"
HEADER = (
    "capture", "boards", "extra", "IoU seen", "seen to model %", "cloud to model (truth) %", "contacts typed", "area",
    "overlap mm3", "thickness mm", "angle deg", "cut mm", "nodes", "spurious", "s", "GiB", "status",
)  # fmt: skip

# What the paper's table of results says of the same objects: photographs, boards, boards found, RMSE in % of D, seconds
# in identification, assembly, segmentation, curve fitting.
PAPER = {
    "stool": (68, 4, 4, 0.433, 3, 0.3, 267, 129),
    "nightstand": (37, 10, 7, 0.477, 25, 25, 498, 70),
    "bookshelf": (37, 7, 7, 0.204, 8.7, 4.7, 507, 31),
    "tray": (30, 5, 5, 0.259, 2.5, 26, 54, 23),
    "bookholder": (42, 6, 6, 0.406, 5.2, 27, 131, 23),
    "tilted_stool": (48, 4, 4, 0.432, 15, 0.038, 199, 20),
}


def row_of(capture: Path, out: Path, run: Run, stage: str | None) -> dict[str, Any]:
    """The figures of one capture that the board shows; `error` where there are none."""
    row: dict[str, Any] = {"run": asdict(run), "images": len(list((capture / "images").iterdir()))}
    if stage not in ("identify", "assemble") and not (out / "model.json").exists():
        return row | {"error": run.last_line or f"exit code {run.code}", "missed": true_counts(capture)}
    try:
        return row | {"score": evaluate(out, capture / "truth", stage)}
    except KerfwrightError as error:
        return row | {"error": str(error), "missed": true_counts(capture)}


def true_counts(capture: Path) -> dict[str, int]:
    """What a capture without a result leaves unfound: it counts in the shares of the whole set."""
    truth = json.loads((capture / "truth" / "truth.json").read_text())
    return {"parts_true": len(truth["parts"]), "contacts_true": len(truth["connections"])}


def worst(score: dict[str, Any], key: str) -> float | None:
    """The largest size of a figure among the matched boards whose thickness was seen."""
    boards = [b for b in score["boards"].values() if b.get("thickness_seen", True)]
    values = [abs(b[key]) for b in boards if b[key] is not None]
    return max(values) if values else None


def mean_cut(score: dict[str, Any]) -> float | None:
    """Mean distance of cut faces, over the matched boards."""
    values = [b["cut_mm"][0] for b in score["boards"].values() if b["cut_mm"]]
    return statistics.fmean(values) if values else None


def of_cloud(score: dict[str, Any]) -> str:
    """The paper's figure, and what the truth itself gets."""
    if "rmse_pct_cloud_to_model" not in score:
        return "-"
    return f"{score['rmse_pct_cloud_to_model']:.3f} ({score['rmse_pct_cloud_to_truth']:.3f})"


def is_right(row: dict[str, Any]) -> bool:
    """Every board found, none invented, every contact with its type, no overlap above a cubic millimetre."""
    s = row.get("score")
    return bool(
        s
        and s["parts_matched"] == s["parts_true"] == s["parts_found"]
        and s["contacts_typed_right"] == s["contacts_true"] == s["contacts_found"]
        and s.get("interference_mm3", 0) < 1
    )


def status(name: str, row: dict[str, Any], known: dict[str, str]) -> str:
    """ok, known failure, failure, or a pass that nobody expected."""
    if is_right(row):
        return "**UNEXPECTED PASS**" if name in known else "ok"
    return f"known: {known[name]}" if name in known else "**FAILS**"


def cells(name: str, row: dict[str, Any], before: dict[str, Any], known: dict[str, str]) -> list[str]:
    """One line of the board."""
    state = status(name, row, known)
    s, b, run = row.get("score"), before.get("score") or {}, row["run"]
    if not s or not s["parts_matched"]:
        told = row.get("error", "no board found")
        return [name, *["-"] * 13, f"{run['seconds']:.0f}", "-", f"{state}: {told[-90:]}".replace("|", "/")]
    old = b if b.get("boards") else None
    typed = ratio(s["contacts_typed_right"], s["contacts_true"], b.get("contacts_typed_right"))
    return [
        name,
        ratio(s["parts_matched"], s["parts_true"], b.get("parts_matched")),
        str(len(s["extra"])),
        changed(s.get("mean_iou_seen"), b.get("mean_iou_seen"), 3),
        changed(s.get("rmse_pct_seen_to_model"), b.get("rmse_pct_seen_to_model"), 3),
        of_cloud(s),
        f"{typed} of {s['contacts_found']}",
        str(s["contacts_area_right"]),
        changed(s.get("interference_mm3"), b.get("interference_mm3"), 1),
        changed(worst(s, "thickness_mm"), worst(old, "thickness_mm") if old else None, 2),
        changed(worst(s, "angle_deg"), worst(old, "angle_deg") if old else None, 2),
        changed(mean_cut(s), mean_cut(old) if old else None, 2),
        ratio(s.get("nodes_right_kind"), s.get("nodes_true"), b.get("nodes_right_kind")),
        str(s.get("nodes_spurious", "-")),
        f"{run['seconds']:.0f}",
        "-" if run["peak_gib"] is None else f"{run['peak_gib']:.1f}",
        state,
    ]  # fmt: skip


def sums(rows: dict[str, dict[str, Any]]) -> str:
    """What the set as a whole gets."""
    scores = [r.get("score") or r.get("missed", {}) for r in rows.values()]
    lines = [f"{sum(map(is_right, rows.values()))} of {len(rows)} captures right in every board and contact."]
    for what, right, whole in (
        ("boards", "parts_matched", "parts_true"),
        ("typed contacts", "contacts_typed_right", "contacts_true"),
        ("nodes", "nodes_right_kind", "nodes_true"),
    ):
        total = sum(s.get(whole, 0) for s in scores)
        if total:
            share = sum(s.get(right, 0) for s in scores) / total
            lines.append(f"{100 * share:.1f} % of {total} {what}.")
    return " ".join(lines) + "\n"


def beside_the_paper(rows: dict[str, dict[str, Any]]) -> str:
    """The paper's own table with ours in the same columns: photographs, boards, RMSE of the cloud, seconds."""
    header = ("object", "images", "boards", "RMSE % of D", "identify s", "assemble s", "refine s", "all s")
    out = []
    for name, (images, true, found, rmse, *seconds) in PAPER.items():
        if name not in rows:
            continue
        refine = seconds[2] + seconds[3]
        out.append(
            [
                f"{name}, paper",
                str(images),
                f"{found}/{true}",
                f"{rmse:.3f}",
                *(f"{v:g}" for v in (*seconds[:2], refine, sum(seconds))),
            ]
        )
        row, s = rows[name], rows[name].get("score") or {}
        took = row["run"]["stages"]
        took = took | {"identify": took.get("planes", 0) + took.get("identify", 0)}  # one stage in the paper
        rmse_here = s.get("rmse_pct_cloud_to_model")
        out.append([
            f"{name}, here", str(row["images"]), ratio(s.get("parts_matched"), s.get("parts_true")),
            "-" if rmse_here is None else f"{rmse_here:.3f}",
            *(f"{took.get(k, 0):.1f}" for k in ("identify", "assemble", "refine")), f"{row['run']['seconds']:.1f}",
        ])  # fmt: skip
    return markdown(header, out) if out else ""


def board(rows: dict[str, dict[str, Any]], before: dict[str, Any], known: dict[str, str]) -> str:
    """The whole page."""
    lines = [cells(name, row, before.get(name, {}), known) for name, row in rows.items()]
    paper = beside_the_paper(rows)
    parts = ["# Accuracy\n", sums(rows), markdown(HEADER, lines)]
    parts.append(
        "Thickness and angle: the worst of the boards whose thickness the cloud shows. In brackets: the change since "
        "the last recorded run; beside cloud to model, what the truth itself gets. Made by benchmarks/accuracy.py.\n"
    )
    return "\n".join([*parts, "## Beside the paper\n", paper] if paper else parts)


def read_json(path: Path) -> dict[str, Any]:
    """A record, or nothing where there is none yet."""
    return json.loads(path.read_text()) if path.exists() else {}


def main() -> None:
    """Run, score, print, and record if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("captures", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True, help="results of the runs, one folder a capture")
    parser.add_argument("--reuse", action="store_true", help="keep results that are there")
    parser.add_argument("--record", action="store_true", help="write docs/benchmarks/accuracy.md and .json")
    parser.add_argument("--name", default="accuracy", help="of the record")
    parser.add_argument("--stage", choices=("identify", "assemble", "refine"))
    parser.add_argument("--args", default="", help="passed to reconstruct")
    o = parser.parse_args()
    rows = {}
    for capture in captures_in(o.captures):
        out = o.out / capture.name
        rows[capture.name] = row_of(capture, out, reconstruct(capture, out, shlex.split(o.args), o.reuse), o.stage)
    record = RECORDS / f"{o.name}.json"
    page = board(rows, read_json(record), read_json(RECORDS / "known_failures.json"))
    print(page)
    if o.record:
        RECORDS.mkdir(parents=True, exist_ok=True)
        record.write_text(json.dumps(rows, indent=1) + "\n")
        record.with_suffix(".md").write_text(page)


if __name__ == "__main__":
    main()
