"""`kerfwright synth`: a capture of an object that never was, with its truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kerfwright.commands.reconstruct import Seed
from kerfwright.errors import OptionError

__all__ = ["synth"]


def synth(
    family: Annotated[str, typer.Argument(metavar="FAMILY", help="Kind of object; a wrong one lists them all.")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT", help="Folder for the capture; made if need be.")],
    seed: Seed = 0,
    boards: Annotated[int | None, typer.Option("--boards", help="How many, for families that can be asked.")] = None,
    preset: Annotated[
        str, typer.Option("--preset", metavar="PRESET", help="Cameras, light and noise; a wrong one lists them all.")
    ] = "plain",
) -> None:
    """Make a capture of a random object, photographs, cloud and truth."""
    from kerfwright.output import OutputFolder
    from kerfwright.synthetic import PRESETS, random_assembly, write_capture

    if preset not in PRESETS:
        raise OptionError(f"--preset: {preset}: not known: take one of {', '.join(sorted(PRESETS))}")
    assembly = random_assembly(family, seed, boards)
    with OutputFolder(out).claimed() as folder:
        folder.write(lambda partial: write_capture(assembly, partial, PRESETS[preset].seeded(seed)))
    typer.echo(f"{len(assembly.boards)} boards in {out}: kerfwright reconstruct {out} -o {out}-plans")
