import numpy as np
import pytest
from shapely.geometry import box

from clouds import box_cloud, candidate, pose
from kerfwright.identify import IdentifyOptions
from kerfwright.identify.primitives import look_around
from kerfwright.identify.selection import Evidence, gather_evidence, select_exact

OPTIONS = IdentifyOptions()


def made_evidence(shares: list[float], interior: list[np.ndarray], cost: float = 0.006) -> Evidence:
    """Candidates that explain separate shares of a surface of 1000 places."""
    owner = np.repeat(np.arange(len(shares)), (np.array(shares) * 1000).astype(int))
    owner = np.r_[owner, np.full(1000 - len(owner), -1)]
    by_sheet = np.array([owner == k for k in range(len(shares))])
    count = np.full(len(shares), cost)
    return Evidence(np.zeros((1000, 3)), by_sheet, np.zeros_like(by_sheet), count, tuple(interior))


def held(self_idx: int, count: int, **others: tuple[int, int]) -> np.ndarray:
    """100 interior samples of one candidate; others: which range of them each other candidate holds too."""
    rows = np.zeros((100, count), bool)
    rows[:, self_idx] = True
    for name, (low, high) in others.items():
        rows[low:high, int(name[1:])] = True
    return rows


def test_thin_stock_is_preferred():
    """A block of 100 x 60 x 20 is a sheet of 20, not one of 60 stood on its edge."""
    cloud = box_cloud(((0, 0, 0), (100, 60, 20)), spacing=2.0)
    flat = candidate(pose((0, 0, 0)), box(0, 0, 100, 60), 20.0)
    upright = candidate(pose((0, 60, 0), (1, 0, 0), (0, 0, 1)), box(0, 0, 100, 20), 60.0)
    assert upright.normal == pytest.approx([0, -1, 0])
    found = select_exact(gather_evidence(cloud, look_around(cloud, OPTIONS), [upright, flat], OPTIONS), OPTIONS)
    assert found.chosen == (1,)
    assert found.explained > 0.95


def test_union_rule_holds_where_pairs_allow_it():
    """C lies 40 % in A and 40 % in B: with either it is fine, with both it is not a board of its own."""
    interior = [held(0, 3), held(1, 3), held(2, 3, _0=(0, 40), _1=(40, 80))]
    found = select_exact(made_evidence([0.3, 0.3, 0.25], interior), OPTIONS)
    assert found.chosen == (0, 1)
    assert found.explained == pytest.approx(0.6)


def test_overlaps_that_coincide_count_once():
    interior = [held(0, 3), held(1, 3), held(2, 3, _0=(0, 40), _1=(0, 40))]
    assert select_exact(made_evidence([0.3, 0.3, 0.25], interior), OPTIONS).chosen == (0, 1, 2)


def test_pairs_that_share_most_of_a_volume_exclude_each_other():
    interior = [held(0, 2, _1=(0, 60)), held(1, 2)]
    assert select_exact(made_evidence([0.3, 0.4], interior), OPTIONS).chosen == (1,)


def test_a_board_must_be_worth_its_cost():
    found = select_exact(made_evidence([0.5, 0.004], [held(0, 2), held(1, 2)]), OPTIONS)
    assert found.chosen == (0,)


def test_objective_is_proven_and_is_what_it_says():
    found = select_exact(made_evidence([0.3, 0.2], [held(0, 2), held(1, 2)]), OPTIONS)
    assert found.objective == pytest.approx(0.5 - 2 * 0.006)
    assert found.bound == pytest.approx(found.objective)


def test_order_of_the_candidates_does_not_matter():
    rng = np.random.default_rng(5)
    owner = rng.integers(0, 12, 1000)
    by_sheet = np.array([(owner == k) | (owner == (k + 1) % 12) for k in range(12)])
    interior = [held(k, 12, **{f"_{(k + 1) % 12}": (0, int(rng.integers(20, 70)))}) for k in range(12)]
    no_cut = np.zeros_like(by_sheet)
    evidence = Evidence(np.zeros((1000, 3)), by_sheet, no_cut, rng.uniform(0.005, 0.01, 12), tuple(interior))
    order = rng.permutation(12)
    held_by = tuple(interior[k][:, order] for k in order)
    shuffled = Evidence(evidence.places, by_sheet[order], no_cut, evidence.cost[order], held_by)
    first, again, other = (select_exact(e, OPTIONS) for e in (evidence, evidence, shuffled))
    assert first == again
    assert {int(order[k]) for k in other.chosen} == set(first.chosen)
    assert other.objective == pytest.approx(first.objective)


def test_places_on_sheet_planes_and_cut_faces_are_told_apart():
    cloud = box_cloud(((0, 0, 0), (100, 60, 20)), spacing=2.0)
    board = candidate(pose(), box(0, 0, 100, 60), 20.0)
    evidence = gather_evidence(cloud, look_around(cloud, OPTIONS), [board], OPTIONS)
    z, n = evidence.places[:, 2], np.abs(evidence.places[:, 2] - 10) > 9
    assert (evidence.by_sheet[0] | evidence.by_cut[0]).mean() > 0.98
    assert not (evidence.by_sheet & evidence.by_cut).any()
    assert ((z[evidence.by_cut[0]] > -1) & (z[evidence.by_cut[0]] < 21)).all()
    assert n[evidence.by_sheet[0]].all()


def test_see_through_interior_costs():
    cloud = box_cloud(((0, 0, 0), (100, 60, 20)), spacing=2.0)
    slabs = [candidate(pose(), box(0, 0, 100, 60), 20.0, free=share) for share in (0.0, 0.2)]
    solid, airy = gather_evidence(cloud, look_around(cloud, OPTIONS), slabs, OPTIONS).cost
    assert airy > solid + 0.1
