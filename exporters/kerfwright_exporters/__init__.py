"""What other programs read: one module a format, found by the entry points of the group `kerfwright.exporters`.

An exporter is a function `export(model, out_dir, options) -> list[Path]`. A package of your own adds a format by an
entry point of that group.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib.metadata import entry_points
from pathlib import Path

from kerfwright.errors import ExportError, OptionError, OutputError
from kerfwright.model import Finding, Model
from kerfwright_exporters.options import ExportOptions

__all__ = ["ExportOptions", "export_all", "exporter", "formats"]

GROUP = "kerfwright.exporters"
Exporter = Callable[[Model, Path, ExportOptions], list[Path]]


def formats() -> tuple[str, ...]:
    """Names of the formats installed, sorted."""
    return tuple(sorted({point.name for point in entry_points(group=GROUP)}))


def exporter(name: str) -> Exporter:
    """The function that writes a format.

    Raises
    ------
    OptionError
        If no exporter has that name.
    """
    found = sorted((p for p in entry_points(group=GROUP) if p.name == name), key=lambda p: p.value)
    if not found:
        raise OptionError(f"format: {name!r}: unknown: choose from {', '.join(formats())}")
    return found[0].load()


def export_all(
    model: Model,
    names: Iterable[str],
    out_dir: str | Path,
    options: ExportOptions | None = None,
    *,
    force: bool = False,
    findings: tuple[Finding, ...] | None = None,
) -> list[Path]:
    """Check the model, then write it in several formats.

    Parameters
    ----------
    model : the assembly
    names : formats, see `formats()`
    out_dir : folder, made if it is not there
    options : what a person may choose
    force : export in spite of errors; the files are then stamped NOT VERIFIED
    findings : what the checker said of this very model; left out, the checker runs here

    Returns
    -------
    The files written, in order.

    Raises
    ------
    OptionError
        If a format is unknown; nothing is written.
    ExportError
        If the checker finds an error and `force` is not given, or a format cannot express the model.
    OutputError
        If the folder cannot be written.
    """
    from dataclasses import replace

    writers = [exporter(name) for name in dict.fromkeys(names)]
    options = options or ExportOptions()
    if findings is None:
        from kerfwright.solid import check

        findings = check(model)
    errors = [f for f in findings if f.severity == "error"]
    if errors and not force:
        raise ExportError(_refusal(errors))
    options = replace(options, unverified=options.unverified or bool(errors))
    return [path for writer in writers for path in writer(model, _folder(out_dir), options)]


def _refusal(errors: list[Finding]) -> str:
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    first = errors[0]
    return f"model: {first.code} {first.message}{more}: mend the model, or export with --force, stamped NOT VERIFIED"


def _folder(path: str | Path) -> Path:
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror}: give a folder that can be written") from error
    return folder
