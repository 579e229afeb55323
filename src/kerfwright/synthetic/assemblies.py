"""Random assemblies that could be built: boards from a family, contacts found in their geometry, and proof of both."""

from __future__ import annotations

import numpy as np

from kerfwright.errors import ModelError, OptionError
from kerfwright.model import Board, Model, Provenance
from kerfwright.model.faults import faults
from kerfwright.model.frames import invert, matrix, transform_points
from kerfwright.model.geometry import path_polygon
from kerfwright.synthetic.contacts import find_contacts
from kerfwright.synthetic.families import FAMILIES
from kerfwright.synthetic.meshes import face_normals, mesh_in_model, volume

__all__ = ["assembled", "flaws", "random_assembly"]

CLEARANCE = 0.05  # mm; boards that touch exactly overlap by rounding


def random_assembly(family: str, seed: int, boards: int | None = None) -> Model:
    """A fabricable object: no board inside another, all connected, standing on the floor.

    Parameters
    ----------
    family : str
        A key of `FAMILIES`.
    seed : int
        Same family, seed and number of boards, same object.
    boards : int, optional
        How many boards, for families that can be asked ("cabinet", "panel").

    Raises
    ------
    OptionError
        If there is no such family, or it cannot be asked for a number of boards.
    """
    if family not in FAMILIES:
        raise OptionError(f"family: {family}: not known: take one of {', '.join(sorted(FAMILIES))}")
    if boards is not None and family not in ("cabinet", "panel"):
        raise OptionError(f"boards: {boards}: family {family} has a number of its own: take cabinet or panel")
    rng = np.random.default_rng([sorted(FAMILIES).index(family), seed])
    made = FAMILIES[family](rng) if boards is None else FAMILIES[family](rng, boards)
    return assembled(f"{family}_{seed}", made, seed)


def assembled(name: str, boards: list[Board], seed: int = 0) -> Model:
    """The model of these boards, with every contact that their geometry makes.

    Raises
    ------
    ModelError
        If the assembly cannot be built; the message lists why.
    """
    model = Model(name=name, boards=tuple(boards), provenance=Provenance(program="kerfwright synth", seed=seed))
    model = model.model_copy(update={"contacts": find_contacts(model)})
    wrong = flaws(model)
    if wrong:
        raise ModelError(f"{name}: assembly: {'; '.join(wrong)}: change the family's dimensions")
    return model


def flaws(model: Model) -> list[str]:
    """Why the assembly could not be built or would not stand; empty when it could."""
    return [*map(str, faults(model)), *_overlaps(model), *_loose(model), *_falls(model)]


def _overlaps(model: Model) -> list[str]:
    """Pairs with points of one deep inside the other, by sampling."""
    rng = np.random.default_rng(0)
    points = [_inner_points(b, rng) for b in model.boards]
    out = []
    for i, a in enumerate(model.boards):
        for j, b in enumerate(model.boards):
            if i != j and inside(a, points[j], CLEARANCE).any():
                out.append(f"{b.name} reaches into {a.name}")
    return out


def _inner_points(board: Board, rng: np.random.Generator, count: int = 4000) -> np.ndarray:
    """Points within a board and on its skin, model frame: corners and edges are what pokes into others."""
    vertices, triangles = mesh_in_model(board)
    areas = face_normals((vertices, triangles))[1]
    t = rng.choice(len(areas), count, p=areas / areas.sum())
    weights = rng.dirichlet((0.5, 0.5, 0.5), count)
    skin = np.einsum("nk,nkd->nd", weights, vertices[triangles[t]])
    return np.concatenate([skin, vertices])


def inside(board: Board, x_in_model: np.ndarray, clearance: float = 0.0) -> np.ndarray:
    """Which points (N, 3) lie in the board by more than the clearance, mm."""
    import shapely

    x = transform_points(invert(matrix(board.model_from_board)), x_in_model)
    keep = (x[:, 2] > clearance) & (x[:, 2] < board.thickness.value - clearance)
    for bevel in board.bevels:
        keep &= (x - np.array(bevel.point)) @ np.array(bevel.normal) < -clearance
    core = path_polygon(board.cut_path).buffer(-clearance)
    keep[keep] = shapely.contains_xy(core, x[keep][:, :2])
    return keep


def _loose(model: Model) -> list[str]:
    """Boards that no chain of contacts joins to the first."""
    joined, names = {model.boards[0].name}, {b.name for b in model.boards}
    while grown := {n for c in model.contacts for n in (c.a, c.b) if {c.a, c.b} & joined} - joined:
        joined |= grown
    return [f"{name} touches nothing that holds it" for name in sorted(names - joined)]


def _falls(model: Model) -> list[str]:
    """Whether the lowest point is the floor and the centre of mass lies over the feet."""
    import shapely

    meshes = [mesh_in_model(b) for b in model.boards]
    points = np.concatenate([v for v, _ in meshes])
    if abs(points[:, 2].min()) > CLEARANCE:
        return [f"the lowest point is at z = {points[:, 2].min():.2f} mm, not on the floor"]
    weights = np.array([volume(m) for m in meshes])
    centre = np.average([v.mean(axis=0) for v, _ in meshes], axis=0, weights=weights)
    feet = shapely.convex_hull(shapely.multipoints(points[points[:, 2] < CLEARANCE][:, :2]))
    stands = feet.buffer(1e-6).contains(shapely.Point(centre[:2]))
    return [] if stands else [f"it tips over: the centre of mass {centre[:2].round(1)} is not over its feet"]
