"""From an oriented cloud to the rough boards of an object (paper, Part Identification)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from kerfwright.capture.types import Capture
from kerfwright.errors import StageError
from kerfwright.identify.options import IdentifyOptions, WholeOptions
from kerfwright.identify.types import Neighbourhood, Parts, Planes, Primitive, Sheet

if TYPE_CHECKING:
    from kerfwright.capture.types import Cloud
    from kerfwright.identify.freespace import FreeSpace
    from kerfwright.identify.photo_edges import Photos
    from kerfwright.identify.selection import Evidence, Selection
    from kerfwright.identify.slabs import Slab

__all__ = [
    "Candidates", "IdentifyOptions", "Parts", "Planes", "Primitive", "Sheet", "WholeOptions", "choose",
    "find_candidates", "identify", "made_whole", "planes_of",
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Candidates:
    """What selection chooses from: planes of a cloud, slabs that may be boards, and what each explains; `dark` are seen
    in rags, and are boards where nothing else is.
    """

    capture: Capture
    around: Neighbourhood
    free: FreeSpace
    photos: Photos
    planes: list[Primitive]
    slabs: list[Slab]
    dark: list[Slab]
    evidence: Evidence


def identify(capture: Capture, options: IdentifyOptions | None = None, planes: Planes | None = None) -> Parts:
    """Find the boards of a capture that `kerfwright.capture.prepare` has moved to the world frame.

    Parameters
    ----------
    planes : of the capture's cloud, where they were found before; see `planes_of`.

    Raises StageError when the cloud shows no plane, or no plane that could be a board, or when the alignment of the
    boards does not converge.
    """
    options = options or IdentifyOptions()
    found = find_candidates(capture, options, planes)
    return made_whole(choose(found, options), found)


def planes_of(cloud: Cloud, options: IdentifyOptions | None = None) -> Planes:
    """The plane patches of a cloud; raises StageError when there is none."""
    from kerfwright.identify.primitives import find_planes, look_around

    options = options or IdentifyOptions()
    around = look_around(cloud, options)
    return Planes(around, tuple(find_planes(cloud, around, options)))


def find_candidates(capture: Capture, options: IdentifyOptions, planes: Planes | None = None) -> Candidates:
    """What could be boards; raises as `identify` does."""
    from kerfwright.identify.dark import dark_slabs
    from kerfwright.identify.freespace import see_through
    from kerfwright.identify.photo_edges import Photos
    from kerfwright.identify.selection import gather_evidence
    from kerfwright.identify.slabs import candidate_slabs

    cloud = capture.cloud
    planes = planes or planes_of(cloud, options)
    around, patches = planes.around, list(planes.patches)
    free = see_through(capture, around.spacing, max(5 * around.noise, cloud.diameter / 150))
    photos = Photos(capture)
    slabs = candidate_slabs(capture, around, patches, free, photos, options)
    if not slabs:
        raise StageError(
            "cloud: no plane has a thickness that a board could have: photograph the edges of the boards too"
        )
    dark = dark_slabs(capture, around, patches, free, options)
    evidence = gather_evidence(cloud, around, slabs, options)
    return Candidates(capture, around, free, photos, patches, slabs, dark, evidence)


def choose(found: Candidates, options: IdentifyOptions) -> Parts:
    """The boards among the candidates, as far as the cloud shows them; raises StageError when there are none."""
    from kerfwright.identify.dark import with_dark_boards
    from kerfwright.identify.dark_ends import run_to_ends
    from kerfwright.identify.sheets import join_across, to_sheet

    cloud, around, slabs = found.capture.cloud, found.around, found.slabs
    selection = _selected(cloud, slabs, found.evidence, options)
    if not selection.chosen:
        raise StageError("cloud: no set of boards explains it: check that the cloud shows one wooden object, cropped")
    reach = max(4 * around.spacing, cloud.diameter / 60)
    boards = with_dark_boards([slabs[k] for k in selection.chosen], found.dark, found.planes, cloud, reach)
    boards = run_to_ends(boards, found.planes, cloud, around, found.free, options)
    chosen = join_across(boards, reach)
    chosen.sort(key=lambda s: (-round(s.region.area), *s.world_from_board[:3, 3].round(3)))
    sheets = tuple(to_sheet(f"board_{k + 1:02d}", slab, cloud, around, options) for k, slab in enumerate(chosen))
    bound = selection.bound
    figures = {
        "candidates": len(slabs), "chosen": len(selection.chosen), "objective": selection.objective, "bound": bound,
        "gap": None if bound is None else bound - selection.objective, "explained": selection.explained,
        "method": selection.method, "energy": selection.energy,
    }
    notes = _notes(selection.explained, options.least_explained)
    return Parts(sheets, tuple(found.planes), around.noise, around.spacing, notes, figures)


def made_whole(parts: Parts, found: Candidates, options: WholeOptions | None = None) -> Parts:
    """The parts with their boards aligned, run on over what nobody saw, parted where they lie side by side, and
    measured in the photographs once more now that it is known where they end.

    Raises StageError when their alignment does not converge.
    """
    from kerfwright.identify.depths import remeasured
    from kerfwright.identify.whole import whole_boards

    cloud, options = found.capture.cloud, options or WholeOptions()
    sheets, ends = whole_boards(parts.sheets, cloud, found.photos, found.free, options)
    sheets = remeasured(sheets, cloud, found.photos, parts.noise)
    return replace(parts, sheets=sheets, ends=ends)


def _selected(cloud: Cloud, slabs: list[Slab], evidence: Evidence, options: IdentifyOptions) -> Selection:
    """The candidates that are the boards, by the method that the options name."""
    from kerfwright.identify.annealing import select_annealing
    from kerfwright.identify.selection import select_exact

    if options.selection == "annealing":
        return select_annealing(cloud, slabs, evidence, options)
    return select_exact(evidence, options)


def _notes(explained: float, least: float) -> tuple[str, ...]:
    """What a person should know of a selection that leaves much of the cloud alone."""
    if explained >= least:
        return ()
    left = 100 * (1 - explained)
    return (
        f"the boards found leave {left:.0f} % of the cloud's surface unexplained: something of the object is missing, "
        "or not made of boards: compare model and photographs, and crop what does not belong to it",
    )
