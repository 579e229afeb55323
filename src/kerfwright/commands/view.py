"""`kerfwright view`: open the report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kerfwright.errors import OutputError

__all__ = ["view"]


def view(out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder of results, or its report.html.")]) -> None:
    """Open the report of OUT in a browser."""
    import webbrowser

    page = out / "report.html" if out.is_dir() else out
    if not page.is_file():
        raise OutputError(f"{page}: report: not there: run `kerfwright reconstruct CAPTURE -o {out}` first")
    if not webbrowser.open(page.resolve().as_uri()):
        typer.echo(f"No browser here. Open {page.resolve()} on a machine that has one.")
