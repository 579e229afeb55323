"""`kerfwright export`: files for other programs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kerfwright.commands.check import SHEET, Sheet, Tool, model_file
from kerfwright.commands.reconstruct import say_errors
from kerfwright.lengths import length, size

if TYPE_CHECKING:
    from kerfwright_exporters import ExportOptions

__all__ = ["export"]

_DRAWN, _CUT, _LAID = "Drawings: dxf, svg, sheets, cutlist", "Cutting: dxf, svg, sheets", "Laying out: sheets"

Force = Annotated[
    bool, typer.Option("--force", help="Export even what the checker forbids; the files say NOT VERIFIED.")
]
Units = Annotated[str, typer.Option("--units", metavar="UNIT", rich_help_panel=_DRAWN, help="mm or in.")]
Layers = Annotated[
    str, typer.Option("--layers", metavar="PRESET", rich_help_panel=_DRAWN, help="Layer names: plain, depth, numbered.")
]
Splines = Annotated[bool, typer.Option("--splines", rich_help_panel=_DRAWN, help="Beziers as splines, not as arcs.")]
Tolerance = Annotated[
    str, typer.Option("--tolerance", metavar="LENGTH", rich_help_panel=_DRAWN, help="How far arcs stray from Beziers.")
]
Mesh = Annotated[
    str, typer.Option("--mesh", metavar="LENGTH", rich_help_panel=_DRAWN, help="How far triangles stray, in gltf.")
]
Kerf = Annotated[
    str,
    typer.Option(
        "--kerf", metavar="LENGTH", rich_help_panel=_CUT, help="Width of the cut; draws the tool's path as well."
    ),
]
Relief = Annotated[
    str, typer.Option("--relief", metavar="KIND", rich_help_panel=_CUT, help="Inside corners: none, dogbone, tbone.")
]
Margin = Annotated[
    str, typer.Option("--margin", metavar="LENGTH", rich_help_panel=_LAID, help="Border of a sheet left unused.")
]
Spacing = Annotated[
    str, typer.Option("--spacing", metavar="LENGTH", rich_help_panel=_LAID, help="Between boards; the kerf, if wider.")
]
Grain = Annotated[
    bool, typer.Option("--grain", rich_help_panel=_LAID, help="Keep boards' x axes along the sheets' grain.")
]
Formats = Annotated[
    list[str],
    typer.Argument(
        metavar="FORMAT...", help="step, step214, script, cadquery, gltf, brep, dxf, svg, sheets, cutlist; or all."
    ),
]
Out = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for the files; made if need be.")]
ModelFile = Annotated[Path, typer.Argument(metavar="MODEL", help="A model.json, or a folder that has one.")]


def export(
    model: ModelFile,
    formats: Formats,
    out: Out,
    force: Force = False,
    units: Units = "mm",
    layers: Layers = "plain",
    splines: Splines = False,
    tolerance: Tolerance = "0.05",
    mesh: Mesh = "0.1",
    tool: Tool = "6",
    kerf: Kerf = "0",
    relief: Relief = "none",
    sheet: Sheet = SHEET,
    margin: Margin = "10",
    spacing: Spacing = "6",
    grain: Grain = False,
) -> None:
    """Write MODEL as STEP, DXF, a build123d script, cut sheets and more.

    Lengths are millimetres, 6 or 6mm, or inches, 1/4in. The checker runs first, with the same tool and sheets; an error
    stops the export.
    """
    from kerfwright_exporters import ExportOptions

    lengths = {"arc_tolerance": ("--tolerance", tolerance), "mesh_tolerance": ("--mesh", mesh),
               "kerf": ("--kerf", kerf), "tool_diameter": ("--tool", tool), "sheet_margin": ("--margin", margin),
               "spacing": ("--spacing", spacing)}  # fmt: skip
    wanted = {field: length(*said) for field, said in lengths.items()}
    wanted |= dict(zip(("sheet_length", "sheet_width"), size("--sheet", sheet), strict=True))
    options = ExportOptions(units=units, layers=layers, splines=splines, relief=relief, grain=grain, **wanted)
    _export(model_file(model), formats, out, options, force)


def _export(source: Path, formats: list[str], out: Path, options: ExportOptions, force: bool) -> None:
    """Check, then write all formats or none."""
    from kerfwright.model.io import read_model
    from kerfwright.output import OutputFolder
    from kerfwright.solid import CheckOptions, check
    from kerfwright_exporters import export_all, exporter
    from kerfwright_exporters import formats as all_formats

    names = all_formats() if formats == ["all"] else formats
    for name in names:
        exporter(name)  # an unknown format is an error before anything slow
    loaded = read_model(source)
    asked = ("tool_diameter", "sheet_length", "sheet_width")
    workshop = replace(CheckOptions(), **{field: getattr(options, field) for field in asked})
    with OutputFolder(out).claimed() as folder:
        findings = check(loaded, workshop)
        if say_errors(findings) and not force:
            typer.echo("kerfwright: not exported: mend the model, or --force it, stamped NOT VERIFIED", err=True)
            raise typer.Exit(1)

        def fill(partial: Path) -> None:
            export_all(loaded, names, partial, options, force=force, findings=findings)

        for path in folder.write(fill, keep_others=True):
            typer.echo(path)
