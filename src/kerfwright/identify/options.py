"""Options of identification. Lengths are fractions of the cloud's largest side D unless the name says mm."""

from __future__ import annotations

from dataclasses import dataclass

from kerfwright.errors import OptionError

__all__ = ["IdentifyOptions", "WholeOptions"]

SELECTIONS, ENERGIES = ("exact", "annealing"), ("total", "mean")


@dataclass(frozen=True)
class WholeOptions:
    """How boards are made whole that the cloud shows in part; lengths are fractions of the cloud's largest side D."""

    reach: float = 1 / 30  # boards that come this near each other are connected (paper, Connections)
    square_degrees: float = 3.0  # boards further than this from parallel or square are meant to be tilted
    square_floor_degrees: float = 0.35  # poses and stereo drift by this much
    direction_sigmas: float = 3.0
    ground_reach: float = 1 / 40  # a board that comes this near the floor stands on it
    outline_error: float = 1 / 60  # how far a rough outline may be off
    ragged: float = 1 / 60  # ... in the dark, also after it was traced in photographs
    unseen_reach: float = 1 / 8  # a board that fades out unseen this near another runs on to it
    far_reach: float = 1 / 2  # ... and this near when the photographs show its end at the plane
    end_score: float = 2.8  # least edge strength of a clear end
    rival_score: float = 2.0  # ... of one that lies before the plane and is clearer than the one at it
    end_excess: float = 0.2  # least share of stretches and views, beyond the usual, that show an end
    veil: float = 1 / 20  # by which stereo may have run a board on over a dark opening
    end_offset: float = 1 / 200
    flush: float = 1 / 1000  # sheet planes of neighbours that differ by less are one
    passes: int = 2  # ends are looked for again once boards were run on to those found
    min_contact: float = 1 / 100  # shortest interface


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
    thick: float = 1 / 20  # deeper than this, a row of compartments may look like one board
    max_free_thick: float = 0.02  # ... and is one if more of its interior was seen through
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
