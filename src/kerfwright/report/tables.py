"""The report's tables of contacts and findings."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from kerfwright.model import Contact, Finding

__all__ = ["contacts_section", "findings_section"]

_CONTACTS = {1: "edge on face", 2: "edge on face, at a corner", 3: "face on face", 4: "edge on edge"}
_DECIDED = {"geometry": "geometry", "seam": "seam in the photographs", "default": "no evidence", "inferred": "inferred"}


def contacts_section(contacts: Sequence[Contact]) -> str:
    rows = [(c.a, c.b, _how(c), f"{c.area / 100:.1f}", f"{c.angle:.1f}", _why(c)) for c in contacts]
    return _table("Contacts", ("board", "meets", "how", "area, cm²", "angle, °", "decided by"), rows, numbers=(3, 4))


def _how(contact: Contact) -> str:
    return _CONTACTS[contact.type] + (", bevelled" if contact.bevelled else "")


def _why(contact: Contact) -> str:
    evidence = contact.evidence
    text = _DECIDED[evidence.decided_by]
    if evidence.seam_score is None or evidence.seam_score_other is None:
        return text
    return f"{text}: {evidence.seam_score:.2f} against {evidence.seam_score_other:.2f} in {evidence.views} views"


def findings_section(findings: Sequence[Finding]) -> str:
    order = {"error": 0, "warning": 1, "info": 2}
    ranked = sorted(findings, key=lambda f: order[f.severity])
    rows = [(f.severity, f.code, f.message, f.remedy) for f in ranked]
    return _table("Findings", ("", "number", "what", "what to do"), rows, classes=[f.severity for f in ranked])


def _table(
    title: str,
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Sequence[int] = (),
    classes: Sequence[str] = (),
) -> str:
    if not rows:
        return f"<h2>{title}</h2><p>None.</p>"
    mark = [' class="number"' if k in numbers else "" for k in range(len(head))]
    top = "".join(f"<th{m}>{escape(h)}</th>" for m, h in zip(mark, head, strict=True))
    body = ""
    for k, row in enumerate(rows):
        cells = "".join(f"<td{m}>{escape(cell)}</td>" for m, cell in zip(mark, row, strict=True))
        body += f'<tr class="{classes[k]}">{cells}</tr>' if classes else f"<tr>{cells}</tr>"
    return f"<h2>{title}</h2><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
