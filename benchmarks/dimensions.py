"""Change the named dimensions of generated build123d programs, one at a time, and see whether the object still holds.

    python benchmarks/dimensions.py truths
    python benchmarks/dimensions.py OUT/model.json

Every overall dimension by 10 % and every stock by 2 mm, both ways: the boards must be valid solids, touch as they did,
sheet to sheet or sheet to cut, and share no volume.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from models import named_models
from tables import markdown

from kerfwright.model import Model
from kerfwright_exporters import ExportOptions
from kerfwright_exporters.script import export


def main() -> None:
    """Print what fails as it is found, then a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", help="`truths`, the name of one, or a model.json")
    arguments = parser.parse_args()
    rows = [_row(name, model) for name, model in named_models(arguments.models)]
    print(markdown(["object", "boards", "overall +-10 %", "stock +-2 mm", "seconds a run"], rows))


def _row(name: str, model: Model) -> list[str]:
    from scripted import dimensions, problems

    with tempfile.TemporaryDirectory() as folder:
        source = export(model, Path(folder), ExportOptions())[0].read_text()
    held: dict[bool, list[bool]] = {True: [], False: []}
    start = time.monotonic()
    for dimension, value in _changes(dimensions(source)):
        wrong = problems(source, **{dimension: value})
        held[dimension.startswith("STOCK")].append(not wrong)
        for problem in wrong:
            print(f"{name}: {dimension} = {value:g}: {problem}", flush=True)
    runs = sum(map(len, held.values()))
    counts = [f"{sum(held[k])}/{len(held[k])}" for k in (False, True)]
    return [name, str(len(model.boards)), *counts, f"{(time.monotonic() - start) / runs:.1f}"]


def _changes(dimensions: dict[str, float]) -> Iterator[tuple[str, float]]:
    for name, value in dimensions.items():
        step = 2.0 if name.startswith("STOCK") else 0.1 * value
        yield from ((name, value + sign * step) for sign in (1, -1))


if __name__ == "__main__":
    main()
