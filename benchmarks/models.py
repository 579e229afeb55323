"""The models that the benchmarks of solids and exports run on: truths drawn again, and model files."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from kerfwright.model import Model, read_model

__all__ = ["SUPPORT", "named_models"]

SUPPORT = Path(__file__).resolve().parents[1] / "tests" / "support"  # where the truths are drawn, for the tests too


def named_models(names: Sequence[str]) -> Iterator[tuple[str, Model]]:
    """Label and model of every argument: `truths` (all seven), the name of one, or a model.json or its folder."""
    if str(SUPPORT) not in sys.path:
        sys.path.insert(0, str(SUPPORT))
    import truths

    for name in names:
        if name == "truths" or name in truths.NAMES:
            yield from ((n, truths.truth_model(n)) for n in (truths.AVAILABLE if name == "truths" else (name,)))
        else:
            path = Path(name)
            path = path / "model.json" if path.is_dir() else path
            yield f"{path.parent.name} (reconstructed)", read_model(path)
