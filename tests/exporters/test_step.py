"""STEP read back by another program's reader: names, places, colours, volumes; the same bytes from every process."""

import hashlib
import re
import subprocess
import sys

import pytest

from kerfwright.errors import ExportError
from kerfwright.model import Model, write_model
from kerfwright.solid import assembly_solids
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.naming import board_colours
from kerfwright_exporters.step import export, export_ap214
from simple import stool
from truths import AVAILABLE, truth_model, truth_solids


def cadquery_volumes(path) -> list[float]:
    import cadquery

    return [solid.Volume() for solid in cadquery.importers.importStep(str(path)).solids().vals()]


def tree(path):
    from build123d import import_step

    root = import_step(str(path))
    return root.label, {child.label: child for child in root.children}


def test_names_places_and_colours(tmp_path):
    (path,) = export(stool(), tmp_path, ExportOptions())
    label, parts = tree(path)
    assert label == "stool" and list(parts) == ["top", "leg_left", "leg_right"]  # build123d writes blanks so
    assert "PRODUCT('leg left'" in path.read_text()
    for (name, solid), rgb in zip(assembly_solids(stool()), board_colours(stool()), strict=True):
        found = parts[name.replace(" ", "_")]
        assert found.volume == pytest.approx(solid.volume, rel=1e-9)
        assert (found.center() - solid.center()).length < 1e-6
        srgb = [12.92 * c if c < 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055 for c in tuple(found.color)[:3]]
        assert srgb == pytest.approx(rgb, abs=0.002)


def test_protocols_units_and_nothing_left_behind(tmp_path):
    (new,), (old,) = (e(stool(), tmp_path, ExportOptions()) for e in (export, export_ap214))
    assert re.search(r"FILE_SCHEMA\(\(\s*'AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF", new.read_text())
    assert re.search(r"FILE_SCHEMA\(\(\s*'AUTOMOTIVE_DESIGN", old.read_text())
    assert all("SI_UNIT(.MILLI.,.METRE.)" in p.read_text() for p in (new, old))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["model.step", "model_ap214.step"]
    assert cadquery_volumes(old) == pytest.approx([s.volume for _, s in assembly_solids(stool())], rel=1e-6)


def test_same_bytes_again_and_from_another_process(tmp_path):
    for folder in ("a", "b", "c"):
        (tmp_path / folder).mkdir()
    (first,), (second,) = (export(stool(), tmp_path / folder, ExportOptions()) for folder in "ab")
    assert first.read_bytes() == second.read_bytes()
    write_model(stool(), tmp_path / "model.json")
    code = (
        "import sys; from pathlib import Path; from kerfwright.model import read_model; "
        "from kerfwright_exporters.step import export; from kerfwright_exporters import ExportOptions; "
        "export(read_model(sys.argv[1]), Path(sys.argv[2]), ExportOptions())"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path / "model.json", tmp_path / "c"], check=True)
    digest = [hashlib.sha256((tmp_path / f / "model.step").read_bytes()).hexdigest() for f in "ac"]
    assert digest[0] == digest[1]


def test_unverified_files_say_so(tmp_path):
    (path,) = export(stool(), tmp_path, ExportOptions(unverified=True))
    assert "FILE_NAME('stool NOT VERIFIED'" in path.read_text() and tree(path)[0] == "stool_NOT_VERIFIED"


def test_an_empty_model_is_refused(tmp_path):
    with pytest.raises(ExportError, match="at least one board"):
        export(Model(), tmp_path, ExportOptions())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not AVAILABLE, reason="the captures with truth are not on this machine")
@pytest.mark.parametrize("name", AVAILABLE)
def test_truths_keep_their_volumes_in_an_independent_reader(name, tmp_path):
    (path,) = export(truth_model(name), tmp_path, ExportOptions())
    expected = [solid.volume for _, solid in assembly_solids(truth_model(name))]
    assert cadquery_volumes(path) == pytest.approx(expected, rel=1e-6)
    assert list(tree(path)[1]) == list(truth_solids(name))
