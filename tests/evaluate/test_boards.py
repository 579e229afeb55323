"""The accuracy and speed boards: rows, changes, growth, variants."""

import importlib
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kerfwright.capture import open_capture
from kerfwright.synthetic import (
    CaptureOptions,
    CloudOptions,
    DatasetOptions,
    ImageOptions,
    tiny_assembly,
    write_capture,
)

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def bench():
    sys.path.insert(0, str(BENCHMARKS))
    yield lambda name: importlib.import_module(name)
    sys.path.remove(str(BENCHMARKS))


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    options = CaptureOptions(
        dataset=DatasetOptions(images=6, width=160, height=120),
        images=ImageOptions(samples=1, texels=0.01, floor_texels=256, room_nodes=8, light_rays=4),
        cloud=CloudOptions(points=3000, views=2),
    )
    return write_capture(tiny_assembly(), tmp_path_factory.mktemp("bench") / "tiny", options)


def score(**changes):
    board = {"thickness_mm": -0.3, "angle_deg": 0.1, "cut_mm": [0.5, 1.0], "thickness_seen": True}
    whole = {
        "parts_true": 3, "parts_found": 3, "parts_matched": 3, "extra": [], "mean_iou_seen": 0.97,
        "rmse_pct_seen_to_model": 0.15, "rmse_pct_cloud_to_model": 0.21, "rmse_pct_cloud_to_truth": 0.2,
        "contacts_true": 2, "contacts_found": 2, "contacts_typed_right": 2, "contacts_area_right": 2,
        "interference_mm3": 0.0, "nodes_true": 12, "nodes_right_kind": 11, "nodes_spurious": 1, "boards": {"a": board},
    }  # fmt: skip
    run = {"seconds": 12.0, "peak_gib": 1.5, "stages": {"identify": 3.0}}
    return {"score": whole | changes, "run": run, "images": 30}


def test_board_shows_changes_known_failures_and_surprises(bench):
    accuracy = bench("accuracy")
    rows = {"good": score(), "bad": score(parts_matched=2), "odd": score()}
    page = accuracy.board(rows, {"good": score(rmse_pct_seen_to_model=0.2)}, {"odd": "glass", "bad": "hidden rail"})
    lines = {line.split(" | ")[0].strip("| "): line for line in page.splitlines() if line.startswith("| ")}
    assert "0.150 (-0.050)" in lines["good"]
    assert lines["good"].endswith("ok |")
    assert "known: hidden rail" in lines["bad"]
    assert "UNEXPECTED PASS" in lines["odd"]
    assert len({line.count("|") for line in lines.values()}) == 1
    assert "2 of 3 captures right" in page


def test_a_failed_run_is_a_row_and_not_a_crash(bench):
    accuracy = bench("accuracy")
    row = {"error": "no plane | found", "run": {"seconds": 3.0, "peak_gib": None, "stages": {}}, "images": 5}
    page = accuracy.board({"lost": row, "stool": row}, {}, {})
    assert page.count("**FAILS**: no plane / found") == 2
    assert "stool, paper" in page


def test_boards_of_a_failed_run_count_as_not_found(bench):
    accuracy = bench("accuracy")
    lost = {"error": "x", "missed": {"parts_true": 3, "contacts_true": 2}, "run": score()["run"], "images": 5}
    page = accuracy.board({"good": score(), "lost": lost}, {}, {})
    assert "50.0 % of 6 boards. 50.0 % of 4 typed contacts." in page


def test_growth_is_the_exponent_of_size(bench):
    speed = bench("speed")
    sizes = (10, 100, 1000)
    assert speed.exponent(sizes, [n**1.5 * 1e-3 for n in sizes]) == pytest.approx(1.5)
    assert speed.exponent(sizes, [1e-3] * 3) is None  # too quick to time


def test_runs_read_what_run_json_says(bench, tmp_path):
    (tmp_path / "run.json").write_text(
        json.dumps({"seconds": {"identify": 2.0, "refine": 3.0}, "peak_memory_gib": 0.7})
    )
    run = bench("runs").reconstruct(Path("nowhere"), tmp_path, reuse=True)
    assert (run.seconds, run.peak_gib, run.stages["refine"]) == (5.0, 0.7, 3.0)


@pytest.mark.parametrize("count", [1000, 9000])
def test_variants_have_as_many_points_and_lie_where_they_lay(bench, capture, tmp_path, count):
    before = open_capture(capture).cloud
    after = open_capture(bench("variants").with_points(capture, tmp_path / "v", count)).cloud
    assert len(after) == count
    from scipy.spatial import cKDTree

    assert cKDTree(before.points).query(after.points)[0].max() < 0.01 * before.diameter


def test_fewer_photographs_and_fewer_pixels_keep_their_cameras(bench, capture, tmp_path):
    variants = bench("variants")
    fewer = open_capture(variants.with_images(capture, tmp_path / "i", 3))
    assert len(fewer.views) == 3
    assert fewer.views[-1].image().shape == (120, 160, 3)
    small = open_capture(variants.with_pixels(capture, tmp_path / "p", 0.5))
    assert small.views[0].image().shape == (60, 80, 3)
    x = np.array([[0.0, 0.0, 0.1]])
    whole = open_capture(capture).views[0].project(x)[0]
    assert small.views[0].project(x)[0] == pytest.approx(whole / 2)


def test_more_photographs_than_there_are_have_names_and_files_of_their_own(bench, capture, tmp_path):
    more = open_capture(bench("variants").with_images(capture, tmp_path / "m", 9))
    assert len({view.path for view in more.views}) == len({view.name for view in more.views}) == 9
    assert len({tuple(view.camera_from_world.ravel().round(9)) for view in more.views}) == 6


def test_a_run_without_results_is_told_whatever_its_exit_code(bench):
    speed, run = bench("speed"), bench("runs").Run
    crashed = run(1, 3.0, last_line="kerfwright: error: this is a bug in kerfwright")
    whole = run(1, 9.0, dict.fromkeys(speed.STAGES, 1.5), 1.0)
    page = speed.series("Boards", [4, 8, 16], [whole, crashed, replace(whole, code=0)])
    assert "exit 1: kerfwright: error: this is a bug in kerfwright" in page and page.count("errors found") == 1


def test_captures_are_found_in_folders_of_them(bench, capture):
    captures_in = bench("runs").captures_in
    assert list(captures_in([capture])) == [capture]
    assert list(captures_in([capture.parent])) == [capture]
    with pytest.raises(SystemExit, match="none in it"):
        list(captures_in([capture / "truth"]))


def test_identification_is_told_board_by_board(bench):
    """Glued boards found as one count; a thickness that the cloud does not show is told with its origin."""
    identify = bench("identify")
    exact = {
        "rough_found": 1, "rough_missing": ["b", "c"], "rough_extra": ["board_03"], "rough_as_one": [["a", "b"]],
        "rough_pairs": {"a": "board_01"}, "rough_thickness_mm": {"a": -0.25}, "selection": {"candidates": 9},
        "said": {"board_01": {"origin": "inferred", "mm": 11.75, "standard_error": 4.0}},
    }  # fmt: skip
    truth = {name: {"points": n, "seen": False} for name, n in (("a", 900), ("b", 400), ("c", 12))}
    more = exact | {"rough_extra": []}
    figures = {"cpu_seconds": 3.0, "peak_gib": 0.5, "truth": truth, "exact": exact, "total": [exact, more]}
    figures["mean"] = [more]
    page = identify.page({"back": figures, "ball": {"error": "cloud: no plane"}})
    assert "| back | 2/3 | 1 | 0.25 | - | 9 | 3.0 | 0.50 | 2/3 | 0-1 | 2/3 | 0 |" in page
    assert "a: thickness not seen; said to be inferred, 11.75 ± 4.00 mm, error -0.25 mm" in page
    assert "c: not found alone; 12 points in the cloud" in page
    assert "ball: no figures: cloud: no plane" in page


def test_growth_of_identification_is_tabled_with_exponents(bench):
    growth = bench("growth")
    runs = [
        {
            "seconds": dict.fromkeys(growth.PHASES, 1e-5 * n), "points": n, "cpu": 5e-5 * n, "wall": 9.0, "planes": 20,
            "before_gib": 0.3, "peak_gib": 0.5, "candidates": 7, "boards": 4,
        }
        for n in (100_000, 400_000)
    ]  # fmt: skip
    page = growth.table("points", (100_000, 400_000), runs)
    phases = " | ".join(["1.00"] * len(growth.PHASES))
    assert f"| 100000 | 100000 | {phases} | 5.0 | 9.0 | 0.50 (0.30) | 20 | 7 | 4 |" in page
    assert "| growth exponent |  | 1.00 | 1.00 | 1.00 | 1.00 | 1.00 | 1.00 |" in page


def test_every_spoilt_cloud_has_as_many_normals_as_points(bench, capture):
    spoilt, cloud = bench("spoilt"), open_capture(capture).cloud
    for name, spoil in spoilt.SPOILT.items():
        changed = spoil(cloud, np.random.default_rng(0))
        assert changed.points.shape == changed.normals.shape, name
        assert np.isfinite(changed.points).all(), name
