"""SVG read back with svgpathtools: sizes, areas, Shaper attributes."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import svgpathtools

from kerfwright.model import Arc, Bezier, Line, Loop, Model
from kerfwright.model.geometry import path_area
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.svg import SHAPER, export
from simple import bevel, board, hole, rectangle
from truths import AVAILABLE, truth_model

NAMESPACE = {"svg": "http://www.w3.org/2000/svg"}
WAVY = Loop(
    edges=(
        Line(start=(0, 0), end=(300, 0)),
        Arc(start=(300, 0), mid=(312, 30), end=(300, 60)),
        Bezier(start=(300, 60), control_1=(220, 110), control_2=(80, 10), end=(0, 60)),
        Line(start=(0, 60), end=(0, 0)),
    )
)


def wavy() -> Model:
    return Model(boards=(board(WAVY, "wavy", holes=(hole(50, 25, 8),)),))


def net_area(path) -> float:
    """Outline less holes, in the file's unit squared; SVG's y points down, so that outlines come out negative."""
    root = ElementTree.parse(path).getroot()
    total = 0.0
    for element in root:
        kind = element.get(f"{{{SHAPER}}}cutType")
        if kind not in ("outside", "inside"):
            continue
        if element.tag.endswith("circle"):
            area = np.pi * float(element.get("r")) ** 2
        else:
            area = abs(flat_area(svgpathtools.parse_path(element.get("d"))))
        total += area if kind == "outside" else -area
    return total


def flat_area(path) -> float:
    points = np.array([segment.point(t) for segment in path for t in np.linspace(0, 1, 200, endpoint=False)])
    return float((points.real @ np.roll(points.imag, -1) - points.imag @ np.roll(points.real, -1)) / 2)


@pytest.mark.parametrize("options", [ExportOptions(), ExportOptions(splines=True), ExportOptions(units="in")])
def test_areas_and_real_size(options, tmp_path):
    (path,) = export(wavy(), tmp_path, options)
    root = ElementTree.parse(path).getroot()
    assert net_area(path) * options.per_unit**2 == pytest.approx(path_area(wavy().boards[0].cut_path), rel=2e-4)
    width = float(root.get("width").removesuffix(options.units))
    assert width == pytest.approx(float(root.get("viewBox").split()[2]))
    assert width * options.per_unit == pytest.approx(312 + 10, abs=0.2)
    assert (" C " in path.read_text()) == options.splines


def test_shaper_attributes_and_fills(tmp_path):
    (path,) = export(wavy(), tmp_path, ExportOptions(kerf=3))
    cuts = {
        (e.get(f"{{{SHAPER}}}cutType"), e.get("fill"), e.get(f"{{{SHAPER}}}cutDepth"))
        for e in ElementTree.parse(path).getroot()
        if e.get(f"{{{SHAPER}}}cutDepth")
    }
    assert cuts == {("outside", "black", "16mm"), ("inside", "white", "16mm"), ("online", "none", "16mm")}
    first = ElementTree.parse(path).getroot()[0]
    assert first.get("class") == "OUTSIDE"


def test_bevels_labels_and_stamp(tmp_path):
    one = board(rectangle(200, 100), "a&b <c>", bevels=(bevel((200, 0), (200, 100), 45),))
    (path,) = export(Model(boards=(one,)), tmp_path, ExportOptions(unverified=True))
    root = ElementTree.parse(path).getroot()
    texts = [e.text for e in root.findall("svg:text", NAMESPACE)]
    assert texts == ["a_b _c", "NOT VERIFIED", "BEVEL +45.0"] or texts == ["a_b _c_", "NOT VERIFIED", "BEVEL +45.0"]
    (line,) = root.findall("svg:line", NAMESPACE)
    assert (line.get("x1"), line.get("y1"), line.get("y2")) == ("200", "0", "-100")
    assert path.name.startswith("a_b")


@pytest.mark.skipif(not AVAILABLE, reason="the captures with truth are not on this machine")
@pytest.mark.parametrize("name", AVAILABLE)
def test_truths_keep_their_areas(name, tmp_path):
    model = truth_model(name)
    for one, path in zip(model.boards, export(model, tmp_path, ExportOptions()), strict=True):
        assert net_area(path) == pytest.approx(path_area(one.cut_path), rel=1e-3)
