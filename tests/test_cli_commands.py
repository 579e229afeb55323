"""The smaller commands, run in this process: OCCT takes seconds to import."""

import json
from importlib import import_module

import pytest

from kerfwright.demo import demo_capture
from kerfwright.model import Board, CutPath, Line, Loop, Model, Quantity
from kerfwright.model.io import write_model


def board(name: str, x: float, y: float = 0) -> Board:
    """A block of 100 x 50 on the floor, 20 thick."""
    corners = [(0, 0), (100, 0), (100, 50), (0, 50)]
    edges = tuple(Line(start=a, end=b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    pose = ((1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, 0), (0, 0, 0, 1))
    path = CutPath(outer=Loop(edges=edges))
    return Board(name=name, model_from_board=pose, thickness=Quantity(value=20), cut_path=path)


@pytest.fixture
def sound(tmp_path):
    write_model(Model(name="block", boards=(board("a", 0),)), tmp_path / "model.json")
    return tmp_path / "model.json"


@pytest.fixture
def overlapping(tmp_path):
    write_model(Model(name="blocks", boards=(board("a", 0), board("b", 60))), tmp_path / "model.json")
    return tmp_path / "model.json"


def test_check_passes_what_can_be_built(kerfwright, sound):
    done = kerfwright("check", sound)
    assert done.returncode == 0 and done.stdout.splitlines()[-1].startswith("0 errors"), done.stderr


def test_check_names_what_cannot(kerfwright, overlapping):
    done = kerfwright("check", overlapping)
    assert done.returncode == 1 and "K110 error: a and b" in done.stdout
    found = [json.loads(line) for line in kerfwright("check", overlapping, "--json").stdout.splitlines()]
    assert {"K110"} <= {f["code"] for f in found} and found[0]["boards"] == ["a", "b"]


def test_export_writes_and_lists_its_files(kerfwright, sound, tmp_path):
    done = kerfwright("export", sound, "step", "dxf", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(tmp_path / "out" / n) for n in ("model.step", "parts/a.dxf")]
    again = kerfwright("export", sound, "step214", "-o", tmp_path / "out")
    assert again.returncode == 0 and (tmp_path / "out" / "parts" / "a.dxf").exists(), "other files stay"


def test_export_is_forbidden_by_an_error_unless_forced(kerfwright, overlapping, tmp_path):
    done = kerfwright("export", overlapping, "step", "-o", tmp_path / "out")
    assert done.returncode == 1 and "K110" in done.stderr and not (tmp_path / "out").exists()
    forced = kerfwright("export", overlapping, "step", "-o", tmp_path / "out", "--force")
    assert forced.returncode == 0 and "NOT VERIFIED" in (tmp_path / "out" / "model.step").read_text()


def test_options_reach_the_checker(kerfwright, sound):
    assert "K206" in kerfwright("check", sound, "--sheet", "90x40").stdout
    assert "K206" not in kerfwright("check", sound.parent, "--sheet", "4x2in").stdout  # a folder of results will do


def test_options_reach_the_exporters(kerfwright, sound, tmp_path):
    done = kerfwright("export", sound, "dxf", "cutlist", "-o", tmp_path / "out", "--units", "in", "--layers", "depth")
    assert done.returncode == 0, done.stderr
    assert "OUTSIDE_0.787IN" in (tmp_path / "out" / "parts" / "a.dxf").read_text()
    assert '25/32"' in (tmp_path / "out" / "cutlist.md").read_text()
    kerf = kerfwright("export", sound, "dxf", "-o", tmp_path / "kerf", "--kerf", "1/8in")
    assert kerf.returncode == 0 and "OUTSIDE_KERF" in (tmp_path / "kerf" / "parts" / "a.dxf").read_text()


def test_all_formats_at_once(kerfwright, sound, tmp_path):
    done = kerfwright("export", sound, "all", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert {"model.step", "model.brep", "cutlist.csv", "model_cadquery.py"} <= {
        p.name for p in (tmp_path / "out").iterdir()
    }


def test_a_faulty_model_is_checked_and_not_exported(kerfwright, tmp_path):
    bad = board("a", 0).model_copy(update={"thickness": Quantity(value=0)})
    model = Model(name="bad", boards=(bad, board("b/c", 300), board("d", 600))).model_dump_json()
    (tmp_path / "model.json").write_text(model)
    done = kerfwright("check", tmp_path / "model.json")
    assert done.returncode == 1 and done.stdout.startswith("K101 error") and "K103 error" in done.stdout
    refused = kerfwright("export", tmp_path / "model.json", "step", "-o", tmp_path / "out", "--force")
    assert refused.returncode == 2 and refused.stderr.count("\n") == 1 and not (tmp_path / "out").exists()


CROSSING = {"kind": "line", "start": [0, 0], "end": [100, 50]}
FAULTS = {
    "other version": lambda d: d.update(version=9),
    "crossing": lambda d: d["boards"][0]["cut_path"]["outer"]["edges"].__setitem__(0, CROSSING),
    "zero thickness": lambda d: d["boards"][0]["thickness"].update(value=0),
    "slash": lambda d: d["boards"][0].update(name="a/b"),
    "quote": lambda d: d["boards"][0].update(name='a"b'),
    "formula": lambda d: d["boards"][0].update(name="=1+1"),
    "hidden letter": lambda d: d["boards"][0].update(name="a\u200b"),
    "two of one name": lambda d: d["boards"].append(d["boards"][0]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_models_that_no_file_can_hold_are_refused_in_one_line(kerfwright, sound, tmp_path, fault):
    data = json.loads(sound.read_text())
    FAULTS[fault](data)
    sound.write_text(json.dumps(data))
    done = kerfwright("export", sound, "all", "-o", tmp_path / "out", "--force")
    assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1, done.stderr
    assert str(sound) in done.stderr and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("export", "{}/model.json", "dxf", "-o", "{}/out", "--kerf", "wide"), ["--kerf: 'wide'", "1/4in"]),
        (("export", "{}/model.json", "dxf", "-o", "{}/out", "--units", "cm"), ["units: 'cm'", "mm or in"]),
        (("export", "{}/model.json", "sheets", "-o", "{}/out", "--sheet", "90x90"), ["'a'", "does not fit"]),
        (("export", "{}/model.json", "dxf", "-o", "{}/out", "--tool", "0"), ["tool_diameter: 0"]),
        (("check", "{}/model.json", "--saw", "-1"), ["bevel: -1"]),
        (("check", "{}/none.json"), ["none.json"]),
        (("export", "{}/model.json", "stl5", "-o", "{}/out"), ["stl5", "step"]),
        (("export", "{}/none.json", "step", "-o", "{}/out"), ["none.json"]),
        (("export", "{}/model.json", "step", "-o", "{}/model.json"), ["is a file"]),
        (("view", "{}"), ["report.html", "kerfwright reconstruct"]),
        (("info", "{}/none"), ["none"]),
        (("info", "{}", "--up", "w"), ["--up: w"]),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(kerfwright, sound, tmp_path, arguments, words):
    done = kerfwright(*(a.format(tmp_path) for a in arguments))
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("kerfwright: error: ") and done.stderr.count("\n") == 1, done.stderr
    assert all(word in done.stderr for word in words), done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["model.json"]


def test_info_of_the_shipped_capture(kerfwright):
    done = kerfwright("info", demo_capture())
    assert done.returncode == 0 and "20, 1024x768, PINHOLE" in done.stdout and "points, with colours" in done.stdout
    assert done.stdout.splitlines()[-1] == "This is enough."
    scaled = json.loads(kerfwright("info", demo_capture(), "--json", "--scale", 2000).stdout)
    assert scaled["scale_origin"] == "given" and 800 < scaled["extent_mm"][2] < 820


def test_doctor_finds_nothing_amiss_here(kerfwright):
    done = kerfwright("doctor")
    assert done.returncode == 0 and done.stdout.splitlines()[-1] == "All is well."


def test_doctor_finds_what_is_broken(kerfwright, monkeypatch, tmp_path):
    (tmp_path / "fragile.py").write_text("raise ImportError('libfoo.so.1: cannot open shared object file')")
    monkeypatch.syspath_prepend(tmp_path)
    modules = (("fragile", "fragile", "tests"), ("numpy", "numpy", "numbers"))
    monkeypatch.setattr(import_module("kerfwright.commands.doctor"), "_MODULES", modules)
    done = kerfwright("doctor")
    (bad,) = [line for line in done.stdout.splitlines() if line.startswith("BAD")]
    assert done.returncode == 1 and "fragile, for tests: libfoo.so.1" in bad and "pip install" in bad
    assert done.stdout.splitlines()[-1].startswith("1 problem")


def test_config_is_written_once_and_used(kerfwright, monkeypatch, tmp_path):
    shown = kerfwright("config", "--show").stdout
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    path = tmp_path / "kerfwright" / "config.toml"
    assert kerfwright("config").stdout.strip() == str(path) and shown == path.read_text()
    path.write_text('[reconstruct]\nup = "w"\n')
    again = kerfwright("config")
    assert again.returncode == 2 and "is there already" in again.stderr
    wrong = kerfwright("reconstruct", "c", "-o", tmp_path / "out")
    assert wrong.returncode == 2 and "--up: w" in wrong.stderr
    right = kerfwright("reconstruct", "c", "-o", tmp_path / "out", "--up", "y", "--scale", "-1")
    assert "--scale" in right.stderr, "the command line goes before the file"
    assert kerfwright("config", "--show").returncode == 0


def test_evaluate_tells_what_is_missing(kerfwright, sound, tmp_path):
    truth = demo_capture() / "truth"
    done = kerfwright("evaluate", tmp_path, truth)
    assert done.returncode == 0, done.stderr
    assert "0 of 4 matched, 1 found" in done.stdout and "leg_left" in done.stdout
    figures = json.loads(kerfwright("evaluate", tmp_path, truth, "--json").stdout)
    assert figures["parts_true"] == 4 and figures["extra"] == ["a"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("evaluate", "{}", "{}/none"), ["none"]),
        (("evaluate", "{}", "{}", "--stage", "guess"), ["guess", "identify"]),
        (("synth", "spaceship", "-o", "{}/out"), ["spaceship", "stool"]),
        (("synth", "stool", "-o", "{}/out", "--preset", "x"), ["--preset: x", "quick"]),
        (("synth", "stool", "-o", "{}/out", "--boards", "9"), ["boards: 9"]),
    ],
)
def test_bad_input_of_the_measuring_commands(kerfwright, sound, tmp_path, arguments, words):
    done = kerfwright(*(a.format(tmp_path) for a in arguments))
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert all(word in done.stderr for word in words), done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["model.json"]


def test_synth_makes_a_capture_that_opens(kerfwright, monkeypatch, tmp_path):
    from dataclasses import replace

    from kerfwright import synthetic
    from kerfwright.capture import open_capture

    quick = synthetic.PRESETS["quick"]
    dataset = replace(quick.dataset, images=2, width=96, height=72)
    images = replace(quick.images, floor_texels=64, room_nodes=12, light_rays=4, texels=0.02)
    tiny = replace(quick, dataset=dataset, images=images, cloud=replace(quick.cloud, points=2000, views=1))
    monkeypatch.setitem(synthetic.PRESETS, "quick", tiny)
    done = kerfwright("synth", "single", "-o", tmp_path / "out", "--preset", "quick")
    assert done.returncode == 0, done.stderr
    found = open_capture(tmp_path / "out")
    assert len(found.views) == 2 and len(found.cloud) > 100 and found.views[0].image().shape == (72, 96, 3)
    assert (tmp_path / "out" / "truth" / "truth.json").exists()
