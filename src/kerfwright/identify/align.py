"""Global alignment: boards that are nearly parallel or square become exactly so (paper, Global Alignment).

Boards share directions: one unit vector a class of parallel boards, square to other classes where the data allow it.
Every board keeps its own offset, taken at its own points, so that nothing drifts. A board's angle is known no better
than its noise over its shorter side allows; boards that are tilted by more than that stay tilted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kerfwright.capture.types import Cloud
from kerfwright.errors import StageError
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.primitives import plane_fit
from kerfwright.identify.types import Sheet

__all__ = ["PlaneEvidence", "align_sheets"]


@dataclass(frozen=True, eq=False)
class PlaneEvidence:
    """What the cloud says of a board's top plane: normal, centroid, scatter about it, noise and angular standard error
    (radians).
    """

    normal: np.ndarray  # (3,)
    centre: np.ndarray  # (3,) on the top sheet plane
    scatter: np.ndarray  # (3, 3) covariance of the points about the centre, mm2
    sigma: float  # mm
    angle_error: float
    weight: float  # effective number of independent points


EXACT = 1e-3  # mm; points of a made cloud lie in their plane, and scatter by nothing

# The ground acts as a board: level and upright boards are square to it. It is known to half a degree, and gives way to
# level boards.
UPRIGHT = PlaneEvidence(np.array([0.0, 0, 1]), np.zeros(3), np.diag([1.0, 1.0, 0.0]), 1.0, float(np.radians(0.5)), 1e-3)


def align_sheets(
    sheets: tuple[Sheet, ...], cloud: Cloud, options: WholeOptions
) -> tuple[tuple[Sheet, ...], np.ndarray]:
    """Sheets with aligned normals and offsets, and (B,) their angular standard errors in radians.

    Raises StageError when the constrained fit does not converge.
    """
    evidence = [_evidence(sheet, cloud) for sheet in sheets]
    classes = _direction_classes([*evidence, UPRIGHT], options)
    directions = _fit_directions([*evidence, UPRIGHT], classes, options)
    moved = tuple(
        _moved(sheet, e, directions[c], cloud) for sheet, e, c in zip(sheets, evidence, classes[:-1], strict=True)
    )
    return moved, np.array([e.angle_error for e in evidence])


def _evidence(sheet: Sheet, cloud: Cloud) -> PlaneEvidence:
    """Robust planes of both sides, each counted by its noise; the other side's normal is turned over."""
    sides = [
        (cloud.points[idx], sign) for idx, sign in ((sheet.top_idx, 1.0), (sheet.bottom_idx, -1.0)) if len(idx) >= 30
    ]
    if not sides:
        return PlaneEvidence(
            sheet.normal, sheet.to_world(np.array([[0, 0, sheet.thickness.value]]))[0], np.eye(3), 1.0, 0.05, 1.0
        )
    fits = [(*plane_fit(points, sign * sheet.normal), points, sign) for points, sign in sides]
    total, weights = np.zeros((3, 3)), []
    for normal, _, centre, sigma, points, _ in fits:
        x = points - centre
        keep = np.abs(x @ normal) < 3 * sigma
        weight = min(keep.sum(), 400) / sigma**2
        total += weight * (x[keep].T @ x[keep]) / keep.sum()
        weights.append(weight)
    best = int(np.argmax(weights))
    _, _, centre, sigma, _, sign = fits[best]
    if sign < 0:
        centre = centre + sheet.thickness.value * sheet.normal
    scatter = total / sum(weights)
    spread = np.sqrt(np.linalg.eigvalsh(scatter)[1])
    normal = np.linalg.eigh(scatter)[1][:, 0]
    normal = normal if normal @ sheet.normal > 0 else -normal
    return PlaneEvidence(normal, centre, scatter, sigma, float(sigma / max(spread, 1e-6)), float(sum(weights)))


def _tolerance(a: PlaneEvidence, b: PlaneEvidence, options: WholeOptions) -> float:
    """How far two boards may be from parallel or square and still be meant so, radians."""
    own = options.direction_sigmas * np.hypot(a.angle_error, b.angle_error)
    return float(np.clip(own, np.radians(options.square_floor_degrees), np.radians(options.square_degrees)))


def _direction_classes(evidence: list[PlaneEvidence], options: WholeOptions) -> list[int]:
    """Number of the direction class of each board; the surest boards found the classes."""
    order = sorted(range(len(evidence)), key=lambda k: evidence[k].angle_error)
    founders: list[int] = []
    classes = [0] * len(evidence)
    for k in order:
        angles = [np.arcsin(min(np.linalg.norm(np.cross(evidence[k].normal, evidence[f].normal)), 1)) for f in founders]
        fitting = [c for c, f in enumerate(founders) if angles[c] < _tolerance(evidence[k], evidence[f], options)]
        if fitting:
            classes[k] = min(fitting, key=lambda c: angles[c])
        else:
            classes[k] = len(founders)
            founders.append(k)
    return classes


def _fit_directions(evidence: list[PlaneEvidence], classes: list[int], options: WholeOptions) -> np.ndarray:
    """(C, 3) unit directions: least squares over the boards of each class, square where the data allow it."""
    count = max(classes) + 1
    members = [[k for k, c in enumerate(classes) if c == number] for number in range(count)]
    start = np.array([evidence[min(m, key=lambda k: evidence[k].angle_error)].normal for m in members])
    square = [(a, b) for a in range(count) for b in range(a) if _is_square(a, b, start, members, evidence, options)]
    forms = [sum(evidence[k].weight * evidence[k].scatter for k in m) for m in members]
    return _solve(start, forms, square)


def _is_square(a, b, start, members, evidence, options) -> bool:
    surest = [evidence[min(members[c], key=lambda k: evidence[k].angle_error)] for c in (a, b)]
    return abs(np.arcsin(np.clip(start[a] @ start[b], -1, 1))) < _tolerance(*surest, options)


def _solve(start: np.ndarray, forms: list[np.ndarray], square: list[tuple[int, int]]) -> np.ndarray:
    """Minimise sum d'Sd over unit directions in tangent coordinates, subject to independent squareness equations."""
    import casadi as ca

    tangents = [np.linalg.svd(d[None])[2][1:] for d in start]
    u = ca.SX.sym("u", 2 * len(start))
    directions = []
    for k, (d, t) in enumerate(zip(start, tangents, strict=True)):
        raw = ca.DM(d) + u[2 * k] * ca.DM(t[0]) + u[2 * k + 1] * ca.DM(t[1])
        directions.append(raw / ca.norm_2(raw))
    scale = max(float(np.trace(f)) for f in forms)
    cost = sum(ca.mtimes([d.T, ca.DM(f / scale), d]) for d, f in zip(directions, forms, strict=True))
    equations = [ca.dot(directions[a], directions[b]) for a, b in square]
    equations = _independent(equations, u)
    problem = {"x": u, "f": cost, "g": ca.vertcat(*equations) if equations else ca.SX(0, 1)}
    quiet = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-12}
    solver = ca.nlpsol("align", "ipopt", problem, quiet)
    answer = solver(x0=np.zeros(2 * len(start)), lbg=0, ubg=0)
    if not solver.stats()["success"]:
        raise StageError(f"alignment: solver: {solver.stats()['return_status']}: report this with the capture")
    value = ca.Function("d", [u], [ca.horzcat(*directions)])(answer["x"])
    return np.array(value).T


def _independent(equations: list, u) -> list:
    """An independent subset of the equations (pivoted QR of their Jacobian): IPOPT fails on redundant ones."""
    import casadi as ca
    from scipy.linalg import qr

    if not equations:
        return []
    jacobian = np.array(ca.Function("J", [u], [ca.jacobian(ca.vertcat(*equations), u)])(np.zeros(u.shape[0])))
    _, r, order = qr(jacobian.T, pivoting=True)
    rank = int((np.abs(np.diag(r)) > 1e-3).sum())
    return [equations[k] for k in sorted(order[:rank])]


def _moved(sheet: Sheet, evidence: PlaneEvidence, direction: np.ndarray, cloud: Cloud) -> Sheet:
    """The sheet turned about its evidence's centre onto the class direction, its offset fitted to its own points."""
    normal = direction if direction @ sheet.normal > 0 else -direction
    turn = _rotation_between(sheet.normal, normal)
    board = np.eye(4)
    board[:3, :3] = turn @ sheet.world_from_board[:3, :3]
    board[:3, 3] = evidence.centre + turn @ (sheet.world_from_board[:3, 3] - evidence.centre)
    shift = _offset(sheet, evidence, normal, cloud) - (board[:3, 3] @ normal + sheet.thickness.value)
    board[:3, 3] += shift * normal
    return replace(sheet, world_from_board=board)


def _offset(sheet: Sheet, evidence: PlaneEvidence, normal: np.ndarray, cloud: Cloud) -> float:
    """Offset of the top sheet plane along the normal, both sides by their points and their noise: a few points of the
    other side move nothing, however near to each other they lie.
    """
    found, weights = [], []
    for idx, sign in ((sheet.top_idx, 0.0), (sheet.bottom_idx, 1.0)):
        if len(idx) >= 30:
            z = cloud.points[idx] @ normal
            middle = float(np.median(z))
            spread = max(1.4826 * float(np.median(np.abs(z - middle))), EXACT)
            found.append(middle + sign * sheet.thickness.value)
            weights.append(len(idx) / spread**2)
    if not found:
        return float(evidence.centre @ normal)
    return float(np.average(found, weights=weights))


def _rotation_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Smallest rotation that turns unit vector a onto b."""
    axis = np.cross(a, b)
    sine, cosine = np.linalg.norm(axis), float(a @ b)
    if sine < 1e-15:
        return np.eye(3)
    k = axis / sine
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + sine * cross + (1 - cosine) * cross @ cross
