"""Options of identification. Lengths are fractions of the cloud's largest side D unless the name says mm."""

from __future__ import annotations

from dataclasses import dataclass

from kerfwright.errors import OptionError

__all__ = ["IdentifyOptions"]

SELECTIONS, ENERGIES = ("exact", "annealing"), ("total", "mean")


@dataclass(frozen=True)
class IdentifyOptions:
    """What identification may be told; one set serves every object.

    Raises OptionError when an option names no method that there is.
    """

    neighbours: int = 16  # points in a local neighbourhood
    inlier_sigmas: float = 5.0  # a point belongs to a plane within this many standard deviations of the noise
    inlier_floor: float = 1 / 500  # ... and never less than this: stereo noise drifts slowly along a face
    normal_degrees: float = 15.0  # a point's smoothed normal may differ from its plane's by this
    min_points: int = 60  # smallest primitive
    min_sheet_side: float = 1 / 22  # a sheet plane covers at least a square of this side
    min_thickness: float = 1 / 250
    max_thickness: float = 1 / 6
    sweep_step: float = 1 / 2000  # offsets at which photographs are read
    min_unseen_side: float = 1 / 20  # a board of unseen thickness is at least this wide over most of its area
    min_hole_side: float = 1 / 40  # side of the smallest square that is kept as a hole
    opposite_degrees: float = 4.0  # opposite sheet planes are parallel within this
    cut_area_ratio: float = 5.0  # paper, Part Selection: cut surface over cut region area
    sample_voxel: float = 1 / 150  # spacing of the surface samples that selection covers
    board_cost: float = 0.006  # a board must explain this share of the surface to be worth having
    dark_density: float = 0.35  # points on a dark board's faces at most, of those on faces seen well
    free_sites: int = 1500  # interior samples of a candidate tested for see-through
    max_free: float = 0.25  # candidates with a larger share of see-through interior are dropped
    least_explained: float = 0.7  # share of the surface; stereo's fringe leaves a good model with .8 or more
    selection: str = "exact"  # or "annealing", as in the paper, for comparison
    solver_nodes: int = 20_000  # of the search tree; a limit in seconds would give other boards on a busy machine
    annealing_energy: str = "total"  # squared distance over all points, as in the paper, or their "mean"
    annealing_steps: int = 1000  # paper, Part Selection
    annealing_temperatures: tuple[float, float] = (10.0, 0.1)  # first and last; paper, Part Selection
    seed: int = 0

    def __post_init__(self):
        for name, known in (("selection", SELECTIONS), ("annealing_energy", ENERGIES)):
            if getattr(self, name) not in known:
                raise OptionError(f"{name}: {getattr(self, name)}: not known: take {' or '.join(known)}")
