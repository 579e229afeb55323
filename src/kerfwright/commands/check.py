"""`kerfwright check`: can the model be built?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from kerfwright.model import Finding

__all__ = ["check"]


def check(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="A model.json.")],
    as_json: Annotated[bool, typer.Option("--json", help="Findings as one JSON object a line.")] = False,
) -> None:
    """Check a model: valid solids, no overlap, snug contacts. Exit code 1 when something forbids cutting it."""
    from kerfwright.model.io import read_model

    loaded = read_model(model, strict=False)

    from kerfwright.solid import CheckOptions
    from kerfwright.solid import check as check_model

    findings = check_model(loaded, CheckOptions())
    for finding in findings:
        typer.echo(finding.model_dump_json() if as_json else _line(finding))
    errors = sum(f.severity == "error" for f in findings)
    if not as_json:
        typer.echo(f"{errors} errors, {sum(f.severity == 'warning' for f in findings)} warnings")
    raise typer.Exit(1 if errors else 0)


def _line(finding: Finding) -> str:
    remedy = f": {finding.remedy}" if finding.remedy else ""
    return f"{finding.code} {finding.severity}: {finding.message}{remedy}"
