"""OCCT's own format: exact shapes, no names."""

from __future__ import annotations

from pathlib import Path

from kerfwright.errors import ExportError
from kerfwright.model import Model
from kerfwright.model.io import write_bytes
from kerfwright.solid import assembly_solids
from kerfwright_exporters.naming import STAMP
from kerfwright_exporters.options import ExportOptions
from kerfwright_exporters.steady import without_noise

__all__ = ["export"]


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `model.brep`: one compound, the boards in the model's order.

    The format has no place for a remark: an unverified model's file says so in its name.

    Raises
    ------
    ExportError
        If OCCT cannot write it.
    """
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Compound

    path = Path(out_dir) / (f"model {STAMP}.brep" if options.unverified else "model.brep")
    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    for _, solid in assembly_solids(model):
        builder.Add(compound, solid.wrapped)
    beside = path.with_name(".occt.brep")
    try:
        if not BRepTools.Write_s(compound, str(beside)):
            raise ExportError(f"{path}: OCCT could not write it: check that the folder can be written")
        text = beside.read_text(encoding="ascii")
    finally:
        beside.unlink(missing_ok=True)
    write_bytes(path, without_noise(text, "0").encode("ascii"))
    return [path]
