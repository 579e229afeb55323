"""The model that every stage fills and every exporter reads; imports nothing of the other folders."""

from kerfwright.model.cutpath import Arc, Bezier, Circle, CutPath, Edge, Line, Loop
from kerfwright.model.io import read_model, write_model
from kerfwright.model.quantity import Origin, Quantity
from kerfwright.model.types import (
    Bevel,
    Board,
    BuildStep,
    Choice,
    Connector,
    Contact,
    ContactEvidence,
    Finding,
    Model,
    Provenance,
    Scale,
)

__all__ = [
    "Arc",
    "Bevel",
    "Bezier",
    "Board",
    "BuildStep",
    "Choice",
    "Circle",
    "Connector",
    "Contact",
    "ContactEvidence",
    "CutPath",
    "Edge",
    "Finding",
    "Line",
    "Loop",
    "Model",
    "Origin",
    "Provenance",
    "Quantity",
    "Scale",
    "read_model",
    "write_model",
]
