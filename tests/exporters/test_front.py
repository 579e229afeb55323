"""The front that the command line calls: the checker first, all formats, nothing half-written."""

import pytest

from kerfwright.errors import ExportError, OptionError, OutputError
from kerfwright.model import Finding, Model
from kerfwright_exporters import ExportOptions, export_all, exporter, formats
from simple import board, rectangle, stool

ALL = ("brep", "cadquery", "cutlist", "dxf", "gltf", "script", "sheets", "step", "step214", "svg")


def broken() -> Model:
    """Two boards that run into each other, one of them with a name that no file can have."""
    return Model(boards=(board(rectangle(100, 50), "a/b"), board(rectangle(90, 40), "c")))


def test_every_format_is_found_and_writes(tmp_path):
    assert formats() == ALL
    paths = export_all(stool(), ALL, tmp_path)
    assert all(path.is_file() and path.stat().st_size > 100 for path in paths)
    assert len(set(paths)) == len(paths)
    assert sorted(p for p in tmp_path.rglob("*") if p.is_file()) == sorted(paths)  # and nothing else is left behind


def test_an_error_stops_the_export(tmp_path):
    with pytest.raises(ExportError, match=r"K101 .*--force"):
        export_all(broken(), ["step"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_forced_files_are_stamped(tmp_path):
    paths = export_all(broken(), ALL, tmp_path, force=True)
    texts = {".step", ".py", ".csv", ".md", ".svg", ".dxf"}
    for path in paths:
        if path.suffix in texts or path.name == "sheets.json":
            assert "NOT VERIFIED" in path.read_text(encoding="utf-8-sig"), path
    assert any(path.name == "model NOT VERIFIED.brep" for path in paths)


def test_findings_of_the_caller_are_trusted(tmp_path):
    error = Finding(code="K110", severity="error", message="top and leg run into each other")
    with pytest.raises(ExportError, match="top and leg"):
        export_all(stool(), ["cutlist"], tmp_path, findings=(error,))
    paths = export_all(broken(), ["cutlist"], tmp_path, findings=())
    assert "NOT VERIFIED" not in paths[1].read_text()


def test_bad_requests_get_one_line(tmp_path):
    with pytest.raises(OptionError, match="format: 'stl': unknown: choose from brep, cadquery"):
        export_all(stool(), ["step", "stl"], tmp_path / "out")
    assert not (tmp_path / "out").exists()
    with pytest.raises(OptionError):
        exporter("")
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="can be written"):
        export_all(stool(), ["step"], tmp_path / "file" / "out")


def test_options_reach_the_formats(tmp_path):
    _, table = export_all(stool(), ["cutlist"], tmp_path, ExportOptions(units="in"))
    assert '15 3/4"' in table.read_text()
