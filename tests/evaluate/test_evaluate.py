"""Evaluation: a true model scores perfectly, a known error is measured, and the shared scorer agrees."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from kerfwright.capture import write_ply
from kerfwright.errors import CaptureError, OptionError, OutputError
from kerfwright.evaluate import evaluate, evaluate_model, read_truth
from kerfwright.evaluate.nodes import loop_nodes, true_nodes
from kerfwright.evaluate.rough import rough_figures
from kerfwright.evaluate.surfaces import Body, occupied_share, sample_surface
from kerfwright.evaluate.touching import touching_pairs
from kerfwright.evaluate.truth import TrueBoard
from kerfwright.model import Model
from kerfwright.model.frames import rows
from kerfwright.model.io import write_model
from kerfwright.model.resize import resized_board
from kerfwright.synthetic import random_assembly, tiny_assembly, tiny_capture
from kerfwright.synthetic.carpentry import given, slab
from kerfwright.synthetic.files import write_frame, write_truth
from kerfwright.synthetic.meshes import mesh_in_model

SCORER = Path("/work/shared/tools/score.py")
# The capture's frame: turned, shifted, of another scale.
TURN, SHIFT, SCALE = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([1.0, 2, 3]), 2.5


def capture_from_model():
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = TURN * SCALE / 1000, SHIFT
    return m


def truth_folder(folder, model, cloud=None):
    write_truth(folder / "truth", model)
    write_frame(folder / "truth", SCALE, TURN, SHIFT)
    if cloud is not None:
        m = capture_from_model()
        moved = type(cloud)(cloud.points @ m[:3, :3].T + m[:3, 3], cloud.normals @ TURN.T, cloud.colours)
        write_ply(folder / "cloud.ply", moved)
    return folder / "truth"


def placed(model):
    """The model as a program would hand it in: it knows where it lies in the capture."""
    return model.model_copy(update={"capture_from_model": tuple(map(tuple, capture_from_model().tolist()))})


def changed(model, name, **updates):
    boards = tuple(b.model_copy(update=updates) if b.name == name else b for b in model.boards)
    return model.model_copy(update={"boards": boards})


def raised(board, mm):
    rows = [list(r) for r in board.model_from_board]
    rows[2][3] += mm
    return tuple(map(tuple, rows))


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    return truth_folder(tmp_path_factory.mktemp("tiny"), tiny_assembly(), tiny_capture().cloud)


def test_the_truth_itself_scores_perfectly(tiny):
    got = evaluate_model(placed(tiny_assembly()), read_truth(tiny))
    assert (got["parts_true"], got["parts_matched"], got["parts_good"]) == (3, 3, 3)
    assert (got["contacts_true"], got["contacts_typed_right"], got["contacts_area_right"]) == (2, 2, 2)
    assert got["contacts_missing"] == got["contacts_extra"] == got["missing"] == got["extra"] == []
    assert got["mean_iou"] > 0.999
    assert got["rmse_pct_truth_to_model"] < 0.001
    assert got["rmse_pct_cloud_to_model"] == pytest.approx(got["rmse_pct_cloud_to_truth"], abs=1e-4)
    assert got["interference_mm3"] == pytest.approx(0, abs=1e-3)
    assert got["nodes_true"] == got["nodes_right_kind"] == 12
    assert got["nodes_spurious"] == 0


def test_a_board_too_thick_and_one_moved_are_measured(tiny):
    model = tiny_assembly()
    top = model.boards[0]
    model = changed(model, "top", thickness=given(18.4), model_from_board=raised(top, 0.5))
    got = evaluate_model(placed(model), read_truth(tiny))
    assert got["boards"]["top"]["thickness_mm"] == pytest.approx(0.4, abs=1e-3)
    assert got["boards"]["top"]["angle_deg"] == pytest.approx(0, abs=1e-3)
    assert got["contacts_right"] == 0  # half a millimetre is a gap
    assert len(got["contacts_missing"]) == 2
    assert got["hausdorff_mm"] == pytest.approx(0.9, abs=0.01)


def test_overlap_between_boards_is_a_volume(tiny):
    model = changed(tiny_assembly(), "top", model_from_board=raised(tiny_assembly().boards[0], -2.0))
    got = evaluate_model(placed(model), read_truth(tiny))
    assert got["interference_mm3"] == pytest.approx(2 * 15 * 160 * 2, rel=1e-3)


def test_missing_and_extra_boards_are_named(tiny):
    model = tiny_assembly()
    other = slab("stray", (400, 0, 0), (500, 100, 20))
    got = evaluate_model(placed(model.model_copy(update={"boards": (*model.boards[:2], other)})), read_truth(tiny))
    assert got["missing"] == ["right"]
    assert got["extra"] == ["stray"]
    assert got["contacts_missing"] == ["top-right"]


def test_an_empty_model_finds_nothing(tiny):
    model = tiny_assembly().model_copy(update={"boards": (), "contacts": ()})
    got = evaluate_model(placed(model), read_truth(tiny))
    assert got["parts_matched"] == 0
    assert len(got["missing"]) == 3


def test_a_corner_the_other_way_round_is_mistyped():
    square = [slab("floor", (0, 0, 0), (200, 100, 10)), slab("wall", (0, 0, 10), (10, 100, 110))]
    reversed_ = [slab("floor", (10, 0, 0), (200, 100, 10)), slab("wall", (0, 0, 0), (10, 100, 110))]
    normals = [np.array([0, 0, 1.0]), np.array([1.0, 0, 0])]
    kinds = [touching_pairs([mesh_in_model(b) for b in pair], normals)[0, 1].kinds for pair in (square, reversed_)]
    assert kinds == [("sheet", "cut"), ("cut", "sheet")]


def test_listed_contacts_are_scored_where_rough_boards_do_not_touch(tiny):
    model = tiny_assembly()
    apart = changed(model, "top", model_from_board=raised(model.boards[0], 3.0))
    assert evaluate_model(placed(apart), read_truth(tiny))["contacts_right"] == 0
    rough = evaluate_model(placed(apart), read_truth(tiny), rough=True)
    assert rough["contacts_typed_right"] == 2
    assert rough["rough_missing"] == rough["rough_extra"] == ["top"]  # 3 mm off is another plane
    assert rough["rough_thickness_mm"] == {"left": 0.0, "right": 0.0}


def test_rough_thickness_is_told_in_the_truths_millimetres(tiny):
    """Stages work in units of their own; the model's frame tells how long they are."""
    model = tiny_assembly()
    factor = 2.5
    boards = tuple(resized_board(b, np.diag([factor, factor, factor, 1.0])) for b in model.boards)
    frame = capture_from_model() @ np.diag([1 / factor, 1 / factor, 1 / factor, 1.0])
    resized = model.model_copy(update={"boards": boards, "capture_from_model": rows(frame)})
    rough = rough_figures(read_truth(tiny), resized, np.linalg.inv(read_truth(tiny).capture_from_truth) @ frame)
    assert rough["rough_thickness_mm"] == {"top": 0.0, "left": 0.0, "right": 0.0}
    assert rough["rough_found"] == 3


def test_boards_glued_edge_to_edge_may_be_found_as_one(tmp_path):
    low, high, far = ((0, 0, 0), (100, 10, 50)), ((0, 0, 50), (100, 10, 100)), ((0, 0, 200), (100, 10, 250))
    parts = [slab(name, *corners) for name, corners in zip("abc", (low, high, far), strict=True)]
    truth = read_truth(truth_folder(tmp_path, Model(name="back", boards=parts)))
    whole = Model(name="back", boards=[slab("one", (0, 0, 0), (100, 10, 100)), parts[2]])
    frame = np.linalg.inv(truth.capture_from_truth) @ capture_from_model()
    rough = rough_figures(truth, whole, frame)
    assert rough["rough_as_one"] == [["a", "b"]]
    assert rough["rough_missing"] == ["a", "b"]
    assert rough["rough_extra"] == []
    apart = Model(name="back", boards=[whole.boards[0], slab("two", (0, 0, 100), (100, 10, 250))])
    assert rough_figures(truth, apart, frame)["rough_extra"] == ["two"]


@pytest.mark.parametrize("family", ["stool", "tilted_stool", "rack", "tray"])
def test_nodes_of_the_truth_are_those_of_its_model(family, tmp_path):
    model = random_assembly(family, 1)
    write_truth(tmp_path, model)
    for true, board in zip(read_truth(tmp_path).boards, model.boards, strict=True):
        at, smooth = true_nodes(true)
        parts = [loop_nodes(loop) for loop in (board.cut_path.outer, *board.cut_path.holes)]
        assert np.allclose(at, np.concatenate([p[0] for p in parts]))
        assert np.array_equal(smooth, np.concatenate([p[1] for p in parts])), board.name


def test_nodes_of_a_bevelled_end_are_where_it_reaches_furthest():
    """Whether the truth's outline is that, or the one half way through the board."""
    low, high = ([(0, 0, z), (x, 0, z), (x, 50, z), (0, 50, z)] for x, z in ((108, 0), (92, 16)))
    corners = np.array([*low, *high], float)
    faces = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    for end in (100.0, 108.0):
        ring = np.array([(0, 0), (end, 0), (end, 50), (0, 50)], float)
        edges = [
            {"kind": "line", "start": a, "end": b, "length": float(np.linalg.norm(b - a))}
            for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)
        ]
        board = TrueBoard("a", 16.0, np.eye(4), corners, triangles, ({"hole": False, "edges": edges},))
        assert np.allclose(true_nodes(board)[0], [[0, 0], [108, 0], [108, 50], [0, 50]], atol=0.01)


def test_folders_are_read_and_bad_ones_refused(tiny, tmp_path):
    write_model(placed(tiny_assembly()), tmp_path / "model.json")
    assert evaluate(tmp_path, tiny)["parts_matched"] == 3
    with pytest.raises(OptionError, match="stage: sawing"):
        evaluate(tmp_path, tiny, "sawing")
    with pytest.raises(OutputError, match="identify: no result kept"):
        evaluate(tmp_path, tiny, "identify")
    with pytest.raises(CaptureError, match=r"truth\.json"):
        evaluate(tmp_path, tmp_path)
    (tmp_path / "truth.json").write_text('{"parts": [{"name": "a"}], "name": "b"}')
    with pytest.raises(CaptureError, match="KeyError"):
        evaluate(tmp_path, tmp_path)


def test_samples_cover_evenly_and_overlap_is_a_share():
    cube = mesh_in_model(slab("a", (0, 0, 0), (10, 20, 30)))
    samples = sample_surface(cube, 4096)
    on_ends = (np.abs(samples.normals[:, 2]) > 0.5).sum() * samples.share
    assert on_ends == pytest.approx(400, rel=0.02)
    half = mesh_in_model(slab("b", (0, 0, 15), (10, 20, 45)))
    low, high = np.zeros(3), np.array([10.0, 20, 45])
    assert occupied_share(Body(cube), Body(half), low, high) == pytest.approx(1 / 3, abs=0.005)


@pytest.fixture(scope="module")
def scorer():
    if not SCORER.exists():
        pytest.skip(f"{SCORER} is not here")
    spec = importlib.util.spec_from_file_location("score", SCORER)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_shared_scorer_agrees(scorer, tiny, tmp_path):
    """On a model with a thick board, a moved one and an overlap."""
    model = tiny_assembly()
    model = changed(model, "top", thickness=given(18.7), model_from_board=raised(model.boards[0], 0.15))
    left = slab("left", (-119, -80, 0), (-104, 76, 200))
    model = placed(changed(model, "left", **{k: getattr(left, k) for k in ("model_from_board", "cut_path")}))
    ours = evaluate_model(model, read_truth(tiny))
    theirs = score_with(scorer, model, tiny, tmp_path)
    for key in ("parts_matched", "parts_good", "parts_true_open", "contacts_true_open", "hidden", "missing", "extra"):
        assert ours[key] == theirs[key], key
    for key in (k for k in theirs if k.startswith("contacts")):
        assert ours[key] == theirs[key], key
    for key in (k for k in theirs if k.startswith("rmse")):
        assert ours[key] == pytest.approx(theirs[key], rel=0.02), key
    for key in ("mean_iou", "mean_iou_seen"):
        assert ours[key] == pytest.approx(theirs[key], abs=0.004), key
    for name, board in theirs["boards"].items():
        assert ours["boards"][name]["thickness_mm"] == pytest.approx(board["thickness_mm"], abs=0.002)
        assert ours["boards"][name]["angle_deg"] == pytest.approx(board["angle_deg"], abs=0.02)
        assert ours["boards"][name]["cut_mm"] == pytest.approx(board["cut_mm"], rel=0.1, abs=0.03)
        assert ours["boards"][name]["thickness_seen"] == board["thickness_seen"]
    assert ours["interference_mm3"] == pytest.approx(theirs["interference_mm3"], rel=1e-3, abs=1e-3)


def score_with(scorer, model, truth_dir, folder):
    from build123d import Compound, export_step

    from kerfwright.solid import assembly_solids

    solids = []
    for name, solid in assembly_solids(model):
        solid.label = name
        solids.append(solid)
    export_step(Compound(label="model", children=solids), str(folder / "model.step"))
    (folder / "report.json").write_text(json.dumps({"capture_from_model": capture_from_model().tolist()}))
    named = scorer.step_solids(folder / "model.step")
    place, capture_from_truth = scorer.truth_from_model(truth_dir, folder / "model.step")
    truth = json.loads((truth_dir / "truth.json").read_text())
    cloud = scorer.cloud_in_truth(truth_dir, capture_from_truth)
    got, _ = scorer.figures(truth, [scorer.mesh(s) for _, s in named], [n for n, _ in named], place, cloud)
    volume = scorer.interference([s for _, s in named]) * float(np.linalg.det(place[:3, :3]))
    return got | {"interference_mm3": volume}
