from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from clouds import pose, sheet
from kerfwright.assemble.types import Assembly, ConstraintSegment
from kerfwright.errors import StageError
from kerfwright.model import Finding, Line
from kerfwright.model.geometry import edge_length, path_polygon
from kerfwright.refine import BoundaryLoop, Outline, RefineOptions, finish

NOTHING = np.zeros((0, 3))
CAPTURE = SimpleNamespace(  # a boundary point every millimetre
    cloud=SimpleNamespace(diameter=450.0, points=NOTHING, normals=NOTHING)
)
TOP_EDGE = ConstraintSegment(np.array([200.0, 120]), np.array([0.0, 120]), "contact", 0.15, contact=0)


def outline_of(region: Polygon, error: float = 0.3) -> Outline:
    points = np.asarray(region.segmentize(1.0).exterior.coords)[:-1]
    return Outline((BoundaryLoop(points, np.full(len(points), error)),), "images", views=5)


def finished(region: Polygon, *segments: ConstraintSegment, findings=()):
    rough = sheet("board_01", pose((0, 0, 50)), 18.0, region)
    assembly = Assembly((rough,), (), (segments,), findings)
    return finish.finished((outline_of(region),), assembly, CAPTURE, RefineOptions())


def test_a_traced_rectangle_becomes_four_lines_that_end_on_their_segment():
    """Traced 2 mm short of the contact."""
    refined = finished(box(0, 0, 200, 118), TOP_EDGE)
    (board,) = refined.boards
    assert all(isinstance(e, Line) for e in board.cut_path.outer.edges)
    assert sorted(edge_length(e) for e in board.cut_path.outer.edges) == pytest.approx([120, 120, 200, 200], abs=0.05)
    assert board.outline_origin == "images"
    assert refined.findings == ()


def test_a_spur_that_was_traced_along_the_board_it_ends_on_is_left_out():
    """4 mm wide, where the other board's shadow begins."""
    spur = Polygon([(195, 110), (200, 110), (204, 114), (204, 118), (195, 118)])
    (board,) = finished(box(0, 0, 200, 118).union(spur), TOP_EDGE).boards
    assert sorted(edge_length(e) for e in board.cut_path.outer.edges) == pytest.approx([120, 120, 200, 200], abs=0.5)


def test_a_boundary_that_cannot_be_fitted_becomes_a_polygon_and_says_so(monkeypatch):
    def fails(loops, segments, options):
        raise StageError("curves: too rough")

    monkeypatch.setattr(finish, "fit_curves", fails)
    refined = finished(box(0, 0, 200, 118), TOP_EDGE)
    (finding,) = refined.findings
    assert (finding.code, finding.severity, finding.boards) == ("K010", "warning", ("board_01",))
    assert "curves: too rough" in finding.message
    assert path_polygon(refined.boards[0].cut_path).area == pytest.approx(200 * 120, rel=1e-3)
    assert refined.boards[0].notes


def test_boards_that_are_alike_come_out_as_one_kind():
    regions = [Polygon([(0, 0), (200, 0), (160, 120), (0, 120)]), box(0, 0, 150, 60)]
    regions.append(Polygon([(0, 0), (120, 0), (120, 160), (0, 200)]))  # the first, turned over and round
    sheets = tuple(sheet(f"board_{k}", pose((0, 0, 50 * k)), 18.0, r) for k, r in enumerate(regions))
    assembly = Assembly(sheets, (), ((), (), ()))
    refined = finish.finished(tuple(map(outline_of, regions)), assembly, CAPTURE, RefineOptions())
    assert [(b.same_as, b.mirrored) for b in refined.boards] == [(None, False), (None, False), ("board_0", True)]
    assert path_polygon(refined.boards[2].cut_path).area == pytest.approx(path_polygon(refined.boards[0].cut_path).area)


def test_findings_of_the_assembly_are_handed_on():
    known = Finding(code="K002", severity="info", message="seen")
    assert finished(box(0, 0, 200, 120), findings=(known,)).findings[0] == known


def test_polygon_path_keeps_holes_and_runs_the_right_way():
    region = box(0, 0, 100, 80).difference(box(30, 30, 50, 50))
    path = finish.polygon_path(region, 0.5)
    assert path_polygon(path).symmetric_difference(region).area == pytest.approx(0, abs=1e-9)
    assert len(path.outer.edges) == 4
    assert len(path.holes) == 1


def test_polygon_path_drops_what_is_within_the_tolerance():
    wavy = Polygon([(x, 0.2 * (k % 2)) for k, x in enumerate(np.arange(0, 101, 2.0))] + [(100, 80), (0, 80)])
    assert len(finish.polygon_path(wavy, 0.5).outer.edges) == 4
