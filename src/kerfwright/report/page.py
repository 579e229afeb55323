"""report.html: the model, its boards, and what to doubt, in one file that opens without a network."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from kerfwright.model import Choice, Model
from kerfwright.report.cards import boards_section
from kerfwright.report.cutting import CutSheet, sheets_section
from kerfwright.report.deviation import Deviation, deviation
from kerfwright.report.meshes import board_meshes
from kerfwright.report.next_views import next_views
from kerfwright.report.photographs import photographs_section
from kerfwright.report.scene import scene
from kerfwright.report.tables import contacts_section, findings_section, next_section
from kerfwright.report.views import best_views

if TYPE_CHECKING:
    from kerfwright.capture.types import Capture

__all__ = ["report_html"]

Colour = tuple[float, float, float]

NO_GAP = 1e-6  # of the objective; what is left of it is rounding

_SCALES = {
    "assumed": "assumed: measure a board before you cut", "given": "given", "file": "of the cloud's format",
    "measured": "measured", "inferred": "guessed from the boards",
}


def report_html(
    model: Model,
    capture: Capture | None,
    colours: Sequence[Colour],
    sheets: Sequence[CutSheet] = (),
    sheets_problem: str = "",
) -> str:
    """The whole page; without a capture, without photographs and distances.

    Raises
    ------
    ModelError when a board has no solid; CaptureError when a photograph cannot be read.
    """
    meshes = board_meshes(model)
    cloud = deviation(meshes, capture.cloud.points if capture else np.zeros((0, 3)))
    full_scale = max(0.5, round(cloud.percentile(95), 1))
    views = best_views(capture.views, cloud.points) if capture and len(cloud.points) else []
    assets = files("kerfwright.report") / "assets"
    data = json.dumps(scene(meshes, colours, cloud, full_scale), ensure_ascii=True).replace("<", "\\u003c")
    return "\n".join([
        "<!doctype html>", '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(model.name)}: kerfwright</title>",
        f"<style>{(assets / 'page.css').read_text()}</style></head><body class=\"outline\">",
        _head(model), _stage(cloud, full_scale), photographs_section(views, meshes, colours),
        boards_section(model, colours), sheets_section(sheets, sheets_problem), contacts_section(model.contacts),
        findings_section(model.findings),
        next_section(next_views(meshes, capture.views)) if capture else "", _foot(model),
        f'<script type="application/json" id="scene">{data}</script>',
        f"<script>{(assets / 'viewer.js').read_text()}</script>", "</body></html>", "",
    ])


def _head(model: Model) -> str:
    boards, distinct = len(model.boards), len({b.same_as or b.name for b in model.boards})
    scale = model.scale
    how = _SCALES[scale.origin]
    return (
        f"<h1>{escape(model.name)}</h1>"
        f'<p class="sum">{boards} boards, {distinct} different; {len(model.contacts)} contacts. '
        f"Scale: 1 capture unit = {scale.millimetres_per_unit:g} mm, {how}. {escape(scale.note)}</p>"
    )


def _stage(cloud: Deviation, full_scale: float) -> str:
    measured = (
        f'<label><input type="checkbox" id="cloud"> cloud, coloured by its distance</label>'
        f'<span>−{full_scale:g} mm <span class="legend"></span> +{full_scale:g} mm</span>'
        f"<span>RMS {cloud.rms:.2f} mm, 95 % within {cloud.percentile(95):.2f} mm</span>"
        if len(cloud.points) else '<input type="checkbox" id="cloud" hidden>'
    )
    return (
        '<h2>Assembly</h2><div class="stage"><canvas tabindex="0" aria-label="The boards in 3-D"></canvas>'
        '<div class="name"></div><div class="missing" hidden>This browser shows no 3-D (WebGL 2 is off).</div></div>'
        '<div class="controls"><label>exploded '
        '<input type="range" id="explode" min="0" max="1.5" step="0.01" value="0"></label>'
        f'<button id="home" type="button">as at first</button>{measured}</div>'
        '<p class="sum">Drag to turn, wheel to come near, shift and drag to move; click a board for its card.</p>'
    )


def _foot(model: Model) -> str:
    made = model.provenance
    return (
        f"<footer>{escape(made.program)} {escape(made.version)} from {escape(made.capture) or 'a model'}: "
        f"{made.images} photographs, {made.points} points, seed {made.seed}.{_chosen(made.choice)}</footer>"
    )


def _chosen(choice: Choice | None) -> str:
    """How the boards were chosen, for those who want to know how sure that is."""
    if choice is None:
        return ""
    proven = "not proven best"
    if choice.gap is not None:
        proven = "proven best" if choice.gap < NO_GAP else f"no choice is better by more than {choice.gap:.2g}"
    return (
        f" {choice.chosen} of {choice.candidates} candidates chosen, which explain {100 * choice.explained:.0f} % of "
        f"the cloud; objective {choice.objective:.4f} ({choice.method}), {proven}."
    )
