"""Families of objects: each a function from a random generator to boards in the model's frame, floor at z = 0."""

from kerfwright.synthetic.families.boxes import mitred_frame, skewed_box, tray
from kerfwright.synthetic.families.panels import panel, single
from kerfwright.synthetic.families.seating import bench, stool, table, tilted_stool
from kerfwright.synthetic.families.shelving import bookcase, cabinet, crossed_frame, rack

__all__ = ["FAMILIES"]

FAMILIES = {
    "bench": bench,
    "bookcase": bookcase,
    "cabinet": cabinet,
    "crossed_frame": crossed_frame,
    "mitred_frame": mitred_frame,
    "panel": panel,
    "rack": rack,
    "single": single,
    "skewed_box": skewed_box,
    "stool": stool,
    "table": table,
    "tilted_stool": tilted_stool,
    "tray": tray,
}
