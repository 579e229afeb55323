#!/usr/bin/env python3
"""Clouds that are no furniture, or spoilt, each end to end: a clear error, or the right boards, or a finding."""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
from properties import Variant, write_variant
from runs import Run, reconstruct
from tables import markdown

from kerfwright.capture import Cloud, open_capture, write_ply
from kerfwright.evaluate import evaluate
from kerfwright.model import read_model
from kerfwright.synthetic import CaptureOptions, CloudOptions, DatasetOptions, tiny_assembly, write_capture

SIZE = 0.3  # metres, of the tiny shelf
WHOLE = CaptureOptions(
    dataset=DatasetOptions(images=16, width=480, height=360), cloud=CloudOptions(points=40_000, views=2)
)  # fmt: skip
HEADER = ("spoilt by", "exit", "boards found of true", "extra", "findings of warning or worse, K002; or the error")
Spoil = Callable[[Cloud, np.random.Generator], Cloud]


def sphere(cloud: Cloud, rng: np.random.Generator) -> Cloud:
    """A ball as large as the object, no board."""
    normals = unit(rng.normal(size=(len(cloud), 3)))
    return Cloud(normals * SIZE / 2 + [0, 0, SIZE / 2], normals)


def cube(cloud: Cloud, rng: np.random.Generator) -> Cloud:
    """A cube: thin in no direction."""
    points = rng.uniform(-0.5, 0.5, (len(cloud), 3))
    axis, side = rng.integers(0, 3, len(cloud)), rng.choice([-0.5, 0.5], len(cloud))
    normals = np.zeros_like(points)
    points[np.arange(len(cloud)), axis] = side
    normals[np.arange(len(cloud)), axis] = 2 * side
    return Cloud(SIZE * points + [0, 0, SIZE / 2], normals)


def fog(cloud: Cloud, rng: np.random.Generator) -> Cloud:
    """Points everywhere: no plane."""
    return Cloud(rng.uniform(-SIZE / 2, SIZE / 2, (len(cloud), 3)), unit(rng.normal(size=(len(cloud), 3))))


def unit(v: np.ndarray) -> np.ndarray:
    """Rows of length one."""
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def only(keep: Callable[[Cloud], np.ndarray]) -> Spoil:
    """Some of the points."""
    return lambda cloud, rng: cloud.select(keep(cloud))


def turned(share: float, other: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Spoil:
    """A share of the normals replaced."""

    def spoil(cloud: Cloud, rng: np.random.Generator) -> Cloud:
        wrong = rng.random(len(cloud)) < share
        return Cloud(cloud.points, np.where(wrong[:, None], other(cloud.normals, rng), cloud.normals), cloud.colours)

    return spoil


def strewn(cloud: Cloud, rng: np.random.Generator) -> Cloud:
    """One more point in twenty anywhere in the room about the object."""
    count = len(cloud) // 20
    points = rng.uniform([-SIZE, -SIZE, 0], [SIZE, SIZE, 2 * SIZE], (count, 3))
    return joined(cloud, Cloud(points, unit(rng.normal(size=(count, 3)))))


def beside(cloud: Cloud, rng: np.random.Generator) -> Cloud:
    """The object twice, a metre apart."""
    return joined(cloud, Cloud(cloud.points + np.array([1.0, 0, 0]), cloud.normals))


def floored(cloud: Cloud, rng: np.random.Generator) -> Cloud:
    """The floor about the object left in."""
    x = np.c_[rng.uniform(-2 * SIZE, 2 * SIZE, (len(cloud), 2)), rng.normal(0, 2e-4, len(cloud))]
    return joined(cloud, Cloud(x, np.tile([0.0, 0, 1], (len(x), 1))))


def joined(a: Cloud, b: Cloud) -> Cloud:
    """All points, without colours."""
    return Cloud(np.concatenate([a.points, b.points]), np.concatenate([a.normals, b.normals]))


SPOILT: dict[str, Spoil] = {
    "nothing": lambda cloud, rng: cloud,
    "no plane": fog,
    "one plane": only(lambda c: (c.normals[:, 2] > 0.9) & (c.points[:, 2] > 0.21)),
    "only parallel planes": only(lambda c: np.abs(c.normals[:, 2]) > 0.9),
    "a ball": sphere,
    "a cube": cube,
    "two objects apart": beside,
    "5 % outliers": strewn,
    "floor points left in": floored,
    "10 % of normals flipped": turned(0.1, lambda n, rng: -n),
    "10 % of normals at random": turned(0.1, lambda n, rng: unit(rng.normal(size=n.shape))),
    "all normals flipped": turned(1.0, lambda n, rng: -n),
    "all normals zero": turned(1.0, lambda n, rng: 0 * n),
}
SIMILAR = {
    "scaled by 1e-3": np.diag([1e-3, 1e-3, 1e-3, 1.0]),
    "scaled by 1e3": np.diag([1e3, 1e3, 1e3, 1.0]),
    "10 km off": np.array([[1.0, 0, 0, 8000], [0, 1, 0, -6000], [0, 0, 1, 0], [0, 0, 0, 1]]),
}


def spoilt(source: Path, name: str, folder: Path) -> Path:
    """A capture folder with truth, spoilt in the named way; made anew."""
    shutil.rmtree(folder, ignore_errors=True)
    capture = open_capture(source)
    if name in SIMILAR:
        write_variant(capture, Variant(name, SIMILAR[name]), folder)
    else:
        shutil.copytree(source, folder)
        write_ply(folder / "cloud.ply", SPOILT[name](capture.cloud, np.random.default_rng(0)))
    return folder


def row(name: str, run: Run, out: Path, truth: Path) -> list[str]:
    """What came of it."""
    if not (out / "model.json").exists():
        return [name, str(run.code), "-", "-", run.last_line.replace("|", "/")]
    findings = [f for f in read_model(out / "model.json").findings if f.severity != "info" or f.code == "K002"]
    told = "; ".join(sorted({f"{f.code} {f.message.split(':')[0][:70]}" for f in findings})).replace("|", "/")
    if name in SIMILAR:  # the truth does not move with the capture: boards are counted
        return [name, str(run.code), f"{len(read_model(out / 'model.json').boards)} in all", "-", told]
    score = evaluate(out, truth)
    found = f"{score['parts_matched']}/{score['parts_true']}"
    return [name, str(run.code), found, str(len(score.get("extra", []))), told]


def main() -> None:
    """Make, run, tell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="*", choices=(*SPOILT, *SIMILAR))
    o = parser.parse_args()
    source = o.out / "whole"
    if not source.exists():
        write_capture(tiny_assembly(), source, WHOLE)
    rows = []
    for name in o.only or (*SPOILT, *SIMILAR):
        key = name.replace(" ", "_").replace("%", "percent")
        out = o.out / "results" / key
        shutil.rmtree(out, ignore_errors=True)
        folder = spoilt(source, name, o.out / "captures" / key)
        rows.append(row(name, reconstruct(folder, out), out, source / "truth"))
        print(" | ".join(rows[-1]), flush=True)
    print(markdown(HEADER, rows))


if __name__ == "__main__":
    main()
