"""`kerfwright check`: can the model be built?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kerfwright.lengths import length, size

if TYPE_CHECKING:
    from kerfwright.model import Finding

__all__ = ["SHEET", "Sheet", "Tool", "check", "model_file"]

SHEET = "2440x1220"
_SHOP, _FIT = "Your workshop", "How boards must fit (lengths in mm, or 1/4in)"

Tool = Annotated[
    str,
    typer.Option("--tool", metavar="LENGTH", rich_help_panel=_SHOP, help="Diameter of the bit: 6, 6mm, 1/4in."),
]
Sheet = Annotated[
    str,
    typer.Option("--sheet", metavar="LxW", rich_help_panel=_SHOP, help="Stock sheets, the grain along L: 96x48in."),
]


def check(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="A model.json, or a folder that has one.")],
    as_json: Annotated[bool, typer.Option("--json", help="Findings as one JSON object a line.")] = False,
    tool: Tool = "6",
    saw: Annotated[
        float, typer.Option("--saw", metavar="DEGREES", rich_help_panel=_SHOP, help="How far the saw tilts either way.")
    ] = 45.0,
    sheet: Sheet = SHEET,
    web: Annotated[
        str, typer.Option("--web", metavar="LENGTH", rich_help_panel=_SHOP, help="Narrowest web that stands cutting.")
    ] = "6",
    snug: Annotated[
        str, typer.Option("--snug", metavar="LENGTH", rich_help_panel=_FIT, help="Gap or overlap that is still tight.")
    ] = "0.01",
    reach: Annotated[
        str, typer.Option("--reach", metavar="LENGTH", rich_help_panel=_FIT, help="Gap from which boards do not touch.")
    ] = "0.5",
    ground: Annotated[
        str, typer.Option("--ground", metavar="LENGTH", rich_help_panel=_FIT, help="Height that counts as the floor.")
    ] = "1",
) -> None:
    """Check a model: valid solids, no overlap, snug contacts. Exit code 1 when something forbids cutting it."""
    lengths = {"tool_diameter": ("--tool", tool), "web": ("--web", web), "snug": ("--snug", snug),
               "reach": ("--reach", reach), "ground": ("--ground", ground)}  # fmt: skip
    wanted = {field: length(*said) for field, said in lengths.items()}
    wanted |= dict(zip(("sheet_length", "sheet_width"), size("--sheet", sheet), strict=True))
    findings = _findings(model, {**wanted, "bevel": saw})
    for finding in findings:
        typer.echo(finding.model_dump_json() if as_json else _line(finding))
    errors = sum(f.severity == "error" for f in findings)
    if not as_json:
        typer.echo(f"{errors} errors, {sum(f.severity == 'warning' for f in findings)} warnings")
    raise typer.Exit(1 if errors else 0)


def _findings(path: Path, wanted: dict[str, float]) -> tuple[Finding, ...]:
    """What the checker says of a model that may contradict itself."""
    from kerfwright.model.io import read_model

    loaded = read_model(model_file(path), strict=False)

    from kerfwright.solid import CheckOptions
    from kerfwright.solid import check as check_model

    return check_model(loaded, CheckOptions(**wanted))


def model_file(path: Path) -> Path:
    """The model in a folder of results, or the file itself."""
    return path / "model.json" if path.is_dir() else path


def _line(finding: Finding) -> str:
    remedy = f": {finding.remedy}" if finding.remedy else ""
    return f"{finding.code} {finding.severity}: {finding.message}{remedy}"
