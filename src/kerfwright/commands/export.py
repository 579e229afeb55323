"""`kerfwright export`: files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kerfwright.commands.reconstruct import say_errors

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
    from kerfwright.model.io import read_model
    from kerfwright.output import OutputFolder
    from kerfwright.solid import check
    from kerfwright_exporters import export_all, exporter

    for name in formats:
        exporter(name)  # an unknown format is an error before anything slow
    loaded = read_model(model)
    with OutputFolder(out).claimed() as folder:
        findings = check(loaded)
        if say_errors(findings) and not force:
            typer.echo("kerfwright: not exported: mend the model, or --force it, stamped NOT VERIFIED", err=True)
            raise typer.Exit(1)
        for path in folder.write(
            lambda partial: export_all(loaded, formats, partial, force=force, findings=findings), keep_others=True
        ):
            typer.echo(path)
