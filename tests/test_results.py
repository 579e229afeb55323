"""What a reconstruction leaves in its folder."""

import json

import numpy as np
import pytest

from kerfwright.capture.types import Capture, Cloud
from kerfwright.model import Board, CutPath, Line, Loop, Model, Provenance, Quantity
from kerfwright.model.io import read_model
from kerfwright.pipeline import Reconstruction
from kerfwright.progress import Reporter
from kerfwright.results import report, write_results, write_run

POSE = ((1, 0, 0, 5), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
CAPTURE_FROM_MODEL = ((0.002, 0, 0, 1), (0, 0, -0.002, 2), (0, 0.002, 0, 3), (0, 0, 0, 1))


def model() -> Model:
    corners = [(0, 0), (100, 0), (100, 50), (0, 50)]
    edges = tuple(Line(start=a, end=b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    board = Board(
        name="seat 1", model_from_board=POSE, thickness=Quantity(value=20), cut_path=CutPath(outer=Loop(edges=edges))
    )
    return Model(
        name="block", boards=(board,), capture_from_model=CAPTURE_FROM_MODEL, provenance=Provenance(version="1", seed=4)
    )


def found() -> Reconstruction:
    """The cloud lies on the board, 0.5 mm off at one of three points; the world is the capture's own frame."""
    in_model = np.array([[5.0, 10, 10], [105, 10, 10], [50, 20, 20.5]])
    frame = np.array(CAPTURE_FROM_MODEL)
    points = in_model @ frame[:3, :3].T + frame[:3, 3]
    return Reconstruction(model(), Capture("block", (), Cloud(points, points), model().scale), None)


def test_the_cloud_is_laid_on_the_model(folder):
    assert "RMS 0.29 mm" in (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    write_results(found(), out)
    return out


def test_every_file_is_there(folder):
    names = sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    assert names[:2] == ["model.json", "model.step"] and names[-2:] == ["report.html", "report.json"]
    assert len(names) == 5 and names[2].startswith("parts/") and names[2].endswith(".dxf")


def test_the_model_reads_back(folder):
    assert read_model(folder / "model.json") == model()


def test_the_report_says_where_the_model_lies(folder):
    said = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    assert said["capture_from_model"] == [list(row) for row in CAPTURE_FROM_MODEL]
    assert said["figures"]["boards"] == 1 and said["figures"]["parts"][0]["name"] == "seat 1"
    assert said["provenance"]["seed"] == 4 and said == report(model())


def test_written_again_it_is_the_same_bytes(folder, tmp_path):
    write_results(found(), tmp_path)
    for path in sorted(p for p in folder.rglob("*") if p.is_file() and p.suffix != ".step"):
        assert path.read_bytes() == (tmp_path / path.relative_to(folder)).read_bytes(), path.name


def test_the_step_holds_the_board(folder):
    from build123d import import_step

    (solid,) = import_step(str(folder / "model.step")).solids()
    assert solid.volume == pytest.approx(100 * 50 * 20) and pytest.approx(55) == solid.center().X


def test_run_json_holds_what_may_differ(tmp_path):
    reporter = Reporter()
    with reporter.stage("capture"):
        reporter.reuse("capture")
    write_run(reporter, tmp_path / "run.json")
    said = json.loads((tmp_path / "run.json").read_text())
    assert list(said["seconds"]) == ["capture"] and said["cached"] == ["capture"]
    block = bytearray(400 * 2**20)  # memory that was held counts, also when it is given back
    block[::4096] = b"x" * len(block[::4096])
    del block
    write_run(reporter, tmp_path / "run.json")
    assert json.loads((tmp_path / "run.json").read_text())["peak_memory_gib"] >= max(0.4, said["peak_memory_gib"])


def test_nothing_of_the_machine_is_in_the_other_files(folder):
    import platform

    for path in folder.rglob("*"):
        if path.is_file():
            data = path.read_bytes()
            assert str(folder).encode() not in data and platform.node().encode() not in data, path.name
