"""The whole pipeline on the capture that ships: what a user gets, against the truth."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

FIXTURE = Path(__file__).parent.parent / "fixtures" / "stool"


def _reconstruct(capture: Path, out: Path, seed: str = "0") -> None:
    """Run the program; the seed is that of Python's own hashes, which order sets."""
    command = [sys.executable, "-m", "kerfwright", "reconstruct", str(capture), "-o", str(out), "--quiet"]
    subprocess.run(command, check=True, timeout=400, env={**os.environ, "PYTHONHASHSEED": seed})


@pytest.fixture(scope="module")
def stool(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("whole") / "out"
    _reconstruct(FIXTURE, out)
    return out


@pytest.fixture(scope="module")
def figures(stool: Path) -> dict:
    from kerfwright.evaluate import evaluate

    return evaluate(stool, FIXTURE / "truth")


def test_every_board_and_no_other(figures):
    assert (figures["parts_matched"], figures["extra"]) == (4, [])
    assert figures["mean_iou_seen"] > 0.9


def test_every_contact_with_its_type(figures):
    assert figures["contacts_typed_right"] == figures["contacts_found"] == figures["contacts_true"] == 4


def test_surface_is_near_the_truth(figures):
    assert figures["rmse_pct_seen_to_model"] < 0.2
    assert max(board["cut_mm"][0] for board in figures["boards"].values()) < 1.0


def test_solids_are_valid_and_apart(figures):
    assert figures["solids_valid"]
    contact_area = 4320 + 4320 + 1260 + 1260  # mm2, of the truth
    assert figures["interference_mm3"] < 0.001 * contact_area  # a thousandth of a millimetre deep


def test_cadquery_reads_the_step_file(stool):
    import cadquery

    from kerfwright.model import read_model
    from kerfwright.solid import assembly_solids

    own = sorted(solid.volume for _, solid in assembly_solids(read_model(stool / "model.json")))
    read = sorted(solid.Volume() for solid in cadquery.importers.importStep(str(stool / "model.step")).solids().vals())
    assert read == pytest.approx(own, rel=1e-6)


def test_report_says_where_the_model_lies(stool):
    from kerfwright.model import read_model

    place = np.array(json.loads((stool / "report.json").read_text())["capture_from_model"])
    boards = read_model(stool / "model.json").boards
    level = [(np.array(b.model_from_board)[2, 2:], b.thickness.value) for b in boards]
    height = max(z + max(thickness * np.sign(up), 0) for (up, z), thickness in level if abs(up) > 0.99)
    assert place[2, 2] * height + place[2, 3] == pytest.approx(0.400, abs=1e-3)  # metres; the seat is 400 mm high


def test_same_input_gives_the_same_bytes(stool, tmp_path):
    _reconstruct(FIXTURE, tmp_path / "again", seed="1")
    assert _digests(tmp_path / "again") == _digests(stool)


def _digests(out: Path) -> dict[str, str]:
    """Hash of every file that promises to be reproducible."""
    files = [p for p in sorted(out.rglob("*")) if p.is_file() and p.name != "run.json" and ".cache" not in p.parts]
    return {str(p.relative_to(out)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}
