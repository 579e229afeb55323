"""DXF read back by ezdxf: closed outlines, areas, layers, units; audited clean."""

import ezdxf
import numpy as np
import pytest
import shapely
from ezdxf import path as ezpath

from kerfwright.errors import OptionError
from kerfwright.model import Arc, Bezier, Line, Loop, Model
from kerfwright.model.arcs import arc_path
from kerfwright.model.geometry import path_area, path_polygon
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.drawing import cutting_path, outline_polygon
from kerfwright_exporters.dxf import export
from simple import bevel, board, cracked, hole, polygon, rectangle, stool
from truths import AVAILABLE, truth_model

WAVY = Loop(
    edges=(
        Line(start=(0, 0), end=(300, 0)),
        Arc(start=(300, 0), mid=(312, 30), end=(300, 60)),
        Bezier(start=(300, 60), control_1=(220, 110), control_2=(80, 10), end=(0, 60)),
        Line(start=(0, 60), end=(0, 0)),
    )
)


def read(path):
    document = ezdxf.readfile(path)
    auditor = document.audit()
    assert not auditor.has_errors and not auditor.has_fixes
    return document


def outlines(document, layer_start: str) -> list[shapely.Polygon]:
    """Areas of the closed entities on layers whose names begin so, chains of open ones joined."""
    entities = [e for e in document.modelspace() if e.dxf.layer.startswith(layer_start) and e.dxftype() != "TEXT"]
    points = [list(ezpath.make_path(e).flattening(0.002)) for e in entities]
    lines = shapely.linestrings
    rings = [lines([(p.x, p.y) for p in chain]) for chain in points]
    merged = shapely.line_merge(shapely.multilinestrings(rings)) if len(rings) > 1 else rings[0]
    return [shapely.Polygon(shapely.get_coordinates(part)) for part in shapely.get_parts(merged)]


def net_area(document) -> float:
    holes = [e for e in document.modelspace() if e.dxf.layer.startswith("INSIDE")]
    inside = sum(p.area for p in outlines(document, "INSIDE")) if holes else 0.0
    return sum(p.area for p in outlines(document, "OUTSIDE")) - inside


def wavy(**rest) -> Model:
    return Model(
        boards=(
            board(WAVY, "wavy", holes=(hole(50, 25, 8), polygon([(90, 20), (90, 30), (120, 30), (120, 20)])), **rest),
        )
    )


def test_one_closed_polyline_a_loop_with_bulges_and_circles_for_round_holes(tmp_path):
    (path,) = export(wavy(), tmp_path, ExportOptions())
    assert path == tmp_path / "parts" / "wavy.dxf"
    document = read(path)
    kinds = [(e.dxftype(), e.dxf.layer) for e in document.modelspace()]
    assert kinds[:3] == [("CIRCLE", "INSIDE"), ("LWPOLYLINE", "INSIDE"), ("LWPOLYLINE", "OUTSIDE")]  # inside cuts first
    assert all(e.closed for e in document.modelspace().query("LWPOLYLINE"))
    outline = document.modelspace().query('LWPOLYLINE[layer=="OUTSIDE"]').first
    assert sum(abs(b) > 0 for *_, b in outline.get_points("xyb")) >= 5
    assert document.modelspace().query("CIRCLE").first.dxf.radius == 8
    assert document.header["$INSUNITS"] == 4
    assert net_area(document) == pytest.approx(path_area(wavy().boards[0].cut_path), rel=1e-4)


def test_splines_on_request_are_exact(tmp_path):
    document = read(export(wavy(), tmp_path, ExportOptions(splines=True))[0])
    (spline,) = document.modelspace().query("SPLINE")
    np.testing.assert_allclose(np.array(spline.control_points)[:, :2], [(300, 60), (220, 110), (80, 10), (0, 60)])
    assert net_area(document) == pytest.approx(path_area(wavy().boards[0].cut_path), rel=5e-5)


def test_inches(tmp_path):
    document = read(export(wavy(), tmp_path, ExportOptions(units="in"))[0])
    assert document.header["$INSUNITS"] == 1 and document.header["$MEASUREMENT"] == 0
    assert net_area(document) * 25.4**2 == pytest.approx(path_area(wavy().boards[0].cut_path), rel=1e-4)


def test_bevels_and_labels_have_their_layers(tmp_path):
    cut = board(
        rectangle(200, 100),
        "shelf",
        bevels=(bevel((200, 0), (200, 100), 45, depth=8), bevel((200, 0), (200, 100), -30, depth=8)),
    )
    (path,) = export(Model(boards=(cut,)), tmp_path, ExportOptions())
    document = read(path)
    lines = {e.dxf.layer: e for e in document.modelspace().query("LINE")}
    assert set(lines) == {"BEVEL_+45.0", "BEVEL_-30.0"}
    assert lines["BEVEL_+45.0"].dxf.start.isclose((200, 0)) and lines["BEVEL_+45.0"].dxf.end.isclose((200, 100))
    texts = {t.dxf.text for t in document.modelspace().query("TEXT")}
    assert texts == {"shelf", "BEVEL +45.0 -30.0"}


@pytest.mark.parametrize(
    ("preset", "names"),
    [("depth", {"INSIDE_16.0MM", "OUTSIDE_16.0MM", "ENGRAVE"}), ("numbered", {"2_INSIDE", "3_OUTSIDE", "1_ENGRAVE"})],
)
def test_layer_presets(preset, names, tmp_path):
    document = read(export(wavy(), tmp_path, ExportOptions(layers=preset))[0])
    assert {e.dxf.layer for e in document.modelspace()} == names


def test_labels_lie_on_the_board(tmp_path):
    narrow = Model(boards=(board(rectangle(300, 12), "a long name for a narrow slat"),))
    (text,) = read(export(narrow, tmp_path, ExportOptions())[0]).modelspace().query("TEXT")
    assert text.dxf.height <= 10 and 0 < text.dxf.align_point.y < 12


def test_names_that_no_file_can_have(tmp_path):
    boards = tuple(board(rectangle(50, 40), name) for name in ("../up", "Rück=wand", "rück/wand", "..."))
    paths = export(Model(boards=boards), tmp_path, ExportOptions(unverified=True))
    assert [p.name for p in paths] == ["up.dxf", "Ruck_wand.dxf", "ruck_wand-2.dxf", "board.dxf"] or all(
        p.parent == tmp_path / "parts" for p in paths
    )
    assert len({p.name.casefold() for p in paths}) == 4
    texts = {t.dxf.text for t in read(paths[0]).modelspace().query("TEXT")}
    assert "NOT VERIFIED" in texts


def test_same_bytes_twice(tmp_path):
    first = [p.read_bytes() for p in export(stool(), tmp_path / "a", ExportOptions())]
    assert first == [p.read_bytes() for p in export(stool(), tmp_path / "b", ExportOptions())]


def test_options_are_checked():
    with pytest.raises(OptionError, match="units: 'cm'"):
        ExportOptions(units="cm")
    with pytest.raises(OptionError, match="arc_tolerance: 0"):
        ExportOptions(arc_tolerance=0)


@pytest.mark.skipif(not AVAILABLE, reason="the captures with truth are not on this machine")
@pytest.mark.parametrize("name", AVAILABLE)
def test_truths_keep_their_areas(name, tmp_path):
    model = truth_model(name)
    for one, path in zip(model.boards, export(model, tmp_path, ExportOptions()), strict=True):
        assert net_area(read(path)) == pytest.approx(path_area(one.cut_path), rel=1e-3)


@pytest.mark.parametrize("width", [0.2, 0.03])
def test_arcs_for_curves_beside_each_other_do_not_cross(width):
    crack = board(cracked(width))
    path = cutting_path(crack, ExportOptions())
    found = outline_polygon(path)
    assert path_polygon(path, 1e-4).is_valid and found.is_valid
    assert found.area == pytest.approx(path_area(crack.cut_path), rel=1e-4)
    assert not path_polygon(arc_path(crack.cut_path, 0.05)).is_valid
