#!/usr/bin/env python3
"""Make a set of synthetic captures: the families in turn, a seed each. See README.md."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from kerfwright.synthetic import FAMILIES, PRESETS, random_assembly, write_capture

# Every sixth capture is made harder in one way; the rest are plain.
TURNS = ("plain", "plain", "recovered", "plain", "plain", "rough", "plain", "distorted", "plain", "biased", "radial")


def main() -> None:
    """Make what is not there yet; a capture that was cut short is made again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=100, help="of the first")
    parser.add_argument("--preset", choices=sorted(PRESETS), help="for all; by default mostly plain, some harder")
    o = parser.parse_args()
    families = sorted(FAMILIES)
    for k in range(o.count):
        family, preset, seed = families[k % len(families)], o.preset or TURNS[k % len(TURNS)], o.seed + k
        folder = o.folder / (f"{family}_{seed}" if preset == "plain" else f"{family}_{seed}_{preset}")
        if folder.exists():
            continue
        making = o.folder / ".making"
        shutil.rmtree(making, ignore_errors=True)
        write_capture(random_assembly(family, seed), making, PRESETS[preset].seeded(seed))
        making.rename(folder)
        print(folder, flush=True)


if __name__ == "__main__":
    main()
