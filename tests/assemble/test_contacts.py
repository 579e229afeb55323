"""Contacts on a photographed shelf, and on boards without photographs."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from clouds import box_cloud, cloud_only, pose, sheet, shelf_capture, shelf_parts
from kerfwright.assemble import AssembleOptions, assemble, contacts
from kerfwright.assemble.contacts import find_contacts, to_contact
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.seams import Seam

SHELF = sheet("shelf", pose((0, 0, 200)), 18.0, (-150, 0, 150, 100))


def upright(name: str, x: float, high: float):
    return sheet(name, pose((x, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 0, 100, high))


@pytest.fixture(scope="module")
def shelf():
    return assemble(shelf_parts(), shelf_capture())


def role(sheet) -> str:
    """Which board of the tiny assembly this is, by its normal and place."""
    if abs(sheet.normal[2]) > 0.99:
        return "top"
    middle = sheet.to_world(np.array([[0, 0, sheet.thickness.value / 2]]))[0]
    return "left" if middle[0] < 0 else "right"


def test_every_board_and_every_contact_is_found_with_its_type(shelf):
    roles = {s.name: role(s) for s in shelf.sheets}
    assert sorted(roles.values()) == ["left", "right", "top"]
    found = sorted((c.type, roles[c.a], roles[c.b], c.face_b) for c in shelf.contacts)
    assert found == [(1, "top", "left", "edge"), (1, "top", "right", "edge")]


def test_contacts_lie_on_the_underside_of_the_shelf(shelf):
    for contact in shelf.contacts:
        assert contact.point[2] == pytest.approx(200, abs=0.3)
        assert contact.normal == pytest.approx((0, 0, -1), abs=5e-3)
        assert contact.angle == pytest.approx(90, abs=1e-4)
        assert contact.area == pytest.approx(2400, rel=0.06)
        assert not contact.bevelled


def test_interfaces_are_counter_clockwise_about_the_normal(shelf):
    for contact in shelf.contacts:
        (corners,) = (np.array(p) for p in contact.interface)
        area = 0.5 * np.cross(corners - corners[0], np.roll(corners, -1, axis=0) - corners[0]).sum(axis=0)
        assert abs(area @ contact.normal) == pytest.approx(contact.area, rel=1e-3)


def test_thicknesses_of_the_uprights_are_shared_and_right(shelf):
    value = {role(s): s.thickness.value for s in shelf.sheets}
    assert value["left"] == value["right"] == pytest.approx(15, abs=0.4)
    assert value["top"] == pytest.approx(18, abs=0.4)


def test_constraints_end_the_uprights_at_shelf_and_floor(shelf):
    for sheet_, segments in zip(shelf.sheets, shelf.constraints, strict=True):
        assert [s.origin for s in segments] == ([] if role(sheet_) == "top" else ["contact", "ground"])


def decided_without_photos(*sheets, ends=()):
    cloud = box_cloud(((-150, 0, 0), (150, 100, 218)), spacing=20.0)
    capture = cloud_only(cloud)
    return find_contacts(sheets, cloud, Photos(capture), FreeSpace((), (), 1.0, 1.0), AssembleOptions(), (), ends)


@pytest.mark.parametrize("ends", [(), (("shelf", "side"),)])
def test_a_board_that_identification_ran_on_is_not_asked_for_a_seam(monkeypatch, ends):
    """What was dark before it was run on shows no edge."""
    monkeypatch.setattr(contacts, "look_for_seam", lambda *_: Seam(1.0, 9))
    assert len(decided_without_photos(SHELF, upright("side", 40, 200), ends=ends)) == len(ends)


def test_geometry_alone_decides_a_tee():
    (found,) = decided_without_photos(SHELF, upright("upright", -9, 197))
    contact = to_contact(found, (SHELF, upright("upright", -9, 197)))
    assert (contact.type, contact.a, contact.b, contact.face_a) == (1, "shelf", "upright", "bottom")
    assert contact.evidence.decided_by == "geometry"
    assert contact.area == pytest.approx(1800, rel=0.05)
    (corners,) = contact.interface
    assert Polygon([p[:2] for p in corners]).area == pytest.approx(contact.area, rel=1e-6)


def test_a_corner_that_no_photograph_shows_is_a_default():
    (found,) = decided_without_photos(SHELF, upright("side", -150, 217))
    assert found.kind == 2
    assert found.other is not None
    assert found.evidence.decided_by == "default"


def test_crossing_and_distant_boards_have_no_contact():
    assert decided_without_photos(SHELF, upright("crossing", -9, 400)) == []
    assert decided_without_photos(SHELF, upright("short", -9, 60)) == []


def test_a_board_whose_end_is_seen_does_not_run_on():
    """Points on its end face, 12 mm below the shelf, say that it stops there."""
    high = 188.0
    cloud = box_cloud(((-9, 0, 0), (9, 100, high)), ((-150, 0, 200), (150, 100, 218)), spacing=3.0)
    ends = np.flatnonzero((cloud.normals[:, 2] > 0.9) & (cloud.points[:, 2] < 190))
    short = sheet("short", pose((-9, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 0, 100, high), cut_idx=ends)
    fades = sheet("short", pose((-9, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, 0, 100, high))
    blind = SimpleNamespace(views=())
    free = FreeSpace((), (), 1.0, 1.0)
    assert find_contacts((SHELF, short), cloud, blind, free, AssembleOptions()) == []
    assert len(find_contacts((SHELF, fades), cloud, blind, free, AssembleOptions())) == 1


def test_a_sliver_of_a_joint_does_not_decide_a_corner():
    """A spur of the shelf's outline over the side's top does not let the side's end run through."""
    spur = box(-150, 90, -100, 100).union(box(-132, 0, 150, 100))
    short, side = sheet("shelf", pose((0, 0, 200)), 18.0, spur), upright("side", -150, 217)
    (found,) = decided_without_photos(short, side)
    assert (found.joint.b, found.evidence.decided_by) == (0, "geometry")


def leg_and_rail(rail_seen: bool):
    """A leg 50 wide and 218 high, and a rail of 50 by 150 whose unseen face is level with the leg's edge."""
    leg = sheet("leg", pose((0, 0, 0), (0, 1, 0), (0, 0, 1)), 10.0, (0, 0, 50, 218))
    frame = pose((10, 50, 168), (1, 0, 0), (0, 0, 1))
    return leg, sheet("rail", frame, 30.0, (0, 0, 150, 50), thickness_seen=rail_seen)


@pytest.mark.parametrize(("rail_seen", "kind"), [(True, 2), (False, 1)])
def test_no_seam_cuts_a_notch_into_a_leg(monkeypatch, rail_seen, kind):
    """The leg goes on beside the rail: it does not end there, however clear a line runs along the rail's face."""
    boards = leg_and_rail(rail_seen)
    monkeypatch.setattr(contacts, "look_for_seam", lambda _, joint, *__: Seam(9.0 if joint.a == 1 else 1.4, 9))
    (found,) = decided_without_photos(*boards)
    contact = to_contact(found, boards)
    assert (contact.type, contact.a, contact.b) == (kind, "leg", "rail")
    assert contact.evidence.decided_by == "geometry"


def test_a_leg_that_has_a_notch_already_ends_there(monkeypatch):
    """Where the cloud shows no wood beyond the rail's face, the seam decides as ever."""
    leg, rail = leg_and_rail(True)
    leg = replace(leg, region=leg.region.difference(box(20, 168, 50, 218)))
    monkeypatch.setattr(contacts, "look_for_seam", lambda _, joint, *__: Seam(9.0 if joint.a == 1 else 1.4, 9))
    (found,) = decided_without_photos(leg, rail)
    assert to_contact(found, (leg, rail)).a == "rail"


@pytest.mark.parametrize(("seen", "held"), [(True, 1), (False, 0)])
def test_a_rail_that_ends_on_a_leg_does_not_end_on_a_face_nobody_saw(seen, held):
    """Two rails at a leg: one ends on the leg's face, the other on its edge, near where the first's hidden face may be.
    """
    leg = sheet("leg", pose((0, 0, 0), (0, 1, 0), (0, 0, 1)), 8.0, (0, 0, 50, 218))
    front = sheet("front", pose((8, 45, 168), (1, 0, 0), (0, 0, 1)), 25.0, (0, 0, 140, 50), thickness_seen=seen)
    side = sheet("side", pose((1, 0, 0), (0, 1, 0), (0, 0, 1)), 6.0, (50, 168, 100, 218))
    pairs = [{d.joint.a, d.joint.b} for d in decided_without_photos(leg, front, side)]
    assert pairs.count({0, 1}) == 1
    assert pairs.count({1, 2}) == held
