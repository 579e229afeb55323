"""What goes into the output folder of a reconstruction.

`run.json` holds all that may differ from run to run; the other files are the same bytes for the same capture, options
and version.
"""

from __future__ import annotations

import json
import platform
import resource
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kerfwright import __version__
from kerfwright.errors import ExportError
from kerfwright.model import Model
from kerfwright.model.io import write_model
from kerfwright.progress import Reporter
from kerfwright.report.cutting import CutSheet, LaidPart
from kerfwright.report.figures import figures
from kerfwright.report.page import report_html
from kerfwright.versions import library_versions

if TYPE_CHECKING:
    from kerfwright.pipeline import Reconstruction

__all__ = ["write_results", "write_run"]


def write_results(found: Reconstruction, folder: Path) -> None:
    """Write model.json, report.json, report.html, model.step and parts/*.dxf."""
    from kerfwright_exporters import export_all
    from kerfwright_exporters.naming import board_colours

    model = found.model
    write_model(model, folder / "model.json")
    page = report_html(model, found.capture_in_model, board_colours(model), *_cut_sheets(model))
    (folder / "report.html").write_text(page, encoding="utf-8")
    _write_json(folder / "report.json", report(model))
    # To look at the files is how one finds out what is wrong with them; `force` stamps them NOT VERIFIED then.
    export_all(model, ("step", "dxf"), folder, force=True, findings=model.findings)


def _cut_sheets(model: Model) -> tuple[list[CutSheet], str]:
    """The boards on stock sheets of the usual size; or none, and why."""
    from kerfwright_exporters.options import ExportOptions
    from kerfwright_exporters.sheets import lay_sheets

    try:
        sheets = lay_sheets(model, ExportOptions())
    except ExportError as error:
        return [], str(error)
    return [
        CutSheet(
            sheet.thickness, sheet.length, sheet.width, sheet.utilisation,
            tuple(LaidPart(b.name, tuple(cut.loop for cut in b.drawing.cuts)) for b in sheet.boards),
        )
        for sheet in sheets
    ], ""  # fmt: skip


def report(model: Model) -> dict[str, Any]:
    """The figures, the findings and where the model lies in the capture."""
    return {
        "format": "kerfwright-report", "version": 1, "name": model.name,
        "capture_from_model": [list(row) for row in model.capture_from_model],
        "figures": figures(model),
        "findings": [finding.model_dump(mode="json") for finding in model.findings],
        "provenance": model.provenance.model_dump(mode="json"),
    }


def write_run(reporter: Reporter, path: Path) -> None:
    """Write times, peak memory and versions."""
    run = {
        "seconds": {name: round(seconds, 3) for name, seconds in reporter.seconds.items()},
        "cpu_seconds": {name: round(seconds, 3) for name, seconds in reporter.cpu_seconds.items()},
        "cached": reporter.reused,
        "peak_memory_gib": round(_peak_memory_gib(), 3),
        "kerfwright": __version__, "python": platform.python_version(), "system": platform.platform(),
        "versions": library_versions(),
    }
    _write_json(path, run)


def _peak_memory_gib() -> float:
    """Largest resident size that this process, or one that it waited for, has had."""
    unit = 1 if sys.platform == "darwin" else 1024  # getrusage counts kilobytes, but bytes on macOS
    peak = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return peak * unit / 2**30


def _write_json(path: Path, content: dict[str, Any]) -> None:
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
