"""The report's tables: contacts, findings, and what to photograph next."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from kerfwright.model import Contact, Finding
from kerfwright.report.next_views import NextView

__all__ = ["contacts_section", "findings_section", "next_section"]

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


def next_section(views: Sequence[NextView]) -> str:
    """Empty when the photographs show all that can be shown."""
    rows = [(
        f"{_side(view.turn)} {view.nearest}", f"{view.elevation:.0f}", f"{view.distance / 1000:.1f}",
        f"{100 * view.share:.0f}", ", ".join(view.boards),
    ) for view in views]
    head = ("stand", "degrees above the floor", "metres from the middle", "% more of the surface", "of boards")
    if not rows:
        return ""
    advice = "Take two or three from each place, a step apart: a point must be in two to be measured."
    return _table("Photograph these next", head, rows, numbers=(1, 2, 3)) + f'<p class="sum">{advice}</p>'


def _side(turn: float) -> str:
    if abs(turn) < 5:
        return "where you took"
    return f"{abs(turn):.0f}° to the {'right' if turn > 0 else 'left'} of"


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
