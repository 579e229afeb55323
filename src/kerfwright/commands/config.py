"""`kerfwright config`: keep the options that one always gives."""

from __future__ import annotations

from typing import Annotated

import typer

from kerfwright.errors import OutputError

__all__ = ["config"]


def config(
    show: Annotated[bool, typer.Option("--show", help="Show what the file would hold, and write nothing.")] = False,
) -> None:
    """Write a file of options with their defaults, to be edited."""
    from kerfwright.config import config_path, default_config

    if show:
        typer.echo(default_config(), nl=False)
        return
    path = config_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as stream:
            stream.write(default_config())
    except FileExistsError:
        raise OutputError(f"{path}: configuration: is there already: edit it, or delete it for a new one") from None
    except OSError as error:
        raise OutputError(f"{path}: configuration: {error.strerror}: point XDG_CONFIG_HOME elsewhere") from error
    typer.echo(path)
