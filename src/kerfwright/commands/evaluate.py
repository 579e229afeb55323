"""`kerfwright evaluate`: how far a result is from a known truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = ["evaluate"]

# Figures that fit on a screen, with what they mean; --json has all of them.
_LINES = (
    ("boards", "{parts_matched} of {parts_true} matched, {parts_found} found"),
    ("overlap", "mean IoU {mean_iou:.3f}"),
    ("contacts", "{contacts_typed_right} of {contacts_true} right with their types, {contacts_found} found"),
    ("truth to model", "RMS {rmse_pct_truth_to_model:.3f} % of the largest side"),
    ("seen truth to model", "RMS {rmse_pct_seen_to_model:.3f} %"),
    ("cloud to model", "RMS {rmse_pct_cloud_to_model:.3f} % (to the truth: {rmse_pct_cloud_to_truth:.3f} %)"),
    ("interference", "{interference_mm3:.1f} mm3"),
    ("missing", "{missing}"),
    ("extra", "{extra}"),
    ("contacts missing", "{contacts_missing}"),
    ("contacts mistyped", "{contacts_mistyped}"),
    ("contacts extra", "{contacts_extra}"),
)


def evaluate(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder of results.")],
    truth: Annotated[Path, typer.Argument(metavar="TRUTH", help="Folder with truth.json, beside the capture's cloud.")],
    stage: Annotated[
        str | None, typer.Option("--stage", metavar="STAGE", help="Only what identify, assemble or refine knew.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Every figure, as one JSON object.")] = False,
) -> None:
    """Compare a result with the truth of its capture."""
    import json

    from kerfwright.evaluate import evaluate as evaluate_folder

    figures = evaluate_folder(out, truth, stage)
    typer.echo(json.dumps(figures) if as_json else "\n".join(_lines(figures)))


def _lines(figures: dict[str, Any]) -> list[str]:
    """The lines whose figures there are; lists that are empty say nothing."""
    shown = {k: ", ".join(map(str, v)) if isinstance(v, list) else v for k, v in figures.items() if v != []}
    lines = []
    for title, form in _LINES:
        try:
            lines.append(f"{title:<20} {form.format(**shown)}")
        except KeyError:
            continue
    return lines
