"""Write models in every format, read every file back with another program's reader, and compare with the solids.

    python benchmarks/exports.py truths OUT/model.json ... --out DIR

A model in which the checker finds an error is exported all the same, as with `--force`. Differences are the largest
over a model's boards: volumes and areas as shares, places in mm. The files stay in DIR, for freecad.py and for looking
at them.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from models import named_models
from readers import READERS
from tables import markdown

from kerfwright.model import Model
from kerfwright.solid import assembly_solids, check
from kerfwright_exporters import ExportOptions, export_all, formats


def main() -> None:
    """Print three tables: what the checker says, differences by format, seconds by format."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", help="`truths`, the name of one, or a model.json")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    checked, read, seconds = [], [], []
    for name, model in named_models(arguments.models):
        row, errors = _checked(name, model)
        checked.append(row)
        found, took = _exported(model, arguments.out / name.split()[0] / ("rec" if " " in name else "truth"), errors)
        read.append([name, *found])
        seconds.append([name, *took])
        print(" | ".join(read[-1]), flush=True)
    print(markdown(["model", "boards", "contacts", "errors", "warnings", "notes", "check, s"], checked))
    print(markdown(["model", *formats()], read))
    print(markdown(["seconds", *formats()], seconds))


def _checked(name: str, model: Model) -> tuple[list[str], bool]:
    start = time.perf_counter()
    findings = check(model)
    took = time.perf_counter() - start
    codes = {s: sorted(f.code for f in findings if f.severity == s) for s in ("error", "warning", "info")}
    counts = [" ".join(f"{c.count(k)} x {k}" for k in sorted(set(c))) or "0" for c in codes.values()]
    return [name, str(len(model.boards)), str(len(model.contacts)), *counts, f"{took:.2f}"], bool(codes["error"])


def _exported(model: Model, folder: Path, errors: bool) -> tuple[list[str], list[str]]:
    """For every format what its reader finds, and how long the writing took."""
    solids = dict(assembly_solids(model))
    found, seconds = [], []
    for kind in formats():
        start = time.perf_counter()
        try:
            paths = export_all(model, [kind], folder, ExportOptions(), force=errors)
        except Exception as error:  # the table is to show it beside the others
            found.append(f"{type(error).__name__}: {error}")
            seconds.append("-")
            continue
        seconds.append(f"{time.perf_counter() - start:.1f}")
        again = export_all(model, [kind], folder.with_name(folder.name + " again"), ExportOptions(), force=errors)
        same = all(a.read_bytes() == b.read_bytes() for a, b in zip(paths, again, strict=True))
        found.append(READERS[kind](model, solids, paths) + ("" if same else ", OTHER BYTES"))
    return found, seconds


if __name__ == "__main__":
    main()
