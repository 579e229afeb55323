"""`kerfwright poses`: cameras from photographs alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["poses"]


def poses(
    photographs: Annotated[Path, typer.Argument(metavar="PHOTOS", help="Folder of photographs.")],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="CAPTURE", help="Folder of the capture to be made.")
    ],
    several: Annotated[
        bool, typer.Option("--several", help="The photographs are of several cameras, or the zoom was moved.")
    ] = False,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the random generator.")] = 0,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="Say nothing but errors.")] = False,
) -> None:
    """Recover the cameras of PHOTOS with COLMAP (pip install pycolmap): all of a capture but its cloud."""
    from kerfwright.capture.recover import recover_cameras

    def say(text: str) -> None:
        if not quiet:
            typer.echo(text, err=True)

    found = recover_cameras(photographs, out, one_camera=not several, seed=seed, say=say)
    say(f"{found.placed} of {found.photographs} photographs placed, {found.points} points, {found.error:.2f} px off")
    say(f"The capture still needs its cloud, {out / 'cloud.ply'}: see docs/tutorial.md, The cloud.")
