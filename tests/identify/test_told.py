from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import box

from clouds import cloud_only, pose
from kerfwright.capture.types import Cloud
from kerfwright.identify import IdentifyOptions, told
from kerfwright.identify.rims import Rim
from kerfwright.identify.thickness import ThicknessHypothesis
from kerfwright.identify.told import Known, told_by_others

NO_RIM = Rim(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, int), np.zeros(0, bool), np.zeros(0))
SCENE = SimpleNamespace(
    capture=cloud_only(Cloud(np.zeros((0, 3)), np.zeros((0, 3)))), around=None, photos=None, free=None,
    options=IdentifyOptions(), diameter=500.0, thickness_limits=(2.0, 80.0),
    is_broad=lambda piece: True,
)


def edge(value: float, support: float = 2.5, evidence: str = "photos") -> ThicknessHypothesis:
    return ThicknessHypothesis(value, 0.1, evidence, support)


def region(length: float, width: float, *hypotheses: ThicknessHypothesis, at: float = 0.0) -> Known:
    return Known((0,), pose((at, 0, 0)), box(0, 0, length, width), NO_RIM, hypotheses)


@pytest.fixture
def faint(monkeypatch):
    """What the photographs show faintly, by the region's place."""
    shown: dict[float, list[ThicknessHypothesis]] = {}
    monkeypatch.setattr(told, "from_photos", lambda frame, *_, **__: shown.get(float(frame[0, 3]), []))
    monkeypatch.setattr(told, "from_cut_faces", lambda *_: [])
    return shown


def test_faint_edges_that_two_slats_show_at_one_depth_count(faint):
    faint.update({0.0: [edge(6.6)], 100.0: [edge(9.5), edge(6.7, 2.2)]})
    found = told_by_others([region(400, 30), region(400, 35, at=100.0)], SCENE)
    assert [k.best.value for k in found] == [6.6, 6.7]


def test_a_faint_edge_that_no_other_board_shows_counts_for_nothing(faint):
    faint.update({0.0: [edge(6.6)]})
    alone, _ = told_by_others([region(400, 30), region(300, 100, edge(18.0), at=100.0)], SCENE)
    assert alone.best is None


def test_fainter_than_faint_is_nothing(faint):
    faint.update({0.0: [edge(6.6, 1.5)], 100.0: [edge(6.6, 1.5)]})
    assert [k.best for k in told_by_others([region(400, 30), region(400, 60, at=100.0)], SCENE)] == [None, None]


def test_a_board_of_the_same_size_is_as_thick(faint):
    seen = region(400, 200, edge(12.0, evidence="opposite"), at=50.0)
    dark, other = told_by_others([region(396, 204), seen], SCENE)
    assert dark.best.value == pytest.approx(12.0)
    assert dark.best.evidence == "twin"
    assert dark.told and not other.told
    assert other is seen


def test_a_frame_of_front_edges_is_no_twin_of_a_side(faint):
    frame = Known((0,), pose((0, 0, 0)), box(0, 0, 400, 200).difference(box(30, 30, 370, 170)), NO_RIM, ())
    side = region(400, 200, edge(12.0), at=50.0)
    assert told_by_others([frame, side], SCENE)[0].best is None


def test_twins_that_disagree_tell_nothing(faint):
    others = [region(400, 200, edge(t), at=t) for t in (12.0, 18.0)]
    assert told_by_others([region(400, 200), *others], SCENE)[0].best is None


def test_what_only_a_guess_gave_makes_no_twin(faint):
    ground = region(400, 200, edge(40.0, evidence="ground"), at=50.0)
    assert told_by_others([region(400, 200), ground], SCENE)[0].best is None


def test_cut_faces_in_the_cloud_say_more_than_a_guess(faint, monkeypatch):
    depths = [edge(11.0, 0.06, "cut"), edge(13.0, 0.1, "cut"), edge(60.0, 0.3, "cut")]
    monkeypatch.setattr(told, "from_cut_faces", lambda *_: depths)
    known, other = told_by_others([region(400, 200), region(300, 100, edge(18.0), at=100.0)], SCENE)
    assert (known.best.value, known.best.evidence, known.told) == (13.0, "cut", True), "60 is another board's"
    assert known.best.standard_error > 1.5
    assert other.best.value == 18.0
