"""The model: boards, how they meet, and what is known about both.

Frames: *model* is right-handed, millimetres, +z up, the floor at z = 0. *board* has the sheet planes z = 0 ("bottom")
and z = thickness ("top"), +x along the longest straight edge. Transforms are named target_from_source and are 4x4,
row-major: x_in_model = model_from_board @ x_in_board.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from kerfwright.model.cutpath import CutPath
from kerfwright.model.quantity import Frozen, Origin, Quantity

__all__ = [
    "Bevel",
    "Board",
    "BuildStep",
    "Choice",
    "Connector",
    "Contact",
    "ContactEvidence",
    "Face",
    "Finding",
    "Matrix4",
    "Model",
    "Point3",
    "Provenance",
    "Scale",
]

Point3 = tuple[float, float, float]
Row4 = tuple[float, float, float, float]
Matrix4 = tuple[Row4, Row4, Row4, Row4]
Face = Literal["top", "bottom", "edge"]

FORMAT_VERSION = 1


class Bevel(Frozen):
    """A slanted cut face.

    The cut path is the outline of the board before bevelling (its largest extent over the thickness). Along the
    straight stretch start-end of the outer loop, what lies beyond the plane through `point` with outward `normal`
    (board frame) is cut away. Two bevels on one stretch make a pointed end.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    point: Point3
    normal: Point3
    angle: Quantity  # degrees between the cut face and a square cut; positive: the top is the shorter side
    contact: int | None = None  # index in Model.contacts


class Board(Frozen):
    """A piece cut out of sheet stock."""

    name: str = Field(min_length=1)
    model_from_board: Matrix4
    thickness: Quantity
    cut_path: CutPath
    bevels: tuple[Bevel, ...] = ()
    stock: str | None = None  # label of the stock thickness it was snapped to
    same_as: str | None = None  # name of the first of the congruent boards, when this is a repeat
    mirrored: bool = False  # whether it is the mirror image of that board
    pose_origin: Origin = Origin.MEASURED
    angle_error: float | None = None  # standard error of the sheet normal, degrees
    outline_origin: Literal["images", "cloud", "inferred"] = "cloud"
    points: int = 0  # cloud points on it
    notes: tuple[str, ...] = ()


class ContactEvidence(Frozen):
    """Why a contact is what it is."""

    seam_score: float | None = None  # of the chosen way to meet at a corner
    seam_score_other: float | None = None  # of the way not chosen
    views: int = 0  # photographs that showed the seam
    decided_by: Literal["geometry", "seam", "default", "inferred"] = "geometry"


class Contact(Frozen):
    """Two boards touching (paper, Connections; types 1 to 4).

    Type 1: a cut face of `b` on a sheet plane of `a`, and only `b` could end there. Type 2: the same at a corner where
    either could. Type 3: sheet on sheet. Type 4: cut on cut. The plane's normal points from `a` to `b`, model frame.
    """

    type: Literal[1, 2, 3, 4]
    a: str
    b: str
    face_a: Face
    face_b: Face
    point: Point3
    normal: Point3
    interface: tuple[tuple[Point3, ...], ...]  # polygons on the plane, counter-clockwise about the normal
    area: float  # mm2
    angle: float  # degrees between the two sheet normals, 0 to 90
    bevelled: bool = False
    origin: Origin = Origin.MEASURED
    evidence: ContactEvidence = ContactEvidence()


class Finding(Frozen):
    """Something a person should know; `error` forbids an export."""

    code: str = Field(pattern=r"^K\d{3}$")
    severity: Literal["error", "warning", "info"]
    message: str
    remedy: str = ""
    boards: tuple[str, ...] = ()
    value: float | None = None


class Connector(Frozen):
    """A screw, nail or dowel through a contact."""

    contact: int
    kind: str
    head: Point3
    tip: Point3


class BuildStep(Frozen):
    """One step of the assembly: what is put on, and along which way."""

    boards: tuple[str, ...]
    direction: Point3 | None = None
    text: str = ""


class Scale(Frozen):
    """Millimetres of one capture unit."""

    millimetres_per_unit: float = Field(gt=0)
    origin: Literal["assumed", "given", "file", "measured", "inferred"] = "assumed"
    standard_error: float | None = None
    note: str = ""


class Choice(Frozen):
    """How the boards were chosen among what could be boards; see `kerfwright.identify.selection`.

    Attributes
    ----------
    objective : of the boards chosen; larger is better, and 1 would be all of the surface explained at no cost.
    bound : what no choice among the candidates exceeds; None where the method proves nothing.
    explained : share of the surface observed that the boards explain.
    """

    method: Literal["exact", "annealing"]
    candidates: int
    chosen: int
    objective: float
    bound: float | None
    gap: float | None  # bound less objective
    explained: float


class Provenance(Frozen):
    """What the model was made from; no times, no machine names: these are in run.json."""

    program: str = "kerfwright"
    version: str = ""
    capture: str = ""  # folder name
    images: int = 0
    points: int = 0
    seed: int = 0
    options: dict[str, str | int | float | bool | None] = Field(default_factory=dict)
    choice: Choice | None = None  # None for models that were not reconstructed


class Model(Frozen):
    """An assembly of boards."""

    format: Literal["kerfwright-model"] = "kerfwright-model"
    version: Literal[1] = FORMAT_VERSION
    name: str = "assembly"
    boards: tuple[Board, ...] = ()
    contacts: tuple[Contact, ...] = ()
    findings: tuple[Finding, ...] = ()
    connectors: tuple[Connector, ...] = ()
    build_steps: tuple[BuildStep, ...] = ()
    scale: Scale = Scale(millimetres_per_unit=1000.0)
    capture_from_model: Matrix4 = ((1e-3, 0, 0, 0), (0, 1e-3, 0, 0), (0, 0, 1e-3, 0), (0, 0, 0, 1))
    provenance: Provenance = Provenance()
