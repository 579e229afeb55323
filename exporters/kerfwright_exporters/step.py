"""STEP AP242 and AP214: an assembly of named, coloured boards in millimetres."""

from __future__ import annotations

import re
from itertools import count
from pathlib import Path
from typing import Any

from kerfwright.errors import ExportError
from kerfwright.model import Model
from kerfwright.model.frames import model_from_board
from kerfwright.model.io import write_bytes
from kerfwright.solid import board_solid
from kerfwright.solid.build import location
from kerfwright_exporters.naming import board_colours, plain_name, title
from kerfwright_exporters.options import ExportOptions
from kerfwright_exporters.steady import without_noise, wrapped_records

__all__ = ["assembly_document", "export", "export_ap214"]

# Files say what they hold, not when they were made: the same model gives the same bytes.
TIMESTAMP = "2000-01-01T00:00:00"


def export(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `model.step`, application protocol 242 (ISO 10303-242).

    Raises
    ------
    ExportError
        If OCCT cannot write the assembly.
    """
    return [_write(model, Path(out_dir) / "model.step", "AP242DIS", options)]


def export_ap214(model: Model, out_dir: Path, options: ExportOptions) -> list[Path]:
    """Write `model_ap214.step`, application protocol 214, for older programs."""
    return [_write(model, Path(out_dir) / "model_ap214.step", "AP214IS", options)]


def assembly_document(model: Model) -> Any:
    """An OCCT document (TDocStd_Document): one root, one component a board, each in its place and with a
    placeholder for its name."""
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = _new_document()
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())

    def name(label: Any, text: str) -> None:
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(text))

    root = shapes.NewShape()
    name(root, _placeholder(0))
    for index, board in enumerate(model.boards, start=1):
        part = shapes.AddShape(board_solid(board).wrapped, False)
        component = shapes.AddComponent(root, part, location(model_from_board(board)).wrapped)
        name(part, _placeholder(index))
        name(component, _placeholder(index))
    shapes.UpdateAssemblies()
    return document


def _placeholder(index: int) -> str:
    """What stands for a name while OCCT writes: it garbles letters beyond ASCII, and breaks long names in two."""
    return f"~{index}~"


def _named(text: str, model: Model, options: ExportOptions) -> str:
    """The names in their places, encoded as ISO 10303-21 has it."""
    names = [title(model, options.unverified), *(plain_name(board.name) for board in model.boards)]
    return re.sub(r"'~(\d+)~'", lambda found: f"'{_encoded(names[int(found[1])])}'", text)


def _encoded(name: str) -> str:
    planes = (("2", "utf-16-be", "[\u0080-\uffff]+"), ("4", "utf-32-be", "[\U00010000-\U0010ffff]+"))
    for kind, encoding, letters in planes:
        name = re.sub(letters, lambda run, k=kind, e=encoding: f"\\X{k}\\{run[0].encode(e).hex().upper()}\\X0\\", name)
    return name


def _new_document() -> Any:
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFApp import XCAFApp_Application
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    application = XCAFApp_Application.GetApplication_s()
    application.NewDocument(TCollection_ExtendedString("MDTV-XCAF"), document)
    application.InitDocument(document)
    XCAFDoc_DocumentTool.SetLengthUnit_s(document, 1e-3)
    return document


def _write(model: Model, path: Path, schema: str, options: ExportOptions) -> Path:
    if not model.boards:
        raise ExportError(f"{path}: boards: none: a STEP file needs at least one board")
    beside = path.with_name(f".{path.stem}.occt.step")
    try:
        _transfer(assembly_document(model), beside, schema)
        text = beside.read_text(encoding="ascii")
    finally:
        beside.unlink(missing_ok=True)
    write_bytes(path, _named(_coloured(_steady(text), model), model, options).encode("ascii"))
    return path


def _transfer(document: Any, path: Path, schema: str) -> None:
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Controller, STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_HAsciiString
    from OCP.XSControl import XSControl_WorkSession

    _quiet()
    STEPCAFControl_Controller.Init_s()  # before the settings: it brings the defaults in
    Interface_Static.SetCVal_s("write.step.schema", schema)
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer = STEPCAFControl_Writer(XSControl_WorkSession(), False)
    writer.SetNameMode(True)
    done = writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    header = APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    header.SetName(TCollection_HAsciiString(_placeholder(0)))
    header.SetTimeStamp(TCollection_HAsciiString(TIMESTAMP))
    header.SetOriginatingSystem(TCollection_HAsciiString("kerfwright"))
    if not done or writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise ExportError(f"{path}: OCCT could not write the assembly: check that the folder can be written")


def _quiet() -> None:
    """Keep OCCT's chatter off the console."""
    from OCP.Message import Message, Message_Gravity

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)


def _steady(text: str) -> str:
    """No rounding noise, and occurrences counted from 1: OCCT goes on counting from one export to the next."""
    numbers = count(1)
    text = wrapped_records(without_noise(text, "0."))
    return re.sub(r"(NEXT_ASSEMBLY_USAGE_OCCURRENCE\(\s*')\d+'", lambda found: f"{found[1]}{next(numbers)}'", text)


def _coloured(text: str, model: Model) -> str:
    """Give every board's solid its colour (ISO 10303-46).

    OCCT would write the colours in the order of memory addresses, another one in every run.
    """
    solids = re.findall(r"ADVANCED_BREP_SHAPE_REPRESENTATION\(\s*'[^']*',\s*\(([^)]*)\),\s*#(\d+)\s*\)", text)
    breps = set(re.findall(r"#(\d+) = MANIFOLD_SOLID_BREP\(", text))
    free = max(int(n) for n in re.findall(r"^#(\d+) = ", text, re.MULTILINE)) + 1
    lines: list[str] = []
    for (items, context), rgb in zip(solids, board_colours(model), strict=True):
        brep = next(n for n in re.findall(r"#(\d+)", items) if n in breps)
        lines += _style(free + len(lines), brep, context, rgb)
    body, end = text.rsplit("ENDSEC;", 1)
    return body + "".join(f"{line}\n" for line in lines) + "ENDSEC;" + end


def _style(first: int, brep: str, context: str, rgb: tuple[float, float, float]) -> list[str]:
    """The entities that colour one solid, numbered from `first`."""
    records = (
        "COLOUR_RGB('',{:.3f},{:.3f},{:.3f})".format(*rgb),
        f"FILL_AREA_STYLE_COLOUR('',#{first})",
        f"FILL_AREA_STYLE('',(#{first + 1}))",
        f"SURFACE_STYLE_FILL_AREA(#{first + 2})",
        f"SURFACE_SIDE_STYLE('',(#{first + 3}))",
        f"SURFACE_STYLE_USAGE(.BOTH.,#{first + 4})",
        f"PRESENTATION_STYLE_ASSIGNMENT((#{first + 5}))",
        f"STYLED_ITEM('color',(#{first + 6}),#{brep})",
        f"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#{first + 7}),#{context})",
    )
    return [f"#{first + k} = {record};" for k, record in enumerate(records)]
