"""The scale from the boards themselves: from lengths that somebody measured, or from the thicknesses that stock has."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kerfwright.errors import OptionError, shown
from kerfwright.model import Board, Finding, Model, Scale
from kerfwright.model.frames import rows
from kerfwright.model.geometry import sample_loop
from kerfwright.model.resize import resized_board, resized_contact

__all__ = ["Length", "length_factor", "parse_lengths", "scaled_by_lengths", "scaled_by_stock"]

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
AXES = {"x": 0, "length": 0, "y": 1, "width": 1, "z": 2, "thickness": 2}
WHOLE, TOP = "object", "top"  # instead of a board's name
LEVEL = np.cos(np.radians(45))
AGREE = 0.01  # by which lengths may contradict each other before it is a warning

# Thicknesses in mm that sheets and planed timber are sold in, and how common each is: sheets of plywood, MDF and
# chipboard (EN 315, EN 622, EN 14322 list the usual ones), then planed softwood (EN 1313-1 less planing), then inches.
STOCK = {
    18.0: 4, 12.0: 3, 15.0: 3, 9.0: 2, 6.0: 2, 16.0: 3, 19.0: 3, 22.0: 2, 25.0: 2, 20.0: 2, 10.0: 2, 8.0: 2, 4.0: 1,
    5.0: 1, 3.0: 1, 21.0: 1, 24.0: 1, 27.0: 1, 28.0: 1, 30.0: 2, 35.0: 1, 38.0: 1, 40.0: 1, 44.0: 1, 45.0: 1,
    6.35: 1, 12.7: 1, 19.05: 1,
}  # fmt: skip
STOCK_ERROR = 0.15  # mm: what sheets differ from their name, EN 315 allows more
ODD = 0.1  # share of boards that are of no stock
USUAL, SPREAD = 550.0, 0.7  # mm and its logarithm's deviation: of furniture's longest side, stools to shelves
SMALLEST, LARGEST = 60.0, 3000.0  # mm: of furniture's longest side
NEAR = 0.02  # of a scale: what counts as the same answer
STEP = 2e-4  # of the scale's logarithm
SURE = 0.8  # of the probability that an answer needs, not to be a warning


@dataclass(frozen=True)
class Length:
    """A length that somebody measured: of a board, or of the whole, along x, y or z of its own frame; mm."""

    board: str
    axis: str
    value: float

    @property
    def text(self) -> str:
        return f"{self.board}:{self.axis}={self.value:g}mm"


def parse_lengths(texts: Sequence[str]) -> tuple[Length, ...]:
    """From `BOARD:AXIS=LENGTH`, such as `top:x=420mm`; millimetres where no unit is given.

    Raises
    ------
    OptionError
        If one is nothing of the kind.
    """
    return tuple(_parsed(text) for text in texts)


def _parsed(text: str) -> Length:
    axes = "|".join(AXES)
    found = re.fullmatch(rf"\s*([^:=]+?)\s*:\s*({axes})\s*=\s*([0-9]*\.?[0-9]+)\s*(mm|cm|m|in)?\s*", text)
    value = float(found[3]) * UNITS[found[4] or "mm"] if found else 0.0
    if not 0 < value < 1e6:
        raise OptionError(
            f"--length: {shown(text)}: give BOARD:AXIS=LENGTH, such as top:x=420mm; AXIS is x, y or z, BOARD a name "
            f"from the report, {TOP} (the highest level board) or {WHOLE}"
        )
    return Length(found[1], found[2], value)


def length_factor(model: Model, lengths: Sequence[Length]) -> float:
    """By which the model must grow to have these lengths; of several, the mean, weighted by their lengths.

    Raises
    ------
    OptionError
        If a board is not there.
    """
    found = np.array([_measured(model, length) for length in lengths])
    return float(found @ np.array([length.value for length in lengths]) / (found @ found))


def scaled_by_lengths(model: Model, lengths: Sequence[Length], factor: float | None = None) -> Model:
    """The model at the scale that these lengths give, or at a factor that they gave before thicknesses were snapped.

    Raises
    ------
    OptionError
        If a board is not there.
    """
    found = np.array([_measured(model, length) for length in lengths])
    given = np.array([length.value for length in lengths])
    factor = length_factor(model, lengths) if factor is None else factor
    residuals = factor * found - given
    told = ", ".join(f"{n.text} ({round(r, 2) + 0.0:+.2f})" for n, r in zip(lengths, residuals, strict=True))
    error = float(np.sqrt(residuals @ residuals / (len(given) - 1) / (found @ found))) if len(given) > 1 else None
    scale = Scale(
        millimetres_per_unit=model.scale.millimetres_per_unit * factor, origin="measured",
        standard_error=None if error is None else error * model.scale.millimetres_per_unit,
        note=f"From {told}; in brackets what the model differs, mm.",
    )  # fmt: skip
    findings = ()
    if (np.abs(residuals) > AGREE * given).any():
        findings = (_finding("K004", "warning", f"the lengths given contradict each other: {told}", "measure again"),)
    return _rescaled(model, factor, scale, findings)


def _measured(model: Model, length: Length) -> float:
    axis = AXES[length.axis]
    if length.board == WHOLE:
        return float(np.ptp(np.concatenate([_corners(b) for b in model.boards]), axis=0)[axis])
    board = _board(model, length.board)
    return board.thickness.value if axis == 2 else float(np.ptp(sample_loop(board.cut_path.outer), axis=0)[axis])


def _board(model: Model, name: str) -> Board:
    if name == TOP and model.boards:
        level = [b for b in model.boards if abs(np.array(b.model_from_board)[2, 2]) > LEVEL] or list(model.boards)
        return max(level, key=lambda b: float(_corners(b)[:, 2].max()))
    board = next((b for b in model.boards if b.name == name), None)
    if board is None:
        known = ", ".join([TOP, WHOLE, *(b.name for b in model.boards)])
        raise OptionError(f"--length: {name}: no such board: use one of {known}")
    return board


def _corners(board: Board) -> np.ndarray:
    """Points round both faces in the model's frame, (N, 3)."""
    flat = sample_loop(board.cut_path.outer)
    pose = np.array(board.model_from_board)
    faces = [np.column_stack([flat, np.full(len(flat), z)]) for z in (0.0, board.thickness.value)]
    return np.concatenate(faces) @ pose[:3, :3].T + pose[:3, 3]


def scaled_by_stock(model: Model) -> Model:
    """The model at the scale at which its thicknesses are most likely those of stock, and how likely that is.

    Every thickness is one of STOCK, within its own error and that of sheets, or with the share ODD any. Boards that
    share a thickness count once: they came from one sheet. The object's longest side is that of furniture.
    """
    thickness, error = _thicknesses(model.boards)
    size = float(np.ptp(np.concatenate([_corners(b) for b in model.boards]), axis=0).max())
    factors = np.exp(np.arange(np.log(SMALLEST / size), np.log(LARGEST / size), STEP))
    usual = -0.5 * (np.log(factors * size / USUAL) / SPREAD) ** 2
    weight = np.exp(_log_likelihood(factors, thickness, error) + usual)
    weight /= weight.sum()
    near = np.convolve(weight, np.ones(2 * int(NEAR / 2 / STEP) + 1), mode="same")
    best = int(near.argmax())
    window = np.abs(np.log(factors / factors[best])) < NEAR / 2
    factor = float(factors[window] @ weight[window] / weight[window].sum())
    spread = float(np.sqrt(np.average((factors[window] - factor) ** 2, weights=weight[window])))
    sure = min(1.0, float(near[best]))
    told = ", ".join(f"{t * factor:.2f} as {_nearest(t * factor):g}" for t in thickness)
    unit = model.scale.millimetres_per_unit
    scale = Scale(
        millimetres_per_unit=unit * factor, origin="inferred", standard_error=unit * spread,
        note=f"From the thicknesses that stock has: {told} mm. Confidence {100 * sure:.0f} %.",
    )  # fmt: skip
    others = _others(factors, near, best, unit)
    message = f"the scale was guessed from {len(thickness)} thicknesses, confidence {100 * sure:.0f} %{others}"
    level = "info" if sure >= SURE else "warning"
    return _rescaled(model, factor, scale, (_finding("K004", level, message, "measure a board and give --length"),))


def _thicknesses(boards: Sequence[Board]) -> tuple[np.ndarray, np.ndarray]:
    """Distinct thicknesses and their standard errors; those that are only inferred tell nothing."""
    seen = [b for b in boards if b.thickness.origin.value != "inferred"] or list(boards)
    distinct = {round(b.thickness.value, 6): b.thickness.standard_error or 0.0 for b in seen}
    return np.array(list(distinct)), np.array(list(distinct.values()))


def _log_likelihood(factors: np.ndarray, thickness: np.ndarray, error: np.ndarray) -> np.ndarray:
    stock, common = np.array(list(STOCK)), np.array(list(STOCK.values()), float)
    common /= common.sum()
    total = np.zeros(len(factors))
    for t, e in zip(thickness, error, strict=True):
        deviation = np.hypot(STOCK_ERROR, e * factors)[:, None]
        gap = (t * factors[:, None] - stock) / deviation
        fits = (common / deviation * np.exp(-0.5 * gap**2)).sum(axis=1) / np.sqrt(2 * np.pi)
        total += np.log((1 - ODD) * fits + ODD / stock.max())
    return total


def _others(factors: np.ndarray, near: np.ndarray, best: int, unit: float) -> str:
    """The next likely answers."""
    left, told = near.copy(), []
    for _ in range(2):
        left[np.abs(np.log(factors / factors[best])) < 2 * NEAR] = 0
        best = int(left.argmax())
        if left[best] < 0.02:
            break
        told.append(f"{unit * factors[best]:.4g} mm a unit ({100 * left[best]:.0f} %)")
    return f"; else {' or '.join(told)}" if told else ""


def _nearest(value: float) -> float:
    return min(STOCK, key=lambda s: abs(s - value))


def _finding(code: str, severity: str, message: str, remedy: str) -> Finding:
    return Finding(code=code, severity=severity, message=message, remedy=remedy)


def _rescaled(model: Model, factor: float, scale: Scale, findings: tuple[Finding, ...]) -> Model:
    new_from_model = np.diag([factor, factor, factor, 1.0])
    capture_from_new = np.array(model.capture_from_model) @ np.linalg.inv(new_from_model)
    return model.model_copy(update={
        "boards": tuple(resized_board(b, new_from_model) for b in model.boards),
        "contacts": tuple(resized_contact(c, new_from_model) for c in model.contacts),
        "findings": (*findings, *(f for f in model.findings if f.code != "K003")),
        "scale": scale, "capture_from_model": rows(capture_from_new),
    })  # fmt: skip
