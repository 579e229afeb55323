"""How layers are called: one for each operation, by one of the presets."""

from __future__ import annotations

from kerfwright_exporters.options import ExportOptions

__all__ = ["PRESETS", "layer_colour", "layer_name"]

# {angle}, {depth}: degrees, and millimetres or inches as the file has it.
PRESETS: dict[str, dict[str, str]] = {
    # what is done, nothing else
    "plain": {
        "inside": "INSIDE", "outside": "OUTSIDE", "inside_kerf": "INSIDE_KERF", "outside_kerf": "OUTSIDE_KERF",
        "bevel": "BEVEL_{angle}", "label": "ENGRAVE", "stamp": "NOT_VERIFIED", "sheet": "SHEET",
        "dimension": "DIMENSION",
    },
    # with the depth of the cut, for programs that take the tool's depth from the layer's name
    "depth": {
        "inside": "INSIDE_{depth}", "outside": "OUTSIDE_{depth}", "inside_kerf": "INSIDE_KERF_{depth}",
        "outside_kerf": "OUTSIDE_KERF_{depth}", "bevel": "BEVEL_{angle}", "label": "ENGRAVE", "stamp": "NOT_VERIFIED",
        "sheet": "SHEET", "dimension": "DIMENSION",
    },
    # sorted by name is the order of cutting
    "numbered": {
        "label": "1_ENGRAVE", "inside": "2_INSIDE", "inside_kerf": "2_INSIDE_KERF", "outside": "3_OUTSIDE",
        "outside_kerf": "3_OUTSIDE_KERF", "bevel": "4_BEVEL_{angle}", "stamp": "NOT_VERIFIED", "sheet": "0_SHEET",
        "dimension": "0_DIMENSION",
    },
}  # fmt: skip

_COLOURS = {  # of AutoCAD's colour index; 7 is black on white and white on black
    "inside": 5, "outside": 7, "inside_kerf": 4, "outside_kerf": 3, "bevel": 1, "label": 6, "stamp": 1, "sheet": 8,
    "dimension": 8,
}  # fmt: skip


def layer_name(operation: str, options: ExportOptions, *, angle: float = 0.0, depth: float = 0.0) -> str:
    """The layer of an operation; angle in degrees, depth in mm."""
    deep = f"{depth / options.per_unit:.{3 if options.units == 'in' else 1}f}{options.units.upper()}"
    return PRESETS[options.layers][operation].format(angle=f"{angle:+.1f}", depth=deep)


def layer_colour(operation: str) -> int:
    """AutoCAD colour index."""
    return _COLOURS[operation]
