"""The file in which one keeps the options that one always gives.

TOML, one table a command, one key an option as on the command line without its dashes:

    [reconstruct]
    up = "y"
    jobs = 2
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kerfwright.errors import OptionError, shown

__all__ = ["CONFIGURABLE", "config_path", "default_config", "read_config"]

# command: option: (type, default as TOML, what it is). A default that is None is written as a comment.
_OPTIONS: dict[str, dict[str, tuple[type | tuple[type, ...], str | None, str]]] = {
    "reconstruct": {
        "up": (str, '"z"', "axis of the capture that is up: x, y, z, -x, -y, -z"),
        "scale": ((int, float, str), None, "millimetres a capture unit, or auto; not set: a unit is a metre"),
        "markers": (str, '""', "markers in the photographs and their side, such as 4x4_50:40mm; empty: none"),
        "stock": (str, '""', "thicknesses to snap to: metric, inch, or a list as 12,18,1/2in; empty: none"),
        "seed": (int, "0", "of the random generator"),
        "jobs": (int, None, "cores to use; not set: all"),
        "quiet": (bool, "false", "say nothing but errors"),
        "verbose": (bool, "false", "say more"),
    },
}
CONFIGURABLE = frozenset(_OPTIONS)


def config_path() -> Path:
    """Where the file is looked for (XDG Base Directory Specification)."""
    base = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(base) / "kerfwright" / "config.toml"


def default_config() -> str:
    """The file with every option at its default."""
    lines = ["# What is given on the command line goes before what is set here."]
    for command, options in _OPTIONS.items():
        lines += ["", f"[{command}]"]
        for name, (_, default, meaning) in options.items():
            lines += [f"# {meaning}", f"{name} = {default}" if default is not None else f"# {name} ="]
    return "\n".join(lines) + "\n"


def read_config(path: Path) -> dict[str, dict[str, Any]]:
    """Options by command, checked; empty when there is no file.

    Raises OptionError for a file that is not TOML, or an option that is unknown or of the wrong kind.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError) as error:
        raise OptionError(f"{path}: {shown(str(error))}: mend it, or delete it and run `kerfwright config`") from error
    for command, options in tables.items():
        _check_table(path, command, options)
    return tables


def _check_table(path: Path, command: str, options: Any) -> None:
    known = _OPTIONS.get(command)
    if known is None or not isinstance(options, Mapping):
        known_tables = ", ".join(f"[{c}]" for c in _OPTIONS)
        raise OptionError(f"{path}: [{shown(command)}]: not a table of options: use {known_tables}")
    for name, value in options.items():
        if name not in known:
            raise OptionError(f"{path}: {command}.{shown(name)}: no such option: use one of {', '.join(known)}")
        kinds = known[name][0]
        if not isinstance(value, kinds) or (isinstance(value, bool) and kinds is not bool):
            raise OptionError(f"{path}: {command}.{name}: {shown(value)}: wrong kind of value: {known[name][2]}")
