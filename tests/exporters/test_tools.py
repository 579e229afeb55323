"""Tool paths and relief cuts against shapely and closed formulas."""

import ezdxf
import numpy as np
import pytest
import shapely

from kerfwright.errors import ExportError, OptionError
from kerfwright.model import Arc, Bezier, CutPath, Line, Loop, Model
from kerfwright.model.arcs import arc_loop
from kerfwright.model.geometry import reverse_loop, sample_loop, signed_area
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.drawing import board_drawing
from kerfwright_exporters.dxf import export
from kerfwright_exporters.offset import offset_loop
from kerfwright_exporters.relief import relieved_path
from simple import board, hole, polygon, rectangle

FORK = polygon([(0, 0), (100, 0), (100, 80), (60, 80), (60, 30), (40, 30), (40, 80), (0, 80)])
ROUND = Loop(
    edges=(
        Line(start=(0, 0), end=(100, 0)),
        Arc(start=(100, 0), mid=(120, 20), end=(100, 40)),
        Line(start=(100, 40), end=(70, 40)),
        Arc(start=(70, 40), mid=(50, 20), end=(30, 40)),
        Line(start=(30, 40), end=(0, 40)),
        Line(start=(0, 40), end=(0, 0)),
    )
)
WAVY = arc_loop(
    Loop(
        edges=(
            Line(start=(0, 0), end=(300, 0)),
            Line(start=(300, 0), end=(300, 60)),
            Bezier(start=(300, 60), control_1=(220, 110), control_2=(80, 10), end=(0, 60)),
            Line(start=(0, 60), end=(0, 0)),
        )
    ),
    0.05,
)


@pytest.mark.parametrize("loop", [FORK, ROUND, WAVY], ids=["fork", "round", "wavy"])
@pytest.mark.parametrize("distance", [0.5, 3.0, 6.35])
def test_the_tool_path_is_what_shapely_grows(loop, distance):
    path = offset_loop(loop, distance, "board")
    grown = shapely.Polygon(sample_loop(loop, 1e-3)).buffer(distance, quad_segs=256)
    found = shapely.Polygon(sample_loop(path, 1e-3))
    assert found.is_valid and found.area == pytest.approx(grown.area, rel=2e-5)
    assert shapely.hausdorff_distance(found.exterior, grown.exterior) < 0.6  # of samples; the areas tell the rest
    assert found.symmetric_difference(grown).area < 1e-4 * grown.area


@pytest.mark.parametrize("loop", [FORK, ROUND], ids=["fork", "round"])
def test_holes_shrink(loop):
    inside = reverse_loop(loop)
    path = offset_loop(inside, 3.0, "board")
    shrunk = shapely.Polygon(sample_loop(inside, 1e-3)).buffer(-3.0, quad_segs=256)
    assert -signed_area(path) == pytest.approx(shrunk.area, rel=1e-4)


def test_tools_that_do_not_fit_are_refused():
    with pytest.raises(ExportError, match=r"board 'shelf': kerf: 24 mm: .*: take a smaller tool"):
        offset_loop(FORK, 12.0, "shelf")
    with pytest.raises(ExportError, match="hole of radius 5 mm"):
        offset_loop(hole(0, 0, 5), 5.0, "shelf")
    with pytest.raises(ExportError, match="inside radius of 20 mm"):
        offset_loop(ROUND, 21.0, "shelf")
    with pytest.raises(OptionError, match="either kerf or splines"):
        ExportOptions(kerf=3, splines=True)


@pytest.mark.parametrize("kind", ["dogbone", "tbone"])
def test_reliefs_let_a_square_corner_in(kind):
    path = relieved_path(CutPath(outer=FORK), kind, 6.0, "board")
    polygon_ = shapely.Polygon(sample_loop(path.outer, 1e-3))
    assert polygon_.is_valid
    # taken away: for a dogbone half a disc beyond its chord, less the triangle of the void in front of it
    chord = 6.0 * np.sin(np.pi / 4)
    removed = {"dogbone": np.pi * 9 / 2 - chord**2 / 2, "tbone": np.pi * 9 / 2}[kind]
    assert signed_area(FORK) - signed_area(path.outer) == pytest.approx(2 * removed, rel=1e-9)
    # the tool, a disc of 6 mm, reaches the corner itself: the corner lies on what is left
    reach = shapely.Polygon(sample_loop(FORK)).exterior.convex_hull.buffer(50).difference(polygon_)
    opened = reach.buffer(-2.999, quad_segs=128).buffer(2.999, quad_segs=128)
    assert opened.distance(shapely.Point(60, 30)) < 0.05 and opened.distance(shapely.Point(40, 30)) < 0.05


@pytest.mark.parametrize("kind", ["dogbone", "tbone"])
def test_the_tool_follows_its_own_reliefs(kind):
    one = board(FORK, "fork")
    drawing = board_drawing(one, ExportOptions(relief=kind, tool_diameter=6, kerf=6))
    assert [c.operation for c in drawing.cuts] == ["outside", "outside_kerf"]
    assert shapely.Polygon(sample_loop(drawing.cuts[1].loop, 1e-3)).is_valid


def test_edges_too_short_for_their_reliefs_are_refused():
    with pytest.raises(ExportError, match=r"only 20\.0 mm long"):
        relieved_path(CutPath(outer=FORK), "dogbone", 16.0, "board")


def test_round_holes_need_no_relief():
    path = board(FORK, holes=(hole(20, 20, 6),)).cut_path
    assert relieved_path(path, "dogbone", 6.0, "fork").holes == path.holes


def test_round_corners_need_no_relief():
    assert relieved_path(CutPath(outer=WAVY), "dogbone", 6.0, "board").outer == WAVY


def test_kerf_is_drawn_beside_the_original(tmp_path):
    model = Model(boards=(board(rectangle(100, 50), "top", holes=(hole(30, 25, 10),)),))
    (path,) = export(model, tmp_path, ExportOptions(kerf=6))
    entities = {(e.dxftype(), e.dxf.layer) for e in ezdxf.readfile(path).modelspace()}
    assert {("CIRCLE", "INSIDE"), ("CIRCLE", "INSIDE_KERF"), ("LWPOLYLINE", "OUTSIDE_KERF")} <= entities
    kerf = ezdxf.readfile(path).modelspace().query('CIRCLE[layer=="INSIDE_KERF"]').first
    assert kerf.dxf.radius == pytest.approx(7)
