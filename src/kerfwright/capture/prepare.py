"""Move a capture to where every later stage works: millimetres, +z up, floor at z = 0, the object about the origin.

Every length here is a fraction of the cloud's size or a multiple of its noise: the scale may be assumed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kerfwright.capture.crop import Cropped, above_floor, crop_to_object, focus
from kerfwright.capture.floor import Floor, find_floor
from kerfwright.capture.frame import moved, rotation_between, similarity
from kerfwright.capture.level import up_of_object
from kerfwright.capture.photo_floor import floor_in_photos
from kerfwright.capture.types import Capture, Cloud
from kerfwright.capture.yaw import upright_turn
from kerfwright.errors import CaptureError, OptionError, shown

__all__ = ["PrepareOptions", "crop_options", "prepare"]

Z = np.array([0.0, 0.0, 1.0])
LEAST_TILT = np.radians(0.05)  # of the floor in photographs that is put right; they show it to half of this
FEWEST_POINTS = 100  # as for a cloud as read


@dataclass(frozen=True)
class PrepareOptions:
    """What a user may choose.

    Attributes
    ----------
    crop : leave out the floor, other objects and strays.
    box : lowest x y z and highest x y z, (6,), in the coordinates of the cloud's file; points elsewhere are left out
        before anything else.
    ground : height of the floor in capture units along the up axis, instead of looking for it; nothing is
        levelled then.
    photos : look for the floor in the photographs where the cloud has none; otherwise the
        object's lowest points stand on it.
    seed : of the search for the floor.
    """

    crop: bool = True
    box: tuple[float, ...] | None = None
    ground: float | None = None
    photos: bool = True
    seed: int = 0


def prepare(capture: Capture, options: PrepareOptions | None = None) -> Capture:
    """Level, crop, turn, centre and scale a capture; turned, moved or scaled input gives the same.

    The horizontal direction that most upright faces look along becomes x or y, the longer side lies along x. z = 0 is
    the floor: of the cloud, else of the photographs, else where the object begins.

    Returns
    -------
    The capture in millimetres; its `capture_from_world` leads back, its notes say what was done.

    Raises
    ------
    CaptureError
        If too few points are left.
    """
    options = options or PrepareOptions()
    capture = _boxed(capture, options.box) if options.box else capture
    capture, floor = _levelled(_straight(capture), options)
    if options.crop:
        capture = _cropped(_straight(capture), floor)  # what is a stray must not depend on how the capture is turned
    capture, ground = (capture, floor.offset) if floor else _stood_on_floor(capture, options)
    capture = _straight(capture)
    low, high = np.percentile(capture.cloud.points[:, :2], (0.1, 99.9), axis=0)
    scale = capture.scale.millimetres_per_unit
    return moved(capture, similarity(scale, np.eye(3), -scale * np.array([*(low + high) / 2, ground])))


def crop_options(text: str) -> dict[str, bool | tuple[float, ...]]:
    """PrepareOptions' crop and box from `auto`, `none`, or six numbers with commas between them.

    Raises
    ------
    OptionError
        If the text is none of these.
    """
    if text in ("auto", "none"):
        return {"crop": text == "auto"}
    try:
        box = tuple(float(word) for word in text.split(","))
    except ValueError:
        box = ()
    if len(box) != 6 or not all(low < high for low, high in zip(box[:3], box[3:], strict=True)):
        raise OptionError(
            f"--crop: {shown(text)}: give auto, none, or the box to keep, lowest corner first: X0,Y0,Z0,X1,Y1,Z1 in "
            "the units and axes of the cloud's file"
        )
    return {"box": box}


def _boxed(capture: Capture, box: tuple[float, ...]) -> Capture:
    points = capture.cloud.points @ capture.capture_from_world[:3, :3].T + capture.capture_from_world[:3, 3]
    inside = ((points >= box[:3]) & (points <= box[3:])).all(axis=1)
    if inside.sum() < FEWEST_POINTS:
        low, high = points.min(axis=0), points.max(axis=0)
        span = " to ".join(",".join(f"{x:.4g}" for x in corner) for corner in (low, high))
        raise OptionError(f"--crop: {inside.sum()} points are in the box: the cloud goes from {span}")
    note = f"--crop left {len(inside) - int(inside.sum())} points out"
    return replace(capture, cloud=capture.cloud.select(inside), notes=(*capture.notes, note))


def _levelled(capture: Capture, options: PrepareOptions) -> tuple[Capture, Floor | None]:
    """The capture with its floor level, and that floor."""
    if options.ground is not None:
        return capture, Floor(Z, options.ground, 0.0)
    floor = _find_floor(capture, np.random.default_rng(options.seed))
    if floor is None:
        return capture, None
    level = _turned_up(capture, floor.normal, "the floor was found; it was {} and is level now")
    return level, replace(floor, normal=Z)


def _find_floor(capture: Capture, generator: np.random.Generator) -> Floor | None:
    """The floor below the object; where there is none that way, one that lies otherwise: the up axis was wrong."""
    centres = np.array([view.centre for view in capture.views]).reshape(-1, 3)
    for up in (Z, *(sign * axis for axis in np.eye(3)[:2] for sign in (1.0, -1.0)), -Z):
        turn = rotation_between(up, Z)
        if up is not Z and len(centres) < 3:
            break  # only cameras tell a floor from a wall
        cloud = capture.cloud if up is Z else Cloud(capture.cloud.points @ turn.T, capture.cloud.normals @ turn.T)
        if floor := find_floor(cloud, centres @ turn.T, generator):
            return replace(floor, normal=turn.T @ floor.normal)
    return None


def _turned_up(capture: Capture, normal: np.ndarray, note: str) -> Capture:
    """The capture with `normal` upwards, and a note in which {} is the tilt."""
    tilt = np.degrees(np.arccos(np.clip(normal @ Z, -1, 1)))
    turned = moved(capture, similarity(1.0, rotation_between(normal, Z), np.zeros(3)))
    return replace(turned, notes=(*capture.notes, note.format(f"tilted by {tilt:.2f} degrees")))


def _cropped(capture: Capture, floor: Floor | None) -> Capture:
    cloud = capture.cloud
    notes = capture.notes
    if floor:
        above = above_floor(cloud, floor)
        notes = (*notes, f"{len(cloud) - int(above.sum())} points of the floor were left out")
        cloud = cloud.select(above)
    cropped: Cropped = crop_to_object(cloud.points, focus(capture.views))
    cloud = cloud.select(cropped.keep)
    if len(cloud) < FEWEST_POINTS:
        raise CaptureError(
            f"{capture.name}: points above the floor: {len(cloud)}: at least {FEWEST_POINTS} are needed: "
            "check --up and --ground"
        )
    return replace(capture, cloud=cloud, notes=(*notes, *cropped.notes))


def _straight(capture: Capture) -> Capture:
    return moved(capture, similarity(1.0, upright_turn(capture.cloud), np.zeros(3)))


def _stood_on_floor(capture: Capture, options: PrepareOptions) -> tuple[Capture, float]:
    """The capture level, and the height of a floor that is not in the cloud."""
    up = up_of_object(capture.cloud)
    if up is not None:
        capture = _turned_up(capture, up, "the object was {} against its boards or feet and is level now")
    capture = _straight(
        capture
    )  # the search looks at squares along x and y: the same ones however the capture was turned
    lowest = robust_lowest(capture.cloud.points[:, 2])
    floor = floor_in_photos(capture.views, capture.cloud, lowest) if options.photos else None
    if floor is None:
        note = "no floor was found: the lowest points of the object are taken to stand on it"
        return replace(capture, notes=(*capture.notes, note)), lowest
    below = 100 * (lowest - floor.height) / capture.cloud.diameter
    note = (
        f"the floor is not in the cloud; {floor.views} photographs show it {below:.2f} % of the object's size "
        "below its lowest points"
    )
    capture = replace(capture, notes=(*capture.notes, note))
    if np.arccos(min(1.0, floor.normal[2])) <= max(3 * floor.tilt_error, LEAST_TILT):
        return capture, floor.height
    level = _turned_up(capture, floor.normal, "the floor in the photographs was {} and is level now")
    return level, floor.offset


def robust_lowest(heights: np.ndarray) -> float:
    """Where an object stands: the height at which its points begin, strays apart.

    Upright faces give points evenly over the height, blurred by noise at their end: the end is where the density first
    reaches half of what it is a little higher.
    """
    low, high = np.percentile(heights, (0.05, 99.9))
    near = heights[(heights >= low - 0.01 * (high - low)) & (heights < low + 0.05 * (high - low))]
    edges = np.linspace(low - 0.01 * (high - low), low + 0.05 * (high - low), 121)
    counts = np.histogram(near, edges)[0].astype(float)
    if not counts.any():
        return float(low)
    return float(edges[int((counts >= 0.5 * np.median(counts[20:])).argmax())])
