"""`kerfwright export`: files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["export"]


def export(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="A model.json.")],
    formats: Annotated[list[str], typer.Argument(metavar="FORMAT...", help="One or more; a wrong one lists them all.")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for the files; made if need be.")],
    force: Annotated[
        bool, typer.Option("--force", help="Export even what the checker forbids; the files say NOT VERIFIED.")
    ] = False,
) -> None:
    """Write MODEL as STEP, DXF, a build123d script, cut sheets and more."""
    from kerfwright_exporters import ExportOptions
    from kerfwright_exporters import export as export_model

    from kerfwright.model import read_model
    from kerfwright.output import OutputFolder

    loaded = read_model(model)

    def fill(folder: Path) -> None:
        for name in dict.fromkeys(formats):
            export_model(loaded, name, folder, ExportOptions(force=force))

    with OutputFolder(out).claimed() as folder:
        for path in folder.write(fill, keep_others=True):
            typer.echo(path)
