"""Generated build123d programs, run with changed dimensions, and what holds of the result."""

import re
from functools import cache
from itertools import combinations

import numpy as np

from kerfwright.solid.build import solid_is_valid
from kerfwright.solid.contacts import meet
from kerfwright.solid.faces import shape_of
from kerfwright.solid.interference import common_volume, penetration

LEAST_AREA = 15.0  # mm2, as score.py counts contacts


def dimensions(source: str) -> dict[str, float]:
    """The named dimensions that stand at the top as plain numbers."""
    found = re.findall(r"^(WIDTH|DEPTH|HEIGHT|STOCK_\w+) = ([\d.]+)$", source, re.MULTILINE)
    return {name: float(value) for name, value in found}


def run(source: str, **changes: float) -> tuple[dict, dict]:
    """Solids and sheet normals by board, after setting some of the dimensions."""
    for name, value in changes.items():
        source, count = re.subn(rf"^{name} = .*$", f"{name} = {value!r}", source, flags=re.MULTILINE)
        assert count == 1
    space = {"__name__": "program"}
    exec(compile(source, "model_build123d.py", "exec"), space)
    solids = {child.label: child for child in space["assembly"]().children}
    sheets = [value for value in space.values() if type(value).__name__ == "Sheet"]
    return solids, dict(zip(solids, (np.array(tuple(s.normal)) for s in sheets), strict=True))


def typed_contacts(solids: dict, normals: dict) -> dict:
    """{(a, b): ("sheet" or "cut", the same)} of the boards that touch, by their largest meeting."""
    shapes = {name: shape_of(name, solid) for name, solid in solids.items()}
    found = {}
    for a, b in combinations(shapes, 2):
        meetings = []
        for face in shapes[a].faces:
            met = meet(shapes[a], shapes[b], face.normal, 0.01, np.radians(0.1))
            if met and met.area > LEAST_AREA:
                meetings.append((met.area, tuple(kind(face.normal, normals[n]) for n in (a, b))))
        if meetings:
            found[a, b] = max(meetings)[1]
    return found


def kind(direction: np.ndarray, normal: np.ndarray) -> str:
    return "sheet" if abs(direction @ normal) > 0.999 else "cut"


def interference(solids: dict) -> float:
    """Volume that boards share, mm3."""
    shapes = [shape_of(name, solid) for name, solid in solids.items()]
    return sum(common_volume(a, b) for a, b in combinations(shapes, 2) if penetration(a, b) > 1e-3)


@cache
def contacts_as_written(source: str) -> dict:
    return typed_contacts(*run(source))


def problems(source: str, **changes: float) -> list[str]:
    """What is wrong after the change, compared with the program as it was written."""
    before = contacts_as_written(source)
    try:
        solids, normals = run(source, **changes)
        after = typed_contacts(solids, normals)  # fails on a solid that lost its faces
    except (ValueError, RuntimeError, AttributeError) as error:
        return [f"does not run: {error}"]
    wrong = [f"{name} is not valid" for name, solid in solids.items() if not solid_is_valid(solid)]
    changed = [p for p in sorted(before.keys() | after.keys()) if before.get(p) != after.get(p)]
    wrong += [f"contact {pair} was {before.get(pair)}, is {after.get(pair)}" for pair in changed]
    shared = interference(solids)
    return wrong + ([f"{shared:.1f} mm3 shared"] if shared > 1 else [])
