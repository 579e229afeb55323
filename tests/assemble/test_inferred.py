"""Boards that float get the least wood that joins them to the others, and it is marked."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from clouds import box_cloud, cloud_only, pose, sheet
from kerfwright.assemble import AssembleOptions, _held
from kerfwright.assemble.contacts import to_contact
from kerfwright.assemble.inferred import joined_up, marked, told
from kerfwright.assemble.laid import laid_contacts
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.reaching import Scene
from kerfwright.identify.visibility import Obstacles
from kerfwright.model import Origin, Quantity

BASE = sheet("base", pose(), 18.0, (-250, 0, 250, 100))
HIGH = 80.0  # mm from the base's top to the post: further than boards run on by themselves


def post(x: float, low: float = 18.0 + HIGH):
    return sheet(f"post_{x:.0f}", pose((x, 0, 0), (0, 1, 0), (0, 0, 1)), 18.0, (0, low, 100, low + 150))


def scene(*sheets, votes: int = 0) -> Scene:
    cloud = box_cloud(((-250, 0, 0), (250, 100, 18)))
    free = SimpleNamespace(votes=lambda x: np.full(len(x), votes))
    return Scene(sheets, cloud, Photos(cloud_only(cloud)), Obstacles(sheets, 5.0), free, AssembleOptions())


def test_a_floating_board_is_run_on_to_the_nearest_one_and_marked():
    (found,) = joined_up(scene(BASE, post(0.0)), [])[1]
    assert (found.joint.a, found.joint.b, found.joint.face_a) == (0, 1, "top")
    contact = to_contact(found, (BASE, post(0.0)))
    assert (contact.type, contact.origin, contact.evidence.decided_by) == (1, Origin.INFERRED, "inferred")


def test_the_least_wood_is_taken():
    shelf = sheet("shelf", pose((0, 0, 288)), 18.0, (-250, 0, 250, 100))
    nearer = joined_up(scene(BASE, shelf, post(0.0)), [])[1][0]
    assert (nearer.joint.a, nearer.joint.b) == (1, 2)


def test_nothing_is_put_where_cameras_saw_through():
    assert joined_up(scene(BASE, post(0.0), votes=3), [])[1] == []


def test_nothing_is_put_where_all_hold_together_or_lie_too_far_apart():
    held = joined_up(scene(BASE, post(0.0)), [])[1]
    assert joined_up(scene(BASE, post(0.0)), held)[1] == held
    assert joined_up(scene(BASE, post(0.0, low=180.0)), [])[1] == []


def test_boards_side_by_side_hold_together():
    beside = sheet("beside", pose(), 12.0, (-250, 102, 250, 200))
    assert joined_up(scene(BASE, beside), [])[1] == []


def test_the_board_is_run_on_and_still_marked_when_it_is_assembled_again():
    s = scene(BASE, post(0.0))
    sheets, decided, _ = _held(s.sheets, [], ((), ()), s.cloud, s.photos, s.free, s.options)
    assert sheets[1].region.bounds[1] == pytest.approx(18.0, abs=0.1)
    plain = [replace(d, evidence=d.evidence.model_copy(update={"decided_by": "geometry"})) for d in decided]
    assert marked(plain, sheets, s.diameter)[0].evidence.decided_by == "inferred"
    assert marked(plain, s.sheets, s.diameter)[0].evidence.decided_by == "geometry"


@pytest.mark.parametrize(("seen", "count"), [(False, 1), (True, 0)])
def test_a_hidden_face_is_put_on_the_one_below(seen, count):
    guess = Quantity(value=3.0, standard_error=1.0, origin=Origin.INFERRED)
    over = sheet("over", pose((0, 0, 30)), 3.0, (-200, 0, 200, 100), thickness_seen=seen, quantity=guess)
    sheets, decided = joined_up(scene(BASE, over), [])
    contacts = laid_contacts(sheets, 5.0)
    assert decided == []
    assert len(contacts) == count
    if count:
        assert sheets[1].thickness.value == pytest.approx(15.0)
        assert (contacts[0].type, contacts[0].origin) == (3, Origin.INFERRED)


def test_what_was_inferred_is_told():
    found = joined_up(scene(BASE, post(0.0)), [])[1]
    (finding,) = told([to_contact(d, (BASE, post(0.0))) for d in found])
    assert (finding.code, finding.boards) == ("K012", ("base", "post_0"))
    plain = found[0].evidence.model_copy(update={"decided_by": "geometry"})
    assert told([to_contact(replace(found[0], evidence=plain), (BASE, post(0.0)))]) == ()
