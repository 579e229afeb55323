"""`kerfwright doctor`: is everything here that kerfwright needs?"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator

import typer

__all__ = ["doctor"]

# Module, distribution, and what it is for.
_MODULES = (
    ("numpy", "numpy", "numbers"),
    ("scipy.optimize", "scipy", "selection"),
    ("cv2", "opencv", "photographs"),
    ("open3d", "open3d", "clouds and rays"),
    ("numba", "numba", "speed"),
    ("maxflow", "PyMaxflow", "segmentation"),
    ("casadi", "casadi", "alignment"),
    ("skimage.measure", "scikit-image", "outlines"),
    ("shapely", "shapely", "outlines"),
    ("build123d", "build123d", "solids"),
    ("ezdxf", "ezdxf", "DXF"),
    ("kerfwright_exporters", "kerfwright's exporters", "other programs"),
)
# Those that only some captures need, and how to get them.
_OPTIONAL = (
    ("laspy", "LAS and LAZ clouds", "pip install 'laspy[lazrs]'"),
    ("pye57", "E57 clouds", "pip install pye57"),
    ("pycolmap", "kerfwright poses", "pip install 'pycolmap>=3.11,<5'"),
)
MEMORY_GIB = 3  # a capture of 40 photographs and 300,000 points takes up to 2.5
DISK_GIB = 1


def doctor() -> None:
    """Check the installation and the machine. Exit code 1 when something is missing."""
    problems = 0
    for sound, line in _examinations():
        typer.echo(f"{'ok ' if sound else 'BAD'}  {line}")
        problems += not sound
    typer.echo("All is well." if not problems else f"{problems} problem(s): see the lines that begin with BAD.")
    raise typer.Exit(1 if problems else 0)


def _examinations() -> Iterator[tuple[bool, str]]:
    version = ".".join(map(str, sys.version_info[:3]))
    yield (3, 11) <= sys.version_info < (3, 13), f"Python {version} (3.11 or 3.12 is needed)"
    for module, name, purpose in _MODULES:
        yield _import(module, name, purpose)
    for module, purpose, remedy in _OPTIONAL:
        yield _optional(module, purpose, remedy)
    yield _capture()
    yield _memory()
    free = shutil.disk_usage(os.getcwd()).free / 2**30
    yield free > DISK_GIB, f"{free:.1f} GiB free on the disk of this folder"


def _import(module: str, name: str, purpose: str) -> tuple[bool, str]:
    """Import in earnest: a library may be installed and lack a system library that it loads."""
    from importlib import import_module

    try:
        found = import_module(module)
    except Exception as error:  # whatever a broken installation raises is the finding
        reason = " ".join(str(error).split())
        return False, f"{name}, for {purpose}: {reason}: run `pip install kerfwright` again; see README, Start"
    root = sys.modules[module.split(".")[0]]
    version = getattr(root, "__version__", "") or getattr(found, "__version__", "")
    version = version if isinstance(version, str) else ""  # of pye57 it is a module
    return True, f"{name} {version}".rstrip() + f", for {purpose}"


def _optional(module: str, purpose: str, remedy: str) -> tuple[bool, str]:
    """Not there is sound; there and broken is not."""
    from importlib.util import find_spec

    if find_spec(module) is None:
        return True, f"{module} is not installed; only {purpose} would need it: {remedy}"
    return _import(module, module, purpose)


def _capture() -> tuple[bool, str]:
    from kerfwright.demo import demo_capture
    from kerfwright.errors import CaptureError

    try:
        return True, f"the capture that ships: {demo_capture()}"
    except CaptureError as error:
        return False, str(error)


def _memory() -> tuple[bool, str]:
    import psutil

    free = psutil.virtual_memory().available / 2**30
    return free > MEMORY_GIB, f"{free:.1f} GiB of memory free on {os.cpu_count()} cores ({MEMORY_GIB} GiB are enough)"
