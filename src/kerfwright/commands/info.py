"""`kerfwright info`: what a capture holds, and whether it is enough."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kerfwright.commands.reconstruct import Crop, Ground, ScaleMm, Up, checked_axis, checked_crop, checked_scale

if TYPE_CHECKING:
    from kerfwright.report.survey import Survey

__all__ = ["info"]


def info(
    capture: Annotated[Path, typer.Argument(metavar="CAPTURE", help="Folder with images, cameras and a cloud.")],
    up: Up = "z",
    scale: ScaleMm = None,
    crop: Crop = "auto",
    ground: Ground = None,
    as_json: Annotated[bool, typer.Option("--json", help="As one JSON object.")] = False,
) -> None:
    """Tell what CAPTURE holds, what is missing, and whether it is enough."""
    import json

    checked_axis(up)
    millimetres = checked_scale(scale)
    checked_crop(crop)
    from kerfwright.capture import PrepareOptions, crop_options, open_capture, prepare
    from kerfwright.report.survey import survey

    opened = open_capture(capture, up=up, millimetres_per_unit=millimetres)
    found = survey(prepare(opened, PrepareOptions(**crop_options(crop), ground=ground)))
    if as_json:
        findings = [f.model_dump(mode="json") for f in found.findings]
        typer.echo(json.dumps({**asdict(found), "findings": findings}))
    else:
        typer.echo(_page(found))


def _page(found: Survey) -> str:
    x, y, z = found.extent_mm
    lines = [
        f"photographs   {found.images}, {', '.join(found.image_sizes)}, {', '.join(found.camera_models)}",
        f"cloud         {found.points} points, {'with' if found.colours else 'without'} colours",
        f"size          {x:.0f} x {y:.0f} x {z:.0f} mm",
        f"scale         {found.millimetres_per_unit:g} mm a unit, {found.scale_origin}",
        f"widest gap    {found.widest_gap_deg:.0f} degrees round the object",
        f"resolution    {found.pixel_mm:.2f} mm a pixel",
        f"plain         {100 * found.plain_share:.0f} % of the surface shows little texture",
    ]
    if found.fitting_share is not None:
        lines.append(f"fit           the cloud lies where {100 * found.fitting_share:.0f} % of the photographs show it")
    lines += [f"{f.severity:<8} {f.code} {f.message}" + (f": {f.remedy}" if f.remedy else "") for f in found.findings]
    enough = not any(f.severity == "warning" and f.code != "K003" for f in found.findings)
    return "\n".join([*lines, "This is enough." if enough else "This may not be enough: see the warnings."])
