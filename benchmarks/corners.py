"""Corners: seam scores with the true choice marked, and how many contacts are right when no photograph decides them.

    python benchmarks/corners.py CAPTURES OUT [OBJECT ...]

OUT/OBJECT are output folders of `kerfwright reconstruct` with their .cache; CAPTURES/OBJECT has the truth. Contacts are
found again from the kept boards, by today's code, as assembly finds them first: with rough outlines.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from unittest.mock import patch

from tables import markdown

from kerfwright.assemble import Assembly, assemble, contacts
from kerfwright.cache import read_kept
from kerfwright.evaluate import read_truth
from kerfwright.evaluate.score import evaluate_model
from kerfwright.evaluate.stages import rough_model
from kerfwright.identify.seams import UNSEEN_SCORE, Seam

UNSEEN = Seam(UNSEEN_SCORE, 0)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("captures", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("objects", nargs="*")
    o = parser.parse_args()
    names = o.objects or sorted(p.parent.name for p in o.out.glob("*/.cache"))
    counts, corners = [], []
    for name in names:
        kept = [read_kept(o.out / name / ".cache", stage) for stage in ("capture", "identify")]
        if None in kept:
            print(f"{name}: nothing kept of its first stages", flush=True)
            continue
        start = time.process_time()
        shown = assemble(kept[1], kept[0])
        seconds = time.process_time() - start
        with patch.object(contacts, "_seam", lambda *_: UNSEEN), patch.object(contacts, "_end_face", lambda *_: None):
            unshown = assemble(kept[1], kept[0])
        scores = [_score(o.captures / name, name, found, kept[0]) for found in (shown, unshown)]
        counts.append([name, *map(_counted, scores), f"{seconds:.1f}"])
        corners += _corner_rows(name, shown, scores[0])
        print(*counts[-1], sep=" | ", flush=True)
    print(markdown(["capture", "contacts right, seams seen", "right by geometry alone", "CPU s"], counts))
    print(markdown(["capture", "choice", "score", "other", "margin", "views", "decided by", "true choice"], corners))


def _score(capture: Path, name: str, found: Assembly, views) -> dict:
    model = rough_model(name, found.sheets, views, found.contacts)
    return evaluate_model(model, read_truth(capture / "truth"), rough=True)


def _counted(score: dict) -> str:
    """Typed right of true, and those that are wrong by name."""
    wrong = [*score["contacts_mistyped"], *(f"{pair} missing" for pair in score["contacts_missing"])]
    told = f"{score['contacts_typed_right']}/{score['contacts_true']} ({score['contacts_found']})"
    return f"{told}: {', '.join(wrong)}" if wrong else told


def _corner_rows(name: str, found: Assembly, score: dict) -> list[list[str]]:
    """A row a corner at which either board could end, or both; boards by their true names."""
    true = {row["board"]: own for own, row in score["boards"].items() if row.get("board")}
    wrong = {text.split()[0] for key in ("contacts_mistyped", "contacts_extra") for text in score[key]}
    rows = []
    for c in found.contacts:
        if c.type not in (2, 4) or c.evidence is None:
            continue
        ends, on, e = true.get(c.b, c.b), true.get(c.a, c.a), c.evidence
        margin = e.seam_score / max(e.seam_score_other, 1e-6)
        told = "?" if {c.a, c.b} - set(true) else "no" if {f"{on}-{ends}", f"{ends}-{on}"} & wrong else "yes"
        choice = f"{ends} on {on}" if c.type == 2 else f"{ends}, {on} mitred"
        rows.append([
            name, choice, f"{e.seam_score:.2f}", f"{e.seam_score_other:.2f}", f"{margin:.2f}", str(e.views),
            e.decided_by, told,
        ])  # fmt: skip
    return rows


if __name__ == "__main__":
    main()
