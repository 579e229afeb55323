"""Score a model against the truth."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from kerfwright.evaluate.figures import GOOD, board_figures, match_boards, shown_boards, surface_figures
from kerfwright.evaluate.nodes import compare_nodes
from kerfwright.evaluate.rough import rough_figures
from kerfwright.evaluate.stages import stage_model
from kerfwright.evaluate.surfaces import Body, Mesh
from kerfwright.evaluate.touching import Touch, compare_touches, touching_pairs
from kerfwright.evaluate.truth import Truth, read_truth
from kerfwright.model import Model
from kerfwright.solid import assembly_solids
from kerfwright.synthetic.meshes import mesh_in_model

__all__ = ["boards_in_cloud", "evaluate", "evaluate_model"]

HIDDEN = 50  # cloud points below which nobody could have seen the board
TESSELLATION = 0.2  # mm and radians, of curved faces
NEAR_SHARE = 0.03  # of D: cloud points further away are not the object's


def evaluate(model_dir: Path | str, truth_dir: Path | str, stage: str | None = None) -> dict[str, object]:
    """Figures of an output folder against a truth folder; keys as ../shared/tools/score.py names them, and more.

    Parameters
    ----------
    model_dir : Path
        Holds model.json; for an earlier stage, its .cache too.
    truth_dir : Path
        Holds truth.json and frame.json; cloud.ply lies beside it.
    stage : {"identify", "assemble", "refine"}, optional
        Score what was known after that stage. Contacts of "assemble" are those it lists; rough boards don't touch.

    Raises
    ------
    KerfwrightError
        If either folder lacks what it should hold.
    """
    model, truth = stage_model(Path(model_dir), stage), read_truth(Path(truth_dir))
    return evaluate_model(model, truth, rough=stage in ("identify", "assemble"))


def evaluate_model(model: Model, truth: Truth, rough: bool = False) -> dict[str, object]:
    """The same for a model and a truth in memory.

    Parameters
    ----------
    rough : bool
        The boards are not cut to fit yet: count the contacts that the model lists instead of those that its surfaces
        make, count boards by sheet plane and region besides, and leave out what asks for solids and nodes.
    """
    truth_from_model = np.linalg.inv(truth.capture_from_truth) @ np.array(model.capture_from_model)
    if not model.boards:
        return _nothing(truth)
    solids = [] if rough else assembly_solids(model)
    meshes = [mesh_in_model(b) for b in model.boards] if rough else [_mesh(solid) for _, solid in solids]
    found = [_moved(truth_from_model, mesh) for mesh in meshes]
    true = [board.mesh for board in truth.boards]
    overlap, match = match_boards(true, found)
    touches, pairs = _touches(model, truth, found, match, rough)
    want = touching_pairs(true, [b.normal for b in truth.boards])
    out = {**_part_figures(model, truth, overlap, match), **surface_figures(true, found, truth.cloud)}
    out |= compare_touches(want, touches, [b.name for b in truth.boards]) | {"contacts_found": pairs}
    out["boards"] = _boards(truth, model, found, overlap, match)
    if truth.cloud is not None:
        out |= _seen_figures(truth, overlap, match, want, touches, out["boards"])
    if rough:
        return out | rough_figures(truth, model, truth_from_model)
    return (
        out
        | _node_figures(truth, model, match, truth_from_model, out["boards"])
        | _solid_figures(solids, truth_from_model)
    )


def _mesh(solid) -> Mesh:
    vertices, triangles = solid.tessellate(TESSELLATION, TESSELLATION)
    return np.array([tuple(v) for v in vertices], float), np.array(triangles, int)


def _moved(target_from_source: np.ndarray, mesh: Mesh) -> Mesh:
    return mesh[0] @ target_from_source[:3, :3].T + target_from_source[:3, 3], mesh[1]


def _nothing(truth: Truth) -> dict[str, object]:
    """No boards, no figures."""
    names = [b.name for b in truth.boards]
    return {"object": truth.name, "parts_true": len(names), "parts_found": 0, "parts_matched": 0, "missing": names}


def _part_figures(model: Model, truth: Truth, overlap: np.ndarray, match: dict[int, int]) -> dict[str, object]:
    matched = [overlap[i, j] for i, j in match.items()]
    return {
        "object": truth.name,
        "parts_true": len(truth.boards),
        "parts_found": len(model.boards),
        "parts_matched": len(match),
        "parts_good": sum(bool(v > GOOD) for v in matched),
        "mean_iou": float(np.mean(matched)) if matched else 0.0,
        "missing": [b.name for i, b in enumerate(truth.boards) if i not in match],
        "extra": [b.name for j, b in enumerate(model.boards) if j not in match.values()],
    }


def _touches(
    model: Model, truth: Truth, found: list[Mesh], match: dict[int, int], listed: bool
) -> tuple[dict[tuple[int, int], Touch], int]:
    """What touches, by indices of the true boards, and how many pairs of the model's boards do."""
    back = {j: i for i, j in match.items()}
    normals = [truth.boards[back[j]].normal if j in back else np.zeros(3) for j in range(len(found))]
    pairs = _listed(model) if listed else touching_pairs(found, normals)
    out = {}
    for (a, b), touch in pairs.items():
        if a in back and b in back:
            p, q = back[a], back[b]
            out[min(p, q), max(p, q)] = touch if p < q else touch.swapped()
    return out, len(pairs)


def _listed(model: Model) -> dict[tuple[int, int], Touch]:
    """The contacts that the model lists."""
    index = {board.name: k for k, board in enumerate(model.boards)}
    out = {}
    for contact in model.contacts:
        kinds = tuple("cut" if face == "edge" else "sheet" for face in (contact.face_a, contact.face_b))
        a, b, touch = index[contact.a], index[contact.b], Touch(kinds, contact.area)
        out[min(a, b), max(a, b)] = touch if a < b else touch.swapped()
    return out


def _boards(truth: Truth, model: Model, found: list[Mesh], overlap, match) -> dict[str, dict]:
    """Figures of every matched board, by the true board's name."""
    return {
        truth.boards[i].name: {
            "board": model.boards[j].name,
            "iou": float(overlap[i, j]),
            **board_figures(truth.boards[i], found[j]),
        }
        for i, j in sorted(match.items())
    }


def _node_figures(truth: Truth, model: Model, match, truth_from_model, boards: dict[str, dict]) -> dict[str, int]:
    """Nodes of the cut paths, over all matched boards and noted at each."""
    sums = {f"nodes_{key}": 0 for key in ("true", "found", "right_kind", "spurious")}
    for i, j in sorted(match.items()):
        nodes = asdict(compare_nodes(truth.boards[i], model.boards[j], truth_from_model))
        boards[truth.boards[i].name]["nodes"] = nodes
        for key, count in nodes.items():
            sums[f"nodes_{key}"] += count
    return sums


def _solid_figures(solids: list, truth_from_model: np.ndarray) -> dict[str, object]:
    """Shared volume of pairs of solids, mm3 of the truth, and whether OCCT finds them valid."""
    from kerfwright.solid.faces import shape_of
    from kerfwright.solid.interference import common_volume, near_pairs

    shapes = [shape_of(name, solid) for name, solid in solids]
    shared = sum(common_volume(a, b) for a, b in near_pairs(shapes, 0.0))
    return {
        "interference_mm3": float(shared * np.linalg.det(truth_from_model[:3, :3])),
        "solids_valid": all(bool(solid.is_valid) for _, solid in solids),
    }


def boards_in_cloud(truth: Truth) -> tuple[list[int], list[bool]]:
    """Per true board: the cloud points on it, and whether they show its thickness."""
    largest = max(np.ptp(np.concatenate([b.vertices for b in truth.boards]), axis=0))
    own = truth.cloud[Body(*(b.mesh for b in truth.boards)).distance(truth.cloud) < NEAR_SHARE * largest]
    return shown_boards(truth.boards, own)


def _seen_figures(truth: Truth, overlap, match, want, touches, boards: dict[str, dict]) -> dict[str, object]:
    """Counts without boards that nobody could have seen, and the overlap of those whose thickness shows."""
    counts, shown = boards_in_cloud(truth)
    hidden = {k for k, n in enumerate(counts) if n < HIDDEN}
    for i in match:
        boards[truth.boards[i].name]["thickness_seen"] = shown[i]
    open_ = [pair for pair in want if not hidden & set(pair)]
    seen = [overlap[i, j] for i, j in match.items() if shown[i]]
    return {
        "hidden": [truth.boards[k].name for k in sorted(hidden)],
        "parts_true_open": len(truth.boards) - len(hidden),
        "parts_matched_open": sum(i not in hidden for i in match),
        "contacts_true_open": len(open_),
        "contacts_typed_right_open": sum(p in touches and touches[p].kinds == want[p].kinds for p in open_),
        "mean_iou_seen": float(np.mean(seen)) if seen else 0.0,
    }
