#!/usr/bin/env python3
"""How often curve fitting finds the right nodes and kinds: python tests/refine/benchmark_curves.py [COUNT] [SEED].

The acceptance is 95 % of 200 outlines (nodes within 2 mm, smooth or sharp, kinds of edges). Shapes of `HARD_SHAPES` are
counted apart.
"""

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from outlines import HARD_SHAPES, complaints, make_outline, make_outlines

from kerfwright.errors import StageError
from kerfwright.refine.curves import fit_cut_path


def main() -> None:
    count, seed = (int(a) for a in (*sys.argv[1:], *("200", "0")[len(sys.argv) - 1 :]))
    hard = [make_outline(s, np.random.default_rng([seed, i])) for s in sorted(HARD_SHAPES) for i in range(count // 10)]
    right, total, seconds = Counter(), Counter(), []
    for i, outline in enumerate([*make_outlines(count, seed), *hard]):
        start = time.process_time()
        try:
            wrong = complaints(outline.path, fit_cut_path(outline.loops))
        except StageError as error:
            wrong = [str(error)]
        seconds.append(time.process_time() - start)
        total[outline.shape] += 1
        right[outline.shape] += not wrong
        if wrong:
            print(f"{i:4} {outline.shape:20} {'; '.join(wrong[:4])}", flush=True)
    report(right, total, seconds)


def report(right: Counter, total: Counter, seconds: list[float]) -> None:
    """One line a shape, then all of the acceptance."""
    for shape in sorted(total):
        print(f"{shape:20} {right[shape]:3} of {total[shape]}{'  (apart)' if shape in HARD_SHAPES else ''}")
    counted = [s for s in total if s not in HARD_SHAPES]
    print(f"{'all':20} {sum(right[s] for s in counted):3} of {sum(total[s] for s in counted)}")
    print(f"CPU seconds an outline: median {np.median(seconds):.2f}, most {max(seconds):.2f}")


if __name__ == "__main__":
    main()
