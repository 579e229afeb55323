"""The libraries whose versions can change what comes out."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

__all__ = ["LIBRARIES", "library_versions"]

LIBRARIES = (
    "build123d", "cadquery", "cadquery-ocp", "casadi", "ezdxf", "numba", "numpy", "open3d", "open3d-cpu",
    "opencv-contrib-python-headless", "pydantic", "PyMaxflow", "scikit-image", "scipy", "shapely",
)


def library_versions() -> dict[str, str]:
    """Name and version of those that are installed, in the order of LIBRARIES."""
    return {name: found for name in LIBRARIES if (found := _version(name))}


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
