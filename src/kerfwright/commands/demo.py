"""`kerfwright demo`: reconstruct the capture that ships."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from kerfwright.commands.reconstruct import run_reconstruct
from kerfwright.demo import demo_capture
from kerfwright.pipeline import ReconstructOptions
from kerfwright.progress import reporter_for

__all__ = ["demo"]


def demo(
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="OUT", help="Folder for the results.")
    ] = Path("kerfwright-demo"),
) -> None:
    """Reconstruct the stool that ships with kerfwright, from 20 photographs."""
    typer.echo("A stool of four boards, from 20 photographs and the stereo cloud made of them.", err=True)
    farewell = _what_came_out(out.resolve())
    raise typer.Exit(run_reconstruct(demo_capture(), out, ReconstructOptions(), reporter_for(sys.stderr), farewell))


def _what_came_out(out: Path) -> str:
    return f"""
The results are in {out}

  report.html    what came out, to look at: open it in a browser
  model.step     the assembly        freecad {out / "model.step"}
  parts/*.dxf    a cut path a board  librecad {out / "parts"}/*.dxf
  model.json     the model, for kerfwright check and kerfwright export
  report.json    figures and findings
  run.json       seconds and memory

Your own: kerfwright reconstruct CAPTURE -o OUT"""
