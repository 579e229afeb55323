"""A contact as it was decided, with what decided it."""

from __future__ import annotations

from dataclasses import dataclass

from kerfwright.assemble.mitres import EndFace
from kerfwright.identify.joints import Joint
from kerfwright.model import ContactEvidence

__all__ = ["Decided", "swapped"]


@dataclass(frozen=True, eq=False)
class Decided:
    """A contact as decided: b ends on a; for a corner also the joint that was not chosen; for a mitre both joints,
    on its plane.
    """

    joint: Joint
    kind: int  # contact type, 1, 2 or 4
    other: Joint | None
    evidence: ContactEvidence
    mitre: EndFace | None = None  # what its end faces show; None where it cannot be a mitre
    flush: Joint | None = None  # where a is bevelled flush with b's outer face


def swapped(e: ContactEvidence) -> ContactEvidence:
    """The evidence of a corner when the other board stops: the scores change places."""
    return e.model_copy(update={"seam_score": e.seam_score_other, "seam_score_other": e.seam_score})
