"""Sheet planes and thicknesses measured in photographs."""

from types import SimpleNamespace

import numpy as np
import pytest

from clouds import pose, sheet
from kerfwright.capture.types import Cloud
from kerfwright.identify import Candidates, Parts, made_whole
from kerfwright.identify.depths import _between, _easing, _Edges, _far_edge, _settled
from kerfwright.identify.faces import Faces, believed, measured_faces, robust_mean, stereo_bias
from kerfwright.identify.freespace import FreeSpace

SIZE = 500.0
TOP = 18.0  # where the true face is


class Grain:
    """Parallel views of a level face with a fine random grain, from four sides."""

    tilts = ((0.6, 0.0), (-0.6, 0.0), (0.0, 0.6), (0.0, -0.6), (0.4, 0.4))

    def __init__(self) -> None:
        rng = np.random.default_rng(5)
        self.waves, self.phases = rng.normal(0, 0.8, (40, 2)), rng.uniform(0, 6.3, 40)
        self.views = tuple(SimpleNamespace(centre=1e4 * np.array([-a, -b, 1.0]), project=self._to(a, b))
                           for a, b in self.tilts)  # fmt: skip

    @staticmethod
    def _to(a: float, b: float):
        return lambda x: (x[:, :2] + x[:, 2:] * np.array([a, b]), x[:, 2])

    def colours(self, k: int, places: np.ndarray) -> np.ndarray:
        on_face = self.views[k].project(places.reshape(-1, 3))[0] - TOP * np.array(self.tilts[k])
        grey = 100 + 10 * np.cos(on_face @ self.waves.T + self.phases).sum(axis=1)
        return np.repeat(grey[:, None], 3, axis=1).reshape(places.shape)


def board_with_points(height: float):
    """A board whose top plane and points lie at a height."""
    xy = np.random.default_rng(1).uniform(0, 200, (300, 2))
    cloud = Cloud(np.column_stack([xy, np.full(300, height)]), np.tile([0.0, 0, 1], (300, 1)))
    frame = pose((0, 0, height - TOP))
    return sheet("a", frame, TOP, (0, 0, 200, 200), top_idx=np.arange(300)), cloud


def test_grain_finds_a_face_that_stereo_puts_too_far_out(monkeypatch):
    board, cloud = board_with_points(TOP + 0.4)
    monkeypatch.setattr(Cloud, "diameter", SIZE, raising=False)
    faces = measured_faces([board], cloud, Grain(), noise=0.1)
    assert faces.offset[0, 0] == pytest.approx(-0.4, abs=0.06)
    assert faces.error[0, 0] < 0.1
    assert np.isinf(faces.error[0, 1])  # no points below


def test_what_well_seen_faces_say_of_stereo_is_their_common_bias():
    seen = [[(-0.4, 0.05), None], [(-0.5, 0.05), (-0.1, 0.05)], [None, None]]
    stereo = [[(0.0, 0.05), None], [(-0.1, 0.05), (0.3, 0.05)], [(0.0, 0.05), None]]
    bias, scatter = stereo_bias(seen, stereo, 0.1)
    assert bias == pytest.approx(-0.4)
    assert scatter == pytest.approx(0.1)
    assert stereo_bias(seen[:1], stereo[:1], 0.1) == (0.0, 0.2)  # one face is not enough


def test_grain_that_lies_off_a_face_s_points_is_not_believed():
    """The others stand off by .4; a shadow across the third face agrees between views 1.4 below its points."""
    seen = [[(-0.4, 0.05), None], [(-0.45, 0.05), None], [(-1.4, 0.09), None], [None, (-1.4, 0.09)]]
    stereo = [[(0.0, 0.05), None], [(0.0, 0.05), None], [(0.0, 0.1), None], [None, None]]
    kept = believed(seen, stereo, -0.4, 0.1)
    assert [row[0] is None for row in kept] == [False, False, True, True]
    assert kept[3][1] == (-1.4, 0.09)  # nothing speaks against it


def test_an_outlier_hardly_moves_the_robust_mean():
    mean, error = robust_mean(np.array([10.0, 10.02, 9.98, 10.0, 11.05]), np.full(5, 0.15))
    assert mean == pytest.approx(10.0, abs=0.01)
    assert 0.05 < error < 0.1


def test_a_board_ends_between_the_ends_of_its_easing():
    assert _far_edge([(17.4, 6.0), (18.6, 5.0)], SIZE) == (pytest.approx(18.0), True)
    assert _far_edge([(18.0, 6.0), (19.0, 2.0)], SIZE) == (18.0, False)


def test_easing_is_what_edges_lie_inside_of_measured_faces():
    faces = Faces(np.array([[0.0, 0], [0.1, 0], [0.0, 0]]), np.array([[0.05, np.inf], [0.05, np.inf], [np.inf] * 2]))
    edges = [_Edges(-0.3, -17.6, 0.1, False), _Edges(-0.3, -17.6, 0.1, False), _Edges(-2.0, -17.6, 0.1, False)]
    assert _easing(faces, edges) == pytest.approx(0.35)
    value, error = _between(edges[0], 0.05, 0.35, SIZE)
    assert value == pytest.approx(18.0)
    assert error < _between(edges[2], 0.05, 0.35, SIZE)[1]  # eased otherwise than the rest


@pytest.mark.parametrize(("top", "bottom", "height"), [(-0.4, np.nan, 17.6), (np.nan, 0.4, 17.6), (-0.4, 0.4, 17.6)])
def test_a_board_moves_to_the_faces_that_were_measured(top, bottom, height):
    """18 mm thick; the bottom face 0.4 mm further out puts the board lower."""
    error = np.where(np.isnan([top, bottom]), np.inf, 0.05)
    board = _settled(sheet("a", pose(), 18.0, (0, 0, 200, 200)), np.nan_to_num([top, bottom]), error, None, 0.0, SIZE)
    assert board.thickness.value == pytest.approx(18.0)
    assert board.to_world(np.array([[0.0, 0, 18.0]]))[0, 2] == pytest.approx(height, abs=0.01)


def test_boards_that_are_whole_lie_on_the_faces_that_photographs_show(monkeypatch):
    """Identification measures once it knows where boards end: stereo had this one .4 mm too high."""
    board, cloud = board_with_points(TOP + 0.4)
    monkeypatch.setattr(Cloud, "diameter", SIZE, raising=False)
    blind = FreeSpace((), (), 1.0, 1.0)
    found = Candidates(SimpleNamespace(cloud=cloud), None, blind, Grain(), [], [], [], None)
    (whole,) = made_whole(Parts((board,), (), 0.1), found).sheets
    assert whole.to_world(np.array([[100.0, 100, whole.thickness.value]]))[0, 2] == pytest.approx(TOP, abs=0.06)
