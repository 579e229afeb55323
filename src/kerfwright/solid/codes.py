"""The checker's findings by number: K1xx errors, K2xx warnings, K3xx notes.

K101 to K108 are contradictions of the model, worded where they are found (`kerfwright.model.faults`).
"""

from __future__ import annotations

from kerfwright.model import Finding

__all__ = ["finding"]

# code: (what is the matter, what to do)
_TEXTS = {
    "K109": ("{why}", "redraw the cut path or correct the bevels"),
    "K110": (
        "{a} and {b} run into each other: {volume:.1f} mm3, up to {depth:.2f} mm deep",
        "shorten one of them to the other's face",
    ),
    "K111": (
        "{a} and {b}: contact {index} does not touch within {reach:g} mm",
        "bring them together, or drop the contact",
    ),
    "K112": ("{a}: touches none of the boards that hold together", "bring it to its neighbours, or drop it"),
    "K201": ("{a} and {b}: gap of {value:.3f} mm at contact {index}", "lengthen {b} to the face of {a}"),
    "K202": ("{a} and {b}: overlap of {value:.3f} mm at contact {index}", "shorten {b} to the face of {a}"),
    "K203": (
        "{a}: inside radius {value:.2f} mm at ({x:.1f}, {y:.1f}) is below the tool's {tool:g} mm",
        "export with relief cuts, take a smaller tool or finish by hand",
    ),
    "K204": (
        "{a}: a web or finger is about {value:.1f} mm wide, less than {web:g} mm",
        "widen it, or cut it with care",
    ),
    "K205": (
        "{a}: bevel {index} of {value:+.1f} degrees is beyond the saw's {limit:g}",
        "cut it with the board on edge, or turn the joint round",
    ),
    "K206": ("{a}: does not fit a sheet of {length:g} x {width:g} mm", "take a larger sheet, or make the board of two"),
    "K207": ("nothing stands on the floor: the lowest point is at {value:.1f} mm", "lower the model to z = 0"),
    "K208": ("the centre of mass is not above the feet: it tips over", "fix it to a wall, or widen its feet"),
    "K209": (
        "{a}: bevel {index} says {said:+.2f} degrees, its plane {value:+.2f}",
        "trust the plane: the solids are cut by it",
    ),
    "K210": ("{a} and {b}: contact {index} says {said:.0f} mm2, the solids meet on {value:.0f}", "trust the solids"),
    "K211": (
        "the whole is only {value:.2g} mm long: it is checked as if it were {size:g} mm",
        "give its size: --length or --scale",
    ),
    "K301": (
        "{a} and {b} touch on {value:.0f} mm2, and no contact says so",
        "add the contact if they are to be joined",
    ),
}
_SEVERITIES = {"1": "error", "2": "warning", "3": "info"}


def finding(code: str, *boards: str, value: float | None = None, **details: object) -> Finding:
    """A finding about none, one or two boards: {a} and {b} in its text."""
    names = dict(zip("ab", boards, strict=False))
    message, remedy = (text.format(value=value, **names, **details) for text in _TEXTS[code])
    return Finding(code=code, severity=severity(code), message=message, remedy=remedy, boards=boards, value=value)


def severity(code: str) -> str:
    """What the number's first digit says."""
    return _SEVERITIES[code[1]]
