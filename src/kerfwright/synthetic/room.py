"""What stands round the object: a floor of planks, a rug, plain walls with pictures on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Quad", "room_quads"]

RUGS = (
    ((20, 62, 66), (186, 92, 52), (205, 196, 170), (34, 40, 48)),
    ((150, 32, 36), (40, 44, 78), (214, 188, 140), (30, 26, 30)),
    ((196, 192, 184), (92, 94, 98), (34, 36, 40), (140, 84, 52)),
)


@dataclass(frozen=True, eq=False)
class Quad:
    """A rectangle with a picture: x_in_model = origin + s * u + t * v, s and t from 0 to 1; texture is linear RGB."""

    origin: np.ndarray
    u: np.ndarray
    v: np.ndarray
    texture: np.ndarray  # (rows along v, columns along u, 3)


def room_quads(largest: float, texels: int, rng: np.random.Generator) -> list[Quad]:
    """Floor with rug, and four walls, sized by the object's largest side in mm; `texels` across the floor."""
    half, tall = 3.2 * largest, 2.6 * largest
    up = np.array([0, 0, tall])
    floor = Quad(
        np.array([-half, -half, 0.0]),
        np.array([2 * half, 0, 0]),
        np.array([0, 2 * half, 0]),
        _floor(largest, half, texels, rng),
    )
    quads = [floor]
    for turn in range(4):
        c, s = np.cos(turn * np.pi / 2), np.sin(turn * np.pi / 2)
        along = np.array([-s, c, 0]) * 2 * half
        quads.append(Quad(np.array([c, s, 0]) * half - along / 2, along, up, _wall(texels, rng)))
    return quads


def _floor(largest: float, half: float, size: int, rng: np.random.Generator) -> np.ndarray:
    """Planks, and a rug in the middle of them."""
    step = 2 * half / size
    x = (np.arange(size) + 0.5) * step - half
    planks = _planks(x, step, rng)
    reach = np.array([1.45, 1.2]) * largest * rng.uniform(0.9, 1.15, 2)
    rows, columns = np.flatnonzero(np.abs(x) < reach[1]), np.flatnonzero(np.abs(x) < reach[0])
    rug = _rug(len(rows), len(columns), size / 2048, rng)
    planks[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] = rug
    return planks


def _planks(x: np.ndarray, step: float, rng: np.random.Generator) -> np.ndarray:
    """Boards 110 mm wide and 900 mm long, each of its own tone."""
    row = np.floor(x / 110).astype(int) - int(np.floor(x[0] / 110))
    shift = rng.uniform(0, 900, row.max() + 1)
    column = np.floor((x[None, :] + shift[row][:, None]) / 900).astype(int)
    column -= column.min()
    tone = rng.normal(1, 0.12, (row.max() + 1, column.max() + 1))[row[:, None], column]
    seam = (np.abs(x % 110 - 1.5) < 1.5)[:, None] | (np.abs((x[None, :] + shift[row][:, None]) % 900 - 1.5) < 1.5)
    base = (np.array([164, 124, 84]) / 255) ** 2.2 * rng.uniform(0.5, 1.2)
    grain = rng.normal(0, 0.05, (len(x), max(1, len(x) // 40)))
    grain = np.repeat(grain, -(-len(x) // grain.shape[1]), axis=1)[:, : len(x)]
    return ((tone + grain) * np.where(seam, 0.45, 1.0))[..., None] * base


def _rug(rows: int, columns: int, grain: float, rng: np.random.Generator) -> np.ndarray:
    """Blobs or stripes of four colours, a border, and pile; `grain` scales the pattern in texels."""
    import cv2

    colours = (np.array(RUGS[rng.integers(len(RUGS))]) / 255) ** 2.2
    if rng.random() < 0.7:
        fine = cv2.GaussianBlur(rng.normal(size=(rows, columns)), (0, 0), 4 * grain)
        coarse = cv2.GaussianBlur(rng.normal(size=(rows, columns)), (0, 0), 11 * grain)
        level = np.digitize(fine / fine.std() + 0.6 * coarse / coarse.std(), (-0.5, 0.35, 1.2))
    else:
        level = np.repeat((np.arange(columns)[None] * rng.integers(14, 30) // columns) % 4, rows, axis=0)
    edge = np.minimum(
        np.minimum(np.arange(rows), np.arange(rows)[::-1])[:, None],
        np.minimum(np.arange(columns), np.arange(columns)[::-1])[None],
    )
    level = np.where(edge < 30 * grain, (edge / (8 * grain)).astype(int) % 4, level)
    pile = rng.normal(1, 0.16, (rows, columns)).clip(0.4, 1.6)
    return colours[level] * cv2.GaussianBlur(pile, (0, 0), 0.8)[..., None]


def _wall(texels: int, rng: np.random.Generator) -> np.ndarray:
    """Paint, and a few pictures or shelves."""
    size = (texels // 4, texels // 2)
    paint = (np.array([205, 202, 196]) / 255) ** 2.2 * rng.uniform(0.6, 1.0) * (1 + rng.normal(0, 0.03, 3))
    wall = np.tile(paint, (*size, 1)) * rng.normal(1, 0.01, (*size, 1))
    for _ in range(rng.integers(2, 5)):
        low, span = (rng.uniform(a, b) * size for a, b in (((0.08, 0), (0.68, 0.75)), ((0.12, 0.06), (0.31, 0.25))))
        (top, left), (rows, columns) = low.astype(int), span.astype(int) + 1
        patch = wall[top : top + rows, left : left + columns]
        patch[:] = _picture(patch.shape[:2], rng)
    return wall


def _picture(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """Upright strips of colours, like books, or one dark panel."""
    if rng.random() < 0.4:
        return np.tile(rng.uniform(0.02, 0.25, 3), (*shape, 1))
    books = rng.integers(12, 40)
    strips = rng.uniform(0.02, 0.5, (books, 3))[np.arange(shape[1]) * books // shape[1]]
    return np.tile(strips, (shape[0], 1, 1))
