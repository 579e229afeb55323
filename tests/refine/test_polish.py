"""Relations that contradict each other are left out; they do not end the run."""

from types import SimpleNamespace

import numpy as np

from kerfwright.refine.curves import polish


def test_relations_whose_steps_grow_without_bound_do_not_hold(monkeypatch):
    shape = SimpleNamespace(unknowns=np.zeros(2))
    monkeypatch.setattr(polish, "_shapes", lambda fits, x: [shape])
    monkeypatch.setattr(polish, "normal_equations", lambda *a: (np.eye(2), np.zeros(2), 0.0))
    monkeypatch.setattr(polish, "_all_equations", lambda *a: (np.ones(1), np.full((1, 2), np.nan)))
    state = SimpleNamespace(unknowns=np.zeros(2), kept=[])
    assert polish._solved([SimpleNamespace(shape=shape)], [None], [], state) is None
