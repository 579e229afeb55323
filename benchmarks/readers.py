"""How far written files are from the solids, as other programs' readers see it: one function a format.

Each takes the model, its solids by name, and the files, and returns what a table's cell says.
"""

from __future__ import annotations

import csv
import json
import re
import runpy
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from kerfwright.model import Board, Model
from kerfwright.model.geometry import path_area
from kerfwright.solid import board_solid

__all__ = ["READERS"]

Solids = dict


def _step(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    from build123d import import_step

    root = import_step(str(paths[0]))
    found = {child.label: child for child in root.children}
    wanted = [name.replace(" ", "_") for name in solids]
    if list(found) != wanted:
        return f"names {list(found)}"
    coloured = sum(child.color is not None for child in root.children)
    return _difference([c.solids()[0] for c in root.children], solids) + f", {coloured} coloured"


def _brep(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    import cadquery
    from build123d import Solid

    return _difference([Solid(s.wrapped) for s in cadquery.Shape.importBrep(str(paths[0])).Solids()], solids)


def _gltf(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    import open3d

    mesh = open3d.io.read_triangle_mesh(str(paths[0]))
    a, b, c = (np.asarray(mesh.vertices)[np.asarray(mesh.triangles)[:, k]] * 1000 for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    return f"{_share(volume, sum(s.volume for s in solids.values())):.0e}"


def _script(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    space = runpy.run_path(str(paths[0]), run_name="program")
    return _difference(space["assembly"]().children, solids)


def _cadquery(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    from build123d import Solid

    children = runpy.run_path(str(paths[0]), run_name="program")["assembly"]().children
    return _difference([Solid(c.obj.val().located(c.loc).wrapped) for c in children], solids)


def _difference(found: Sequence, solids: Solids) -> str:
    """The largest difference of volumes, as a share, and of places, mm."""
    if len(found) != len(solids):
        return f"{len(found)} solids of {len(solids)}"
    pairs = list(zip(found, solids.values(), strict=True))
    volume = max(_share(a.volume, b.volume) for a, b in pairs)
    place = max((a.center() - b.center()).length for a, b in pairs)
    invalid = sum(not a.is_valid for a, _ in pairs)
    return f"{volume:.0e}, {place:.0e} mm" + (f", {invalid} INVALID" if invalid else "")


def _share(found: float, wanted: float) -> float:
    return abs(found / wanted - 1)


def _dxf(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    import ezdxf

    worst = 0.0
    for board, path in zip(model.boards, paths, strict=True):
        document = ezdxf.readfile(path)
        auditor = document.audit()
        if auditor.has_errors or auditor.has_fixes:
            return f"{path.name} does not pass its audit"
        space = document.modelspace()
        worst = max(worst, _share(_dxf_area(space, "OUTSIDE") - _dxf_area(space, "INSIDE"), _face_area(board)))
    return f"{100 * worst:.3f} %"


def _dxf_area(space: object, layer: str) -> float:
    """What closed polylines and circles of a layer enclose, mm2; bulges by the formula of the circle's segment."""
    total = sum(np.pi * c.dxf.radius**2 for c in space.query(f'CIRCLE[layer=="{layer}"]'))
    for line in space.query(f'LWPOLYLINE[layer=="{layer}"]'):
        assert line.closed
        x, y, bulge = np.array(line.get_points("xyb")).T
        ahead = np.roll(x, -1), np.roll(y, -1)
        sweep, chord = 4 * np.arctan(bulge), np.hypot(ahead[0] - x, ahead[1] - y)
        bow = np.abs(sweep) > 1e-12
        radius = np.where(bow, chord / np.where(bow, 2 * np.sin(sweep / 2), 1), 0)
        total += abs(float((x * ahead[1] - ahead[0] * y).sum() + (radius**2 * (sweep - np.sin(sweep))).sum()) / 2)
    return total


def _face_area(board: Board) -> float:
    """Area of the solid's larger sheet face; of bevelled boards their outline, which no face has."""
    if board.bevels:
        return path_area(board.cut_path)
    return max(f.area for f in board_solid(board).faces() if abs(f.normal_at().Z) > 0.999)


def _svg(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    import svgpathtools

    worst = 0.0
    for board, path in zip(model.boards, paths, strict=True):
        area = 0.0
        for element in re.findall(r"<(?:path|circle) [^>]*>", path.read_text(encoding="utf-8")):
            sign = 1 if 'cutType="outside"' in element else -1
            if found := re.search(r' r="([\d.]+)"', element):
                area += sign * np.pi * float(found[1]) ** 2
            else:
                curve = svgpathtools.parse_path(re.search(r' d="([^"]+)"', element)[1])
                z = np.array([s.point(t) for s in curve for t in np.linspace(0, 1, 100, endpoint=False)])
                area += sign * abs(float((z.real @ np.roll(z.imag, -1) - z.imag @ np.roll(z.real, -1)) / 2))
        worst = max(worst, _share(area, _face_area(board)))
    return f"{100 * worst:.3f} %"


def _sheets(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    """Boards laid, sheets, share used, and the least distance of two outlines in the DXF files."""
    import ezdxf
    import shapely
    from ezdxf import path as ezpath

    least, count = np.inf, 0
    for path in (p for p in paths if p.suffix == ".dxf"):
        document = ezdxf.readfile(path)
        assert not document.audit().has_errors
        lines = document.modelspace().query('*[layer=="OUTSIDE" | layer=="INSIDE"]')
        rings = [shapely.LinearRing([(p.x, p.y) for p in ezpath.make_path(e).flattening(0.01)]) for e in lines]
        outer = [r for e, r in zip(lines, rings, strict=True) if e.dxf.layer == "OUTSIDE"]
        count += len(outer)
        least = min([least, *(a.distance(b) for a, b in combinations(outer, 2))])
    summary = json.loads(next(p for p in paths if p.suffix == ".json").read_text())
    used = f"{count} boards on {len(summary['sheets'])}, {100 * summary['utilisation']:.0f} %"
    return used + (f", {least:.2f} mm apart" if np.isfinite(least) else "")


def _cutlist(model: Model, solids: Solids, paths: Sequence[Path]) -> str:
    with paths[0].open(encoding="utf-8-sig", newline="") as stream:
        rows = list(csv.DictReader(stream, delimiter=";"))
    return f"{sum(int(row['Quantity']) for row in rows)} boards in {len(rows)} rows"


READERS = {
    "brep": _brep, "cadquery": _cadquery, "cutlist": _cutlist, "dxf": _dxf, "gltf": _gltf, "script": _script,
    "sheets": _sheets, "step": _step, "step214": _step, "svg": _svg,
}  # fmt: skip
