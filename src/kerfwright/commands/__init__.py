"""The subcommands, one module each; what is slow to import is imported when its command runs."""

from __future__ import annotations

from typing import Annotated

import typer

from kerfwright import __version__
from kerfwright.commands.check import check
from kerfwright.commands.config import config
from kerfwright.commands.demo import demo
from kerfwright.commands.doctor import doctor
from kerfwright.commands.evaluate import evaluate
from kerfwright.commands.export import export
from kerfwright.commands.info import info
from kerfwright.commands.poses import poses
from kerfwright.commands.reconstruct import reconstruct
from kerfwright.commands.synth import synth
from kerfwright.commands.view import view
from kerfwright.config import CONFIGURABLE, config_path, read_config

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
    elif context.invoked_subcommand in CONFIGURABLE:
        context.default_map = read_config(config_path())


for command in (reconstruct, demo, poses, info, view, check, export, evaluate, synth, doctor, config):
    app.command()(command)
