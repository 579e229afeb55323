"""Which boards touch, by which faces and over what area: from their surfaces, whatever a file claims."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from kerfwright.evaluate.surfaces import Body, Mesh, Samples, sample_surface

__all__ = ["Touch", "compare_touches", "touching_pairs"]

TOUCH_MM = 0.3  # glue, paint and a truthful model's rounding; what ../shared/tools/score.py takes
LEAST_AREA = 15.0  # mm2
LEAST_SAMPLES = 24  # that make a patch and not a speck
ALIGNED = 0.95  # cosine of a point's normal with the patch's
SHEET = 0.9  # cosine with the board's normal that makes a face a sheet
SAMPLES = 2**15


@dataclass(frozen=True)
class Touch:
    """One pair's patch: kinds ("sheet" or "cut") of the faces of the first and second board, and its area in mm2."""

    kinds: tuple[str, str]
    area: float

    def swapped(self) -> Touch:
        """The same seen from the second board."""
        return Touch(self.kinds[::-1], self.area)


def touching_pairs(meshes: list[Mesh], sheet_normals: list[np.ndarray]) -> dict[tuple[int, int], Touch]:
    """Pairs (i < j) whose surfaces come within 0.3 mm, facing each other, over 15 mm2 or more."""
    bodies = [Body(m) for m in meshes]
    samples = [sample_surface(m, SAMPLES, seed=1) for m in meshes]
    boxes = [(v.min(axis=0) - 1, v.max(axis=0) + 1) for v, _ in meshes]
    out = {}
    for i, j in combinations(range(len(meshes)), 2):
        if (np.maximum(boxes[i][0], boxes[j][0]) <= np.minimum(boxes[i][1], boxes[j][1])).all():
            patch = _patch(samples[i], bodies[j], samples[j], bodies[i])
            if patch:
                kinds = tuple("sheet" if abs(patch[0] @ sheet_normals[k]) > SHEET else "cut" for k in (i, j))
                out[i, j] = Touch(kinds, patch[1])
    return out


def _patch(first: Samples, second_body: Body, second: Samples, first_body: Body) -> tuple[np.ndarray, float] | None:
    """Normal of the first board's patch, and the mean of both sides' areas."""
    near_first = second_body.distance(first.points) < TOUCH_MM
    near_second = first_body.distance(second.points) < TOUCH_MM
    facing = np.concatenate([first.normals[near_first], -second.normals[near_second]])
    if len(facing) < LEAST_SAMPLES:
        return None
    votes = ((facing[:: max(1, len(facing) // 400)] @ facing.T) > 0.98).sum(axis=1)
    main = facing[:: max(1, len(facing) // 400)][votes.argmax()]
    # Rims beside the interface come within reach too, but face elsewhere.
    area_first = (near_first & (first.normals @ main > ALIGNED)).sum() * first.share
    area_second = (near_second & (second.normals @ -main > ALIGNED)).sum() * second.share
    area = float(area_first + area_second) / 2
    return (main, area) if area >= LEAST_AREA else None


def compare_touches(
    true: dict[tuple[int, int], Touch], found: dict[tuple[int, int], Touch], names: list[str]
) -> dict[str, object]:
    """Counts and names of what is right, missing, mistyped and extra; both by indices of true boards."""
    typed = [pair for pair in true if pair in found and found[pair].kinds == true[pair].kinds]
    label = {pair: f"{names[pair[0]]}-{names[pair[1]]}" for pair in {*true, *found}}
    mistyped = [p for p in true if p in found and p not in typed]
    return {
        "contacts_true": len(true),
        "contacts_right": len(true.keys() & found.keys()),
        "contacts_typed_right": len(typed),
        "contacts_area_right": sum(abs(found[p].area / true[p].area - 1) < 0.25 for p in typed),
        "contacts_missing": [label[p] for p in true if p not in found],
        "contacts_mistyped": [f"{label[p]} {'/'.join(found[p].kinds)} for {'/'.join(true[p].kinds)}" for p in mistyped],
        "contacts_extra": [label[p] for p in sorted(found) if p not in true],
    }
