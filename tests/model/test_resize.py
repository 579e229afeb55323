"""A stool with a hole, a bevel and contacts, resized by 2.7 and turned."""

import numpy as np
import pytest

from kerfwright.model import Bevel, Quantity
from kerfwright.model.frames import matrix
from kerfwright.model.resize import resized_board, resized_contact
from simple import bevel, board, hole, placed, rectangle, stool

SCALE = 2.7


def similarity(scale: float = SCALE) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    moved = np.eye(4)
    moved[:3, :3] = scale * Rotation.from_euler("xyz", [20, -35, 70], degrees=True).as_matrix()
    moved[:3, 3] = 12.0, -300.0, 45.0
    return moved


def bevelled():
    cut = bevel((200.0, 0.0), (200.0, 100.0), 20.0)
    return board(
        rectangle(200, 100), pose=placed((0, 1, 0), (0, 0, 1), (5, 6, 7)), holes=(hole(60, 50, 20),), bevels=(cut,)
    )


def test_volumes_grow_with_the_cube_of_the_scale():
    from kerfwright.solid import board_solid

    before, after = board_solid(bevelled()), board_solid(resized_board(bevelled(), similarity()))
    assert after.volume == pytest.approx(SCALE**3 * before.volume, rel=1e-9)
    assert after.area == pytest.approx(SCALE**2 * before.area, rel=1e-9)


def test_every_point_of_a_board_moves_by_the_similarity():
    """Corners of the board, carried by the board's own frame, land where the similarity puts them."""
    new_from_model = similarity()
    before, after = bevelled(), resized_board(bevelled(), new_from_model)
    for old, new in zip(before.cut_path.outer.edges, after.cut_path.outer.edges, strict=True):
        there = matrix(before.model_from_board) @ [*old.start, before.thickness.value, 1.0]
        assert matrix(after.model_from_board) @ [*new.start, after.thickness.value, 1.0] == pytest.approx(
            new_from_model @ there
        )


def test_poses_stay_rigid_and_angles_stay():
    after = resized_board(bevelled(), similarity())
    turn = matrix(after.model_from_board)[:3, :3]
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
    assert after.bevels[0].angle == bevelled().bevels[0].angle
    assert after.bevels[0].normal == pytest.approx(bevelled().bevels[0].normal)
    assert after.cut_path.holes[0].edges[0].radius == pytest.approx(20 * SCALE)


def test_standard_errors_scale_where_there_are_any():
    plain = bevelled().model_copy(update={"thickness": Quantity(value=16.0, standard_error=0.2)})
    assert resized_board(plain, similarity()).thickness.standard_error == pytest.approx(0.2 * SCALE)
    assert resized_board(bevelled(), similarity()).thickness.standard_error is None


def test_there_and_back_changes_nothing():
    new_from_model = similarity()
    there = resized_board(bevelled(), new_from_model)
    back = resized_board(there, np.linalg.inv(new_from_model))
    assert matrix(back.model_from_board) == pytest.approx(matrix(bevelled().model_from_board), abs=1e-9)
    assert back.thickness.value == pytest.approx(16.0)
    for a, b in zip(back.cut_path.outer.edges, bevelled().cut_path.outer.edges, strict=True):
        assert (*a.start, *a.end) == pytest.approx((*b.start, *b.end), abs=1e-9)
    for field in ("start", "end", "point", "normal"):
        assert getattr(back.bevels[0], field) == pytest.approx(getattr(bevelled().bevels[0], field), abs=1e-9)


def test_identity_changes_nothing_at_all():
    same = resized_board(bevelled(), np.eye(4))
    assert same.cut_path == bevelled().cut_path
    assert isinstance(same.bevels[0], Bevel)


@pytest.mark.parametrize("contact", stool().contacts, ids=lambda c: c.b)
def test_contacts_move_with_their_boards(contact):
    new_from_model = similarity()
    after = resized_contact(contact, new_from_model)
    assert after.area == pytest.approx(contact.area * SCALE**2)
    assert (new_from_model @ [*contact.point, 1.0])[:3] == pytest.approx(after.point)
    assert after.normal == pytest.approx(new_from_model[:3, :3] @ contact.normal / SCALE)
    assert (after.type, after.angle) == (contact.type, contact.angle)
    for old, new in zip(contact.interface, after.interface, strict=True):
        for p, q in zip(old, new, strict=True):
            assert (new_from_model @ [*p, 1.0])[:3] == pytest.approx(q)
