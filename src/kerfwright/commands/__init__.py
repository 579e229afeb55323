"""The subcommands, one module each; what is slow to import is imported when its command runs."""

from __future__ import annotations

from typing import Annotated

import typer

from kerfwright import __version__
from kerfwright.commands.check import check
from kerfwright.commands.demo import demo
from kerfwright.commands.export import export
from kerfwright.commands.reconstruct import reconstruct

__all__ = ["app"]

app = typer.Typer(
    name="kerfwright",
    help="From photographs of a piece of carpentry to the plans to build it again.",
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"kerfwright {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("-V", "--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


for command in (reconstruct, demo, check, export):
    app.command()(command)
