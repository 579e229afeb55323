"""Cut sheets in the report: drawn as they were laid."""

import xml.etree.ElementTree as ET

import simple
from kerfwright.report.cutting import CutSheet, LaidPart, sheets_section


def sheet(name="leg") -> CutSheet:
    loops = (simple.hole(30, 30, 10), simple.polygon([(10.0, 10.0), (310.0, 10.0), (310.0, 70.0), (10.0, 70.0)]))
    upright = simple.polygon([(400.0, 10.0), (440.0, 10.0), (440.0, 500.0), (400.0, 500.0)])
    return CutSheet(18.04, 2440, 1220, 0.123, (LaidPart(name, loops), LaidPart("top", (upright,))))


def test_a_sheet_is_drawn_and_described():
    html = sheets_section([sheet()])
    assert "2440 × 1220 × 18.0 mm: 2 boards, 12 % used" in html
    svg = ET.fromstring(html[html.index("<svg") : html.index("</svg>") + 6])
    (group,) = svg.findall("g")
    first, second = group.findall("path")
    assert first.get("d").count("A") == 2 and first.get("d").endswith("L10 70L10 10Z")
    assert second.get("d").startswith("M400 10")
    assert [t.text for t in group.findall("text")] == ["leg", "top"]
    assert "rotate(-90)" in group.findall("text")[1].get("transform"), "along the longer side"


def test_names_cannot_become_markup():
    assert "<img" not in sheets_section([sheet("<img src=x>")])


def test_why_there_is_none():
    assert sheets_section([]) == ""
    assert "does not fit &lt;2440" in sheets_section([], "board 'a': does not fit <2440")
