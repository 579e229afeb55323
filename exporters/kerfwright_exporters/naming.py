"""Names and colours that every format can carry."""

from __future__ import annotations

import re
import unicodedata

from kerfwright.model import Model

__all__ = ["STAMP", "ascii_labels", "ascii_name", "board_colours", "file_stems", "plain_name", "title"]

STAMP = "NOT VERIFIED"

# Muted, told apart by hue and by lightness, so that neighbours in the list differ on screen and in print.
_PALETTE = (
    (0.78, 0.58, 0.37), (0.45, 0.58, 0.66), (0.85, 0.75, 0.49), (0.55, 0.38, 0.27), (0.56, 0.66, 0.46),
    (0.74, 0.45, 0.37), (0.64, 0.56, 0.70), (0.90, 0.83, 0.70), (0.36, 0.48, 0.42), (0.80, 0.64, 0.60),
    (0.42, 0.42, 0.52), (0.69, 0.69, 0.63),
)  # fmt: skip


def plain_name(name: str) -> str:
    """The name without what could mean something to a program that reads it: letters of any script, digits, _ . -."""
    composed = unicodedata.normalize("NFC", name)
    kept = (c if unicodedata.category(c)[0] in "LMN" or c in " _.-" else "_" for c in composed)
    return re.sub("_+", "_", "".join(kept)).strip(" .")[:100] or "board"


def ascii_name(name: str) -> str:
    """The name in letters that any file system and controller takes; never empty."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9 _.-]+", "_", plain).strip(" .")[:100] or "board"


def file_stems(model: Model) -> list[str]:
    """A file name, without its ending, for every board: safe, and no two the same on any file system."""
    stems: list[str] = []
    taken: set[str] = set()
    for board in model.boards:
        base = stem = ascii_name(board.name).replace(" ", "_")
        count = 1
        while stem.casefold() in taken:
            count += 1
            stem = f"{base}-{count}"
        taken.add(stem.casefold())
        stems.append(stem)
    return stems


def ascii_labels(model: Model) -> list[str]:
    """Every board's name where it is ASCII, else its file's: for programs that garble other letters."""
    plain = [plain_name(board.name) for board in model.boards]
    return [name if name.isascii() else stem for name, stem in zip(plain, file_stems(model), strict=True)]


def board_colours(model: Model) -> list[tuple[float, float, float]]:
    """Red, green, blue from 0 to 1 for every board."""
    return [_PALETTE[k % len(_PALETTE)] for k in range(len(model.boards))]


def title(model: Model, unverified: bool) -> str:
    """The model's name as files carry it."""
    name = plain_name(model.name)
    return f"{name} {STAMP}" if unverified else name
