"""Assemblies: buildable, connected, and contacts that agree with exact solids."""

import itertools
from collections import Counter

import numpy as np
import pytest

from kerfwright.errors import ModelError, OptionError
from kerfwright.model.faults import faults
from kerfwright.model.geometry import path_area
from kerfwright.synthetic import FAMILIES, assembled, random_assembly
from kerfwright.synthetic.carpentry import slab
from kerfwright.synthetic.meshes import board_mesh, face_normals, volume
from kerfwright.synthetic.outlines import circle_hole, rounded, slot_hole
from kerfwright.synthetic.solids import truth_solid


@pytest.mark.parametrize("family", sorted(FAMILIES))
@pytest.mark.parametrize("seed", range(3))
def test_assembly_can_be_built(family, seed):
    model = random_assembly(family, seed)  # raises where boards overlap, fall over or hang in the air
    assert faults(model) == ()
    assert min(b.thickness.value for b in model.boards) >= 6
    points = np.concatenate([board_mesh(b)[0] for b in model.boards])
    assert 100 < np.ptp(points, axis=0).max() < 1700


def test_same_seed_same_object_other_seed_another():
    assert random_assembly("table", 4) == random_assembly("table", 4)
    assert random_assembly("table", 4) != random_assembly("table", 5)


@pytest.mark.parametrize("boards", [4, 5, 13, 60])
def test_cabinet_has_as_many_boards_as_asked(boards):
    assert len(random_assembly("cabinet", 1, boards).boards) == boards


def test_wrong_requests_are_refused():
    with pytest.raises(OptionError, match="take one of"):
        random_assembly("spaceship", 0)
    with pytest.raises(OptionError, match="4 to 60"):
        random_assembly("cabinet", 0, 61)
    with pytest.raises(OptionError, match="number of its own"):
        random_assembly("stool", 0, 5)


def test_what_cannot_be_built_is_refused_by_name():
    floor, floating = slab("floor", (0, 0, 0), (200, 100, 10)), slab("floating", (0, 0, 50), (200, 100, 60))
    with pytest.raises(ModelError, match="floating touches nothing"):
        assembled("gap", [floor, floating])
    with pytest.raises(ModelError, match="reaches into"):
        assembled("clash", [floor, slab("post", (0, 0, 5), (10, 100, 90))])
    with pytest.raises(ModelError, match="tips over"):
        assembled("tall", [floor, slab("arm", (150, 0, 10), (1500, 100, 40))])
    with pytest.raises(ModelError, match="not on the floor"):
        assembled("up", [slab("a", (0, 0, 5), (200, 100, 15))])


def test_mesh_of_a_holed_board_is_closed_and_has_the_exact_volume():
    path = rounded(300, 200, (20, 0, 30, 0), circle_hole((100, 80), 25), slot_hole((210, 100), 90, 30))
    board = slab("a", (0, 0, 0), (300, 200, 18), lambda length, width: path)
    mesh = board_mesh(board, 0.01)
    assert closed(mesh)
    assert volume(mesh) == pytest.approx(path_area(path) * 18, rel=2e-4)


def closed(mesh):
    """Every directed edge is met by its opposite equally often."""
    sides = Counter((t[k], t[(k + 1) % 3]) for t in mesh[1].tolist() for k in range(3))
    return all(sides[b, a] == count for (a, b), count in sides.items())


@pytest.mark.parametrize("family", ["crossed_frame", "mitred_frame", "skewed_box", "tilted_stool"])
def test_bevelled_boards_mesh_and_solid_agree(family):
    for board in random_assembly(family, 2).boards:
        mesh, solid = board_mesh(board), truth_solid(board)
        assert solid.is_valid
        assert volume(mesh) == pytest.approx(solid.volume, rel=1e-6)
        normals, areas = face_normals(mesh)
        assert np.abs(areas @ normals).max() < 1e-6 * areas.sum()  # a closed surface


@pytest.mark.parametrize("family", ["crossed_frame", "skewed_box", "stool", "table", "tray"])
def test_contacts_are_where_exact_solids_touch_and_nothing_overlaps(family):
    model = random_assembly(family, 0)
    solids = {b.name: truth_solid(b) for b in model.boards}
    touching = {frozenset((c.a, c.b)) for c in model.contacts}
    for a, b in itertools.combinations(sorted(solids), 2):
        common = solids[a].intersect(solids[b])
        pieces = list(common) if hasattr(common, "__iter__") else [common] if common is not None else []
        assert sum(getattr(p, "volume", 0) or 0 for p in pieces) < 1e-3
        near = solids[a].distance_to(solids[b]) < 1e-6
        assert near or frozenset((a, b)) not in touching


def test_type_and_area_of_contacts_known_by_construction():
    model = assembled(
        "corner",
        [
            slab("base", (0, 0, 0), (300, 200, 18)),
            slab("end", (0, 0, 18), (12, 200, 118)),
            slab("middle", (150, 0, 18), (162, 200, 118)),
            slab("cleat", (170, 0, 18), (230, 200, 34)),
            slab("beside", (300, 0, 0), (400, 200, 18)),
        ],
    )
    found = {
        frozenset((c.a, c.b)): (c.type, round(c.area), c.face_a == "edge", c.face_b == "edge") for c in model.contacts
    }
    assert found == {
        frozenset(("base", "end")): (2, 2400, False, True),
        frozenset(("base", "middle")): (1, 2400, False, True),
        frozenset(("base", "cleat")): (3, 12000, False, False),
        frozenset(("base", "beside")): (4, 3600, True, True),
    }


def test_a_mitre_is_cut_on_cut_with_two_bevels():
    model = next(m for m in (random_assembly("mitred_frame", s) for s in range(20)) if m.boards[0].bevels)
    mitres = [c for c in model.contacts if c.type == 4]
    assert len(mitres) == 4
    assert all(c.bevelled and c.angle == pytest.approx(90) for c in mitres)


def test_skewed_box_meets_at_eighty_degrees():
    model = random_assembly("skewed_box", 0)
    corners = [c for c in model.contacts if "base" not in (c.a, c.b)]
    assert [round(c.angle, 6) for c in corners] == [80.0] * 4


def test_slats_lie_twenty_millimetres_apart():
    model = random_assembly("bench", 3)
    slats = sorted((board_mesh_in_y(b) for b in model.boards if b.name.startswith("slat")), key=lambda s: s[0])
    assert {round(b[0] - a[1], 9) for a, b in itertools.pairwise(slats)} == {20.0}


def board_mesh_in_y(board):
    from kerfwright.synthetic.meshes import mesh_in_model

    y = mesh_in_model(board)[0][:, 1]
    return y.min(), y.max()
