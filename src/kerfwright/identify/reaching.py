"""How far a board goes beyond where the cloud shows it: up to the plane of another board.

Stereo loses boards in the dark. A board whose outline just fades out goes on to what is near; further off, the
photographs must show an edge where the other board's plane cuts it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from kerfwright.capture.types import Cloud
from kerfwright.identify.freespace import FreeSpace
from kerfwright.identify.joints import Joint, Search
from kerfwright.identify.options import WholeOptions
from kerfwright.identify.photo_edges import Photos
from kerfwright.identify.seams import End, look_for_end
from kerfwright.identify.types import Sheet
from kerfwright.identify.visibility import Obstacles

__all__ = [
    "LEAST_VIEWS", "Scene", "end_is_seen", "ends_elsewhere", "goes_on_unseen", "may_reach", "shown_end",
]  # fmt: skip

AS_CLEAR = 0.8  # of the score of the edge at the plane
LEAST_VIEWS = 3  # photographs that must show an edge for it to decide anything
MOST_ENDS = 0.5  # of a board's end that may have a third board right behind it: more, and it ends there
MOST_SPOILT = 0.3  # of a gap may be seen through, or taken by another board


@dataclass(frozen=True, eq=False)
class Scene:
    """Boards with all that tells how far they go."""

    sheets: tuple[Sheet, ...]
    cloud: Cloud
    photos: Photos
    obstacles: Obstacles
    free: FreeSpace
    options: WholeOptions

    @property
    def diameter(self) -> float:
        """D, mm."""
        return self.cloud.diameter

    def mm(self, fraction: float) -> float:
        """A fraction of D."""
        return fraction * self.diameter

    def search(self, cover: float) -> Search:
        """Where joints are looked for when a's wood may go on so far (a fraction of D) beyond its outline."""
        o = self.options
        return Search(
            self.mm(o.far_reach), self.mm(o.outline_error), self.mm(cover), self.mm(1 / 200), self.mm(o.min_contact),
            self.mm(o.ragged),
        )


def end_is_seen(scene: Scene, joint: Joint) -> bool:
    """Whether cut-face points that look towards a show where b really ends: then it does not reach a."""
    b = scene.sheets[joint.b]
    if joint.gap < scene.mm(scene.options.end_offset) or not len(b.cut_idx):
        return False
    facing = scene.cloud.normals[b.cut_idx] @ b.world_from_board[:3, :2] @ -joint.trace.m > 0.7
    places = b.to_board(scene.cloud.points[b.cut_idx[facing]])[:, :2]
    if len(places) < 5:
        return False
    distance, _ = cKDTree(places).query(joint.ends)
    return float((distance < scene.mm(scene.options.end_offset) * 2).mean()) > 0.5


def ends_elsewhere(scene: Scene, joint: Joint) -> bool:
    """Whether b ends on a third board, which tells nothing of a: as a rail that ends on a leg does, beside another
    rail that ends on the leg's face.
    """
    board, slack = scene.sheets[joint.b], scene.mm(scene.options.outline_error)
    others = [sheet for k, sheet in enumerate(scene.sheets) if k not in (joint.a, joint.b)]
    inside, along = joint.trace.coordinates(joint.ends)
    for step in (slack / 2, slack):
        beyond = joint.trace.place(inside - step, along)
        places = board.to_world(np.c_[beyond, np.full(len(beyond), board.thickness.value / 2)])
        if any(_in_wood(places, sheet).mean() > MOST_ENDS for sheet in others):
            return True
    return False


def _in_wood(places: np.ndarray, sheet: Sheet) -> np.ndarray:
    """(N,) which places (N, 3) lie in a board."""
    x = sheet.to_board(places)
    inside = (x[:, 2] > 0) & (x[:, 2] < sheet.thickness.value)
    inside[inside] = shapely.contains_xy(sheet.region, x[inside, 0], x[inside, 1])
    return inside


def goes_on_unseen(scene: Scene, joint: Joint | None) -> Joint | None:
    """A far joint whose board just fades out: no cut face ends it, nobody saw through the gap, and the photographs show
    an edge at the plane, or nothing.
    """
    options = scene.options
    if joint is None or joint.gap > scene.mm(options.unseen_reach) or joint.length < scene.mm(options.reach):
        return None
    return joint if may_reach(scene, joint) else None


def may_reach(scene: Scene, joint: Joint) -> bool:
    """Whether nothing contradicts that a joint's board goes on to the plane: it was not seen to end before, nobody saw
    through the gap, no other board fills it, and the photographs show an edge at the plane, or nothing.
    """
    if end_is_seen(scene, joint) or _gap_is_free(scene, joint) or _gap_is_taken(scene, joint):
        return False
    end = _end(scene, joint)
    if end is None or end.views < LEAST_VIEWS:
        return True
    return not (end.excess < scene.options.end_excess / 2 or _ends_before(scene, joint, end))


def _gap_is_free(scene: Scene, joint: Joint) -> bool:
    """Whether cameras saw through the place between b's outline and the plane."""
    return float((scene.free.votes(_gap_places(scene, joint)) >= 2).mean()) > MOST_SPOILT


def _gap_is_taken(scene: Scene, joint: Joint) -> bool:
    """Whether another board lies between b's outline and the plane: it fills much of the gap, or goes right across it,
    however thin it is.
    """
    others = [sheet for k, sheet in enumerate(scene.sheets) if k not in (joint.a, joint.b)]
    thinnest = min((sheet.thickness.value for sheet in others), default=np.inf)
    steps = int(np.clip(2 * joint.gap / thinnest, 4, 200))
    places = _gap_places(scene, joint, (np.arange(steps) + 0.5) / steps)
    taken = np.zeros(len(places), bool)
    for sheet in others:
        taken |= _in_wood(places, sheet)
    taken = taken.reshape(steps, -1)  # from the plane to the outline
    crossed = (taken[1:] & np.logical_or.accumulate(~taken[:-1])).any(axis=0)
    return max(float(taken.mean()), float(crossed.mean())) > MOST_SPOILT


def _gap_places(scene: Scene, joint: Joint, shares: Sequence[float] = (0.2, 0.4, 0.6, 0.8)) -> np.ndarray:
    """Places (N, 3) in the part of b that nobody saw, world, at some shares of the way from the plane."""
    b = scene.sheets[joint.b]
    inside, along = joint.trace.coordinates(joint.ends)
    layers = [joint.trace.place(share * inside, along) for share in shares]
    heights = b.thickness.value * np.array([0.3, 0.7])
    return b.to_world(np.concatenate([np.c_[xy, np.full(len(xy), z)] for xy in layers for z in heights]))


def shown_end(scene: Scene, joint: Joint | None) -> End | None:
    """The end of a far joint that the photographs confirm: an edge at the plane, and no clearer one before it."""
    if joint is None or joint.length < scene.mm(scene.options.reach):
        return None
    if end_is_seen(scene, joint) or _gap_is_free(scene, joint) or _gap_is_taken(scene, joint):
        return None
    end = _end(scene, joint)
    if end is None or end.views < LEAST_VIEWS:
        return None
    return None if end.excess < scene.options.end_excess or _ends_before(scene, joint, end) else end


def _end(scene: Scene, joint: Joint) -> End | None:
    window, fringe = scene.mm(scene.options.end_offset), scene.mm(scene.options.veil)
    beside = scene.mm(scene.options.reach)
    return look_for_end(scene.sheets, joint, scene.photos, scene.obstacles, window, fringe, beside)


def _ends_before(scene: Scene, joint: Joint, end: End) -> bool:
    """Whether the photographs show an edge before the plane that is clear, and clearer than the one at the plane.

    Where the outline stops, one as clear will do: lines behind the board run at the plane's height as well.
    """
    options = scene.options
    clear = end.views >= LEAST_VIEWS and end.rival_excess > 2 * options.end_excess
    here = abs(end.rival_offset - joint.gap) < scene.mm(options.veil)
    return clear and end.rival_score > max(options.rival_score, end.score * (AS_CLEAR if here else 1.0))
