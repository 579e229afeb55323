"""Whether contacts came to rest: boards run on to what they end on may meet others then."""

from __future__ import annotations

from collections.abc import Sequence

from kerfwright.assemble.decided import Decided
from kerfwright.identify.types import Sheet
from kerfwright.model import Finding

__all__ = ["unsettled"]


def unsettled(before: Sequence[Decided], after: Sequence[Decided], sheets: Sequence[Sheet]) -> tuple[Finding, ...]:
    """A finding for each contact that the last pass made, turned round, changed in type or dropped."""
    changed = sorted({_key(d) for d in before} ^ {_key(d) for d in after})
    pairs = sorted({tuple(sorted(ends)) for *ends, _ in changed})
    return tuple(_finding(sheets[a].name, sheets[b].name) for a, b in pairs)


def _key(decided: Decided) -> tuple[int, int, int]:
    return decided.joint.a, decided.joint.b, decided.kind


def _finding(a: str, b: str) -> Finding:
    return Finding(
        code="K011", severity="warning", boards=(a, b),
        message=f"{a}, {b}: how they meet still changed when contacts were looked for the last time",
        remedy="compare this contact with the object",
    )
