"""Boards laid on one another: the hidden face moves, and a contact of type 3 says so."""

import numpy as np
import pytest

from clouds import pose, sheet
from kerfwright.assemble import AssembleOptions
from kerfwright.assemble.laid import laid_contacts
from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.laid import laid_on, put_on_plane
from kerfwright.model import Origin, Quantity

BLIND = FreeSpace((), (), 1.0, 1.0)
OPTIONS = AssembleOptions()
GRID = np.stack(np.meshgrid(np.arange(-200, 201, 5.0), np.arange(-150, 151, 5.0)), axis=-1).reshape(-1, 2)
UNDERSIDE = np.c_[GRID, np.full(len(GRID), 410.0)]


def stool(thickness: float, bottom_seen: bool = True):
    """A seat from z = 410, its underside seen, and a rail of guessed thickness from z = 380."""
    under = np.abs(UNDERSIDE[:, 0]) > 31
    idx = np.flatnonzero(under) if bottom_seen else np.zeros(0, int)
    seat = sheet("seat", pose((0, 0, 410)), 20, (-200, -150, 200, 150), bottom_idx=idx)
    guess = Quantity(value=thickness, standard_error=4.0)
    rail = sheet("rail", pose((0, 0, 380)), thickness, (-30, -140, 30, 140), quantity=guess)
    return (seat, rail), Cloud(UNDERSIDE, np.tile([0, 0, -1.0], (len(UNDERSIDE), 1)))


@pytest.mark.parametrize("thickness", [22.0, 36.0])
def test_the_hidden_face_is_put_where_the_other_board_begins(thickness):
    sheets, cloud = stool(thickness)
    seat, rail = laid_on(sheets, cloud, BLIND, OPTIONS)
    assert (seat.world_from_board == sheets[0].world_from_board).all() and seat.thickness == sheets[0].thickness
    assert rail.thickness.value == pytest.approx(30) and rail.thickness.origin is Origin.IMPLIED
    assert rail.world_from_board[2, 3] == pytest.approx(380), "its seen side stays"
    (contact,) = laid_contacts((seat, rail), 7.0)
    assert contact.type == 3 and {contact.a, contact.b} == {"seat", "rail"}
    assert contact.area == pytest.approx(60 * 280)
    assert {(contact.a, contact.face_a), (contact.b, contact.face_b)} == {("seat", "bottom"), ("rail", "top")}
    assert np.array(contact.interface[0])[:, 2] == pytest.approx(410)
    towards = contact.normal[2] * (1 if contact.a == "rail" else -1)
    assert towards == pytest.approx(1), "from a to b"


def test_interface_runs_counter_clockwise_about_the_normal():
    sheets, cloud = stool(22.0)
    (contact,) = laid_contacts(laid_on(sheets, cloud, BLIND, OPTIONS), 7.0)
    ring = np.array(contact.interface[0])
    area = sum(np.cross(ring[k] - ring[0], ring[k + 1] - ring[0]) for k in range(1, len(ring) - 1)) / 2
    assert area @ np.array(contact.normal) == pytest.approx(contact.area)


def test_a_board_below_with_its_frame_turned_over():
    sheets, cloud = stool(22.0)
    over = pose((0, 0, 402), (1, 0, 0), (0, -1, 0))  # its z looks down: the face by the seat is its bottom
    rail = sheet("rail", over, 22, (-30, -140, 30, 140))
    moved = laid_on((sheets[0], rail), cloud, BLIND, OPTIONS)[1]
    assert moved.thickness.value == pytest.approx(30)
    assert moved.world_from_board[2, 3] == pytest.approx(410)
    assert len(laid_contacts((sheets[0], moved), 7.0)) == 1


def test_boards_further_apart_than_they_are_thick_are_left_alone():
    sheets, cloud = stool(14.0)
    assert laid_on(sheets, cloud, BLIND, OPTIONS) == sheets
    assert laid_contacts(sheets, 7.0) == []


def test_faces_that_are_both_seen_stay_apart():
    _, cloud = stool(26.0)
    top = np.c_[GRID, np.full(len(GRID), 406.0)]
    on_rail = (np.abs(GRID[:, 0]) < 30) & (np.abs(GRID[:, 1]) < 140)
    points = np.concatenate([cloud.points, top[on_rail]])
    seen = sheet("rail", pose((0, 0, 380)), 26, (-30, -140, 30, 140), top_idx=np.arange(len(cloud), len(points)))
    whole = sheet("seat", pose((0, 0, 410)), 20, (-200, -150, 200, 150), bottom_idx=np.arange(len(cloud)))
    normals = np.concatenate([cloud.normals, np.tile([0, 0, 1.0], (int(on_rail.sum()), 1))])
    moved = laid_on((whole, seen), Cloud(points, normals), BLIND, OPTIONS)
    assert moved[1].thickness.value == 26 and laid_contacts(moved, 7.0) == []


def test_a_board_far_off_the_plane_does_not_move_it():
    _, cloud = stool(22.0)
    at = (("a", 410, -150, 120), ("b", 418, 0, 90))
    slats = [sheet(name, pose((0, 0, z)), 20, (-200, y, 200, y + wide)) for name, z, y, wide in at]
    rail = sheet("rail", pose((0, 0, 380)), 24, (-30, -140, 30, 140))
    moved = laid_on((*slats, rail), cloud, BLIND, OPTIONS)
    assert [s.world_from_board[2, 3] for s in moved[:2]] == [410, 418]
    assert moved[2].thickness.value == pytest.approx(30), "it reaches the larger one exactly"


def test_slats_on_two_rails_are_made_flush():
    """Each slat has its own plane, within what can be measured; no rail could touch them all."""
    _, cloud = stool(22.0)
    at = [(410 + 0.1 * k, 110 * k - 150) for k in range(3)]
    slats = [sheet(f"slat {y}", pose((0, 0, z)), 20, (-200, y, 200, y + 90)) for z, y in at]
    rails = [sheet(f"rail {x}", pose((x, 0, 380)), 24, (-30, -140, 30, 140)) for x in (-100, 100)]
    moved = laid_on((*slats, *rails), cloud, BLIND, OPTIONS)
    assert [s.world_from_board[2, 3] for s in moved[:3]] == pytest.approx([410.1] * 3)
    assert [s.thickness.value for s in moved[3:]] == pytest.approx([30.1] * 2)
    assert len(laid_contacts(moved, 7.0)) == 6


def test_two_finds_of_one_board_are_not_laid_on_each_other():
    sheets, cloud = stool(22.0)
    again = sheet("again", pose((0, 0, 381)), 22, (-30, -140, 30, 0), quantity=sheets[1].thickness)
    assert all(s.thickness.value > 0 for s in laid_on((sheets[1], again), cloud, BLIND, OPTIONS))
    assert not laid_contacts(laid_on((sheets[1], again), cloud, BLIND, OPTIONS), 7.0)


def test_a_board_keeps_a_thickness():
    """A hidden face is not put where its board's other face is."""
    (_, rail), _ = stool(22.0)
    assert put_on_plane(rail, "top", np.array([0.0, 0.0, 1.0]), 380.0) is rail
    assert put_on_plane(rail, "top", np.array([0.0, 0.0, 1.0]), 410.0).thickness.value == pytest.approx(30)
