"""Boards as solids, and the checks that they can be built; reads the model only.

OCCT takes seconds to import, so that what needs it is imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kerfwright.solid.build import assembly_solids, board_face, board_solid
    from kerfwright.solid.checker import CheckOptions, check

__all__ = ["CheckOptions", "assembly_solids", "board_face", "board_solid", "check"]

_HOME = {
    "CheckOptions": "checker",
    "assembly_solids": "build",
    "board_face": "build",
    "board_solid": "build",
    "check": "checker",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
