"""Contacts that change in the last pass are told."""

from types import SimpleNamespace

import numpy as np

from clouds import sheet
from kerfwright.assemble.settled import unsettled

SHEETS = [sheet(name, np.eye(4), 18.0, (0, 0, 100, 100)) for name in ("side", "top", "shelf")]


def met(a: int, b: int, kind: int = 1) -> SimpleNamespace:
    return SimpleNamespace(joint=SimpleNamespace(a=a, b=b), kind=kind)


def told(before, after) -> list[tuple[str, ...]]:
    return [finding.boards for finding in unsettled(before, after, SHEETS)]


def test_contacts_at_rest_are_not_told():
    assert told([met(0, 1, 2), met(0, 2)], [met(0, 2), met(0, 1, 2)]) == []


def test_a_new_one_one_turned_round_and_one_of_another_type_are_told_once_each():
    assert told([met(0, 1)], [met(0, 1), met(0, 2)]) == [("side", "shelf")]
    assert told([met(0, 1)], [met(1, 0)]) == [("side", "top")]
    assert told([met(0, 1), met(2, 1)], [met(0, 1, 2)]) == [("side", "top"), ("top", "shelf")]
