"""Edges that photographs show where the cloud is wrong or silent: hidden faces and veils."""

from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from clouds import shelf_capture, shelf_parts
from kerfwright.assemble import AssembleOptions, backs, veils
from kerfwright.assemble.backs import measured_backs
from kerfwright.assemble.veils import still_open, unveiled
from kerfwright.capture.types import Cloud
from kerfwright.identify.faces import moved
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.photo_edges import Photos, SweepResult
from kerfwright.model import Origin, Quantity

OPTIONS = AssembleOptions()
BLIND = FreeSpace((), (), 1.0, 1.0)


def top_first():
    """The shelf's boards, the level one first."""
    return sorted(shelf_parts().sheets, key=lambda s: -abs(s.normal[2]))


def edge_at(place: float, shown: float, views: int = 6):
    """A stand-in for the sweep: photographs that show one edge, `place` mm on, in a share of their stretches."""

    def sweep_line(board, joint, face, photos, obstacles, low, high, step):
        offsets = np.arange(low, high, step)
        strength, persistence = np.ones(len(offsets)), np.full(len(offsets), 0.2)
        k = int(np.argmin(np.abs(offsets - place)))
        strength[k - 1 : k + 2], persistence[k] = (3, 6, 3), shown
        return SweepResult(offsets, strength, place, 0.1, 6.0, views, persistence)

    return sweep_line


def hidden_top():
    """The level board as if nobody had seen its underside, and the uprights that end there."""
    top, *rest = top_first()
    thick = top.thickness.value
    guess = Quantity(value=0.8 * thick, standard_error=5.0, origin=Origin.INFERRED)
    board = top.world_from_board.copy()
    board[:3, 3] += (thick - guess.value) * top.normal
    return replace(top, thickness=guess, thickness_seen=False, world_from_board=board), *rest


@pytest.mark.parametrize(("shown", "value", "seen"), [(0.7, 18.0, True), (0.3, None, False)])
def test_a_hidden_face_lies_where_clearly_more_than_usual_show_an_edge(monkeypatch, shown, value, seen):
    monkeypatch.setattr(backs, "sweep_line", edge_at(18.0, shown))
    boards, capture = hidden_top(), shelf_capture()
    found = measured_backs(boards, capture.cloud, Photos(capture), BLIND, OPTIONS)[0]
    assert found.thickness_seen == seen
    assert found.thickness.value == pytest.approx(value or boards[0].thickness.value, abs=0.15)
    tops = [(s.world_from_board @ [0, 0, s.thickness.value, 1])[2] for s in (found, boards[0])]
    assert tops[0] == pytest.approx(tops[1], abs=1e-6)


def test_without_boards_on_it_a_hidden_face_stays_inferred():
    top = replace(top_first()[0], thickness_seen=False)
    capture = shelf_capture()
    assert measured_backs((top,), capture.cloud, Photos(capture), BLIND, OPTIONS) == (top,)


def test_a_board_that_ends_on_a_third_one_says_nothing_of_a_hidden_face(monkeypatch):
    monkeypatch.setattr(backs, "sweep_line", edge_at(18.0, 0.7))
    boards, capture = hidden_top(), shelf_capture()
    beam = replace(moved(top_first()[0], -8.0), name="beam")
    assert not measured_backs((*boards, beam), capture.cloud, Photos(capture), BLIND, OPTIONS)[0].thickness_seen


def test_nor_does_one_whose_end_was_seen(monkeypatch):
    monkeypatch.setattr(backs, "sweep_line", edge_at(18.0, 0.7))
    (top, *uprights), capture = hidden_top(), shelf_capture()
    points, normals, ended = [capture.cloud.points], [capture.cloud.normals], []
    for upright in uprights:
        ring = np.asarray(upright.region.exterior.coords)
        xyz = upright.to_world(np.c_[ring, np.full(len(ring), 9)])
        end = np.linspace(*xyz[xyz[:, 2] > xyz[:, 2].max() - 2][[0, -1]], 60)
        first = sum(map(len, points))
        ended.append(replace(upright, cut_idx=np.arange(first, first + len(end))))
        points.append(end)
        normals.append(np.tile([0.0, 0, 1], (len(end), 1)))
    cloud = Cloud(np.concatenate(points), np.concatenate(normals))
    assert not measured_backs((top, *ended), cloud, Photos(capture), BLIND, OPTIONS)[0].thickness_seen


@pytest.mark.parametrize(("shown", "cut_back"), [(0.9, True), (0.4, False)])
def test_a_veil_is_cut_back_to_the_edge_in_the_photographs(monkeypatch, shown, cut_back):
    monkeypatch.setattr(veils, "sweep_line", edge_at(14.0, shown))
    top, capture = top_first()[0], shelf_capture()
    low_x, low_y, high_x, high_y = top.region.bounds
    beside = np.concatenate([top.top_idx, top.bottom_idx])
    veiled = replace(top, region=box(low_x, low_y, high_x, high_y + 14), top_idx=beside)
    (cut,), (edges,) = unveiled((veiled,), capture.cloud, Photos(capture), OPTIONS)
    assert (cut.region.bounds[3] == pytest.approx(high_y, abs=1.0)) == cut_back
    assert [e.origin for e in edges] == ["photo"] * cut_back
    assert still_open((edges,), (edges,)) == ((),)
    assert still_open((edges,), ((),)) == (edges,)


def test_an_outline_that_cut_faces_back_is_left_alone():
    top = top_first()[0]
    capture = shelf_capture()
    (same,), (edges,) = unveiled((top,), capture.cloud, Photos(capture), OPTIONS)
    assert same is top
    assert edges == ()
