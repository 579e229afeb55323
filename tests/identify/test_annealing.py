"""The paper's simulated annealing, kept for comparison."""

from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from clouds import box_cloud, candidate, cloud_only, pose
from kerfwright.errors import OptionError
from kerfwright.identify import IdentifyOptions, identify
from kerfwright.identify.annealing import select_annealing, surface_distance
from kerfwright.identify.primitives import look_around
from kerfwright.identify.selection import gather_evidence, program_value, select_exact

OPTIONS = IdentifyOptions(selection="annealing")
TABLE = (((-150, -100, 200), (150, 100, 218)), ((-120, -80, 0), (-102, 80, 200)), ((102, -80, 0), (120, 80, 200)))


@pytest.fixture(scope="module")
def scene():
    """A table: its three boards, and one that isn't there, as thick as the table is high."""
    cloud = box_cloud(*TABLE, spacing=6.0)
    boards = [
        candidate(pose((0, 0, 200)), box(-150, -100, 150, 100), 18.0),
        candidate(pose((-120, 0, 0), (0, 1, 0), (0, 0, 1)), box(-80, 0, 80, 200), 18.0),
        candidate(pose((102, 0, 0), (0, 1, 0), (0, 0, 1)), box(-80, 0, 80, 200), 18.0),
        candidate(pose((0, 0, 0)), box(-120, -80, 120, 80), 218.0),
    ]
    return cloud, boards, gather_evidence(cloud, look_around(cloud, OPTIONS), boards, OPTIONS)


def test_distance_to_the_surface_of_a_candidate():
    holed = candidate(pose((0, 0, 10)), Polygon(box(0, 0, 100, 60).exterior, [box(40, 20, 60, 40).exterior]), 20.0)
    places = np.array([[20, 30, 33], [20, 30, 22], [-3, 30, 34], [50, 30, 20], [97, 30, 20], [-5, 30, 20.0]])
    assert surface_distance(holed, places) == pytest.approx([3, 8, 5, 10, 3, 5])


def test_finds_the_boards_of_a_table_with_the_total_energy(scene):
    cloud, boards, evidence = scene
    found = select_annealing(cloud, boards, evidence, OPTIONS)
    assert found.chosen == (0, 1, 2)
    assert found.objective == pytest.approx(select_exact(evidence, OPTIONS).objective)
    assert found.bound is None
    assert found.energy["total"] == pytest.approx(len(cloud) * found.energy["mean"])


def test_walks_at_random_with_the_mean_energy(scene):
    cloud, boards, evidence = scene
    options = replace(OPTIONS, annealing_energy="mean", annealing_steps=100)
    ends = {select_annealing(cloud, boards, evidence, replace(options, seed=seed)).chosen for seed in range(5)}
    assert len(ends) > 1


def test_same_seed_same_boards_and_no_conflict(scene):
    cloud, boards, evidence = scene
    options = replace(OPTIONS, annealing_energy="mean", annealing_steps=200)
    first, again = (select_annealing(cloud, boards, evidence, options) for _ in range(2))
    assert first == again
    assert not evidence.broken(list(first.chosen))


def test_objective_of_a_set_is_the_exact_programs(scene):
    _, _, evidence = scene
    best = select_exact(evidence, OPTIONS)
    assert program_value(evidence, list(best.chosen)) == pytest.approx(best.objective)
    assert program_value(evidence, []) == 0


def test_identify_says_which_method_it_took():
    parts = identify(cloud_only(box_cloud(*TABLE, spacing=6.0)), OPTIONS)
    assert len(parts.sheets) == 3
    assert parts.selection["method"] == "annealing, total energy"
    assert parts.selection["bound"] is None
    assert set(parts.selection["energy"]) == {"total", "mean"}


@pytest.mark.parametrize("wrong", [{"selection": "greedy"}, {"annealing_energy": "median"}])
def test_unknown_methods_are_refused(wrong):
    (name,) = wrong
    with pytest.raises(OptionError, match=f"{name}: .*: not known: take "):
        IdentifyOptions(**wrong)
