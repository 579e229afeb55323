#!/usr/bin/env python3
"""How exact the geometry of results is: surfaces, thicknesses, angles, cut faces, nodes, repeats. See README.md."""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from runs import captures_in
from tables import markdown

from kerfwright.evaluate.score import evaluate_model
from kerfwright.evaluate.truth import TrueBoard, Truth, read_truth
from kerfwright.model import Model
from kerfwright.model.io import read_model

ALIKE = 1e-3  # relative, by which volume and moments of boards of one kind may differ: meshes of arcs are coarse
EQUAL_MM = 1e-3  # thicknesses that differ by less are one
HEADER = (
    "object", "seen to model %", "cloud to model (truth) %", "IoU seen", "cut mm", "angle median deg",
    "thickness mean, worst mm", "thicknesses (true)", "kinds of boards (true)", "nodes right of true", "spurious",
)  # fmt: skip
BOARDS = ("board", "IoU", "cut mm", "thickness mm", "from", "angle deg", "nodes right of true", "spurious")


def distinct(values: Iterable[float]) -> int:
    """How many of the values differ by more than EQUAL_MM from the next smaller one."""
    ordered = np.sort(np.fromiter(values, float))
    return int(1 + (np.diff(ordered) > EQUAL_MM).sum())


def signature(board: TrueBoard) -> np.ndarray:
    """Volume and principal second moments of a board's mesh, as lengths in mm: alike for repeats and mirror images."""
    corners = board.vertices[board.triangles] - board.vertices.mean(axis=0)
    volume = np.linalg.det(corners) / 6
    total = corners.sum(axis=1)
    centre = (volume[:, None] * total).sum(axis=0) / 4 / volume.sum()
    products = np.einsum("t,tci,tcj->ij", volume, corners, corners) + np.einsum("t,ti,tj->ij", volume, total, total)
    spread = products / 20 / volume.sum() - np.outer(centre, centre)
    return np.array([np.cbrt(abs(volume.sum())), *np.sqrt(np.linalg.eigvalsh(spread))])


def kinds(boards: Iterable[TrueBoard]) -> int:
    """How many of the true boards are no repeat of another."""
    found: list[np.ndarray] = []
    for own in map(signature, boards):
        if not any(np.allclose(own, other, rtol=ALIKE) for other in found):
            found.append(own)
    return len(found)


def figures(model: Model, truth: Truth) -> dict[str, Any]:
    """What `evaluate` says, and numbers of thicknesses and of kinds of boards, found and true."""
    score = evaluate_model(model, truth)
    return score | {
        "thicknesses": [distinct(b.thickness.value for b in model.boards), distinct(b.thickness for b in truth.boards)],
        "kinds": [sum(b.same_as is None for b in model.boards), kinds(truth.boards)],
        "origins": {b.name: b.thickness.origin.value for b in model.boards},
    }


def _seen(score: dict[str, Any], key: str) -> list[float]:
    boards = score["boards"].values()
    return [abs(b[key]) for b in boards if b.get("thickness_seen", True) and b[key] is not None]


def object_row(name: str, score: dict[str, Any]) -> list[str]:
    """One object; thickness and angle of boards whose thickness the cloud shows."""
    thickness = _seen(score, "thickness_mm")
    cut = [b["cut_mm"][0] for b in score["boards"].values() if b["cut_mm"]]
    return [
        name, f"{score['rmse_pct_seen_to_model']:.3f}",
        f"{score['rmse_pct_cloud_to_model']:.3f} ({score['rmse_pct_cloud_to_truth']:.3f})",
        f"{score['mean_iou_seen']:.3f}", f"{statistics.fmean(cut):.2f}", f"{np.median(_seen(score, 'angle_deg')):.3f}",
        f"{statistics.fmean(thickness):.2f}, {max(thickness):.2f}",
        "{} ({})".format(*score["thicknesses"]), "{} ({})".format(*score["kinds"]),
        f"{score['nodes_right_kind']}/{score['nodes_true']}", str(score["nodes_spurious"]),
    ]  # fmt: skip


def board_rows(score: dict[str, Any]) -> list[list[str]]:
    """The boards of one object."""
    rows = []
    for name, b in score["boards"].items():
        nodes = b["nodes"]
        hidden = "" if b.get("thickness_seen", True) else " (thickness unseen)"
        rows.append([
            name + hidden, f"{b['iou']:.3f}", f"{b['cut_mm'][0]:.2f}" if b["cut_mm"] else "-",
            f"{b['thickness_mm']:+.2f}" if b["thickness_mm"] is not None else "-", score["origins"][b["board"]],
            f"{b['angle_deg']:.3f}", f"{nodes['right_kind']}/{nodes['true']}", str(nodes["spurious"]),
        ])  # fmt: skip
    return rows


def main() -> None:
    """Score results that are there, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("captures", nargs="+", type=Path, help="capture folders with a truth/, or folders of them")
    parser.add_argument("--out", type=Path, required=True, help="results of reconstruct, one folder a capture")
    parser.add_argument("--boards", action="store_true", help="a table of every object's boards, too")
    o = parser.parse_args()
    rows, details = [], []
    for capture in captures_in(o.captures):
        path = o.out / capture.name / "model.json"
        if path.exists():
            score = figures(read_model(path), read_truth(capture / "truth"))
            rows.append(object_row(capture.name, score))
            details.append(f"### {capture.name}\n\n{markdown(BOARDS, board_rows(score))}")
    print(markdown(HEADER, rows))
    if o.boards:
        print("\n".join(details))


if __name__ == "__main__":
    main()
