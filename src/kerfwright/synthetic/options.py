"""What a synthetic capture is made with: cameras, photographs and cloud apart, and presets with their reasons."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

__all__ = ["PRESETS", "CaptureOptions", "CloudOptions", "DatasetOptions", "ImageOptions"]


@dataclass(frozen=True)
class DatasetOptions:
    """Cameras and frames."""

    seed: int = 0
    images: int = 30
    width: int = 1024
    height: int = 768
    field_of_view: float = 65.0  # degrees across the width: a phone's main camera
    distance: float = 1.28  # camera to object in diagonals of its box, as the shared captures were taken
    camera_model: str = "PINHOLE"
    distortion: tuple[float, ...] = ()  # k1 (k2 p1 p2) of the camera model
    position_noise: float = 0.0  # mm, standard deviation of the written camera centres
    angle_noise: float = 0.0  # degrees, of the written rotations
    pixel_noise: float = 0.0  # px, of the written principal point
    scale: float = 1.0  # capture units per metre
    turn: float = 0.0  # degrees about the vertical, of the capture's frame
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)  # capture units


@dataclass(frozen=True)
class ImageOptions:
    """How the photographs look."""

    samples: int = 2  # rays a pixel along each side
    texels: float = 0.0015  # of wood, in largest sides: finer than a pixel sees
    exposure: float = 0.08  # relative standard deviation between pictures
    white_balance: float = 0.015
    read_noise: float = 0.8  # grey levels of 255
    shot_noise: float = 1.6  # grey levels at white
    gloss: float = 0.5  # of a lacquered board's highlight, 0 is matt
    blur: float = 0.5  # px, lens and demosaicing
    quality: int = 92  # JPEG
    knots: float = 6.0  # a square metre and sheet side
    bars: bool = False  # of a blind before the windows: shadows with straight edges
    floor_texels: int = 2048  # across the room's floor
    room_nodes: int = 160  # of the light map, across floor and walls
    light_rays: int = 48  # a node of the light map


@dataclass(frozen=True)
class CloudOptions:
    """How the cloud is wrong. Lengths in mm hold at D = 450 mm and 1600 px; they grow with the size of a pixel."""

    points: int = 300_000
    views: int = 3  # that must see a point
    grazing: float = 75.0  # degrees from the normal beyond which a view does not count
    noise: float = 0.12  # white part, mm
    drift: float = 0.14  # part that neighbours share, mm
    drift_length: float = 10.0  # over which they share it, mm
    bias: float = 0.0  # outward shift of the whole surface, mm
    tail: float = 0.04  # share of points whose noise is many times larger
    tail_factor: float = 6.0
    fringe: float = 0.06  # share of points beside silhouettes
    fringe_width: float = 5.0  # px over which the object's surface runs on past its silhouette
    normal_noise: float = 1.6  # degrees
    normal_flips: float = 0.004  # share turned round
    normal_radius: float = 3.0  # mm over which normals are averaged: rounds them near edges
    dropout: float = 0.12  # share of the surface lost in blobs, where wood shows no texture
    floor: bool = False  # leave the floor in


@dataclass(frozen=True)
class CaptureOptions:
    """All of it."""

    dataset: DatasetOptions = field(default_factory=DatasetOptions)
    images: ImageOptions = field(default_factory=ImageOptions)
    cloud: CloudOptions = field(default_factory=CloudOptions)

    def seeded(self, seed: int) -> CaptureOptions:
        """The same with another seed."""
        return replace(self, dataset=replace(self.dataset, seed=seed))


PRESETS = {
    # what the shared captures look like, a little smaller so that a set of thirty is made in half an hour
    "plain": CaptureOptions(),
    # no noise at all: what remains wrong is the program's, not the capture's
    "clean": CaptureOptions(
        images=ImageOptions(exposure=0, white_balance=0, read_noise=0, shot_noise=0, gloss=0),
        cloud=CloudOptions(
            noise=0, drift=0, tail=0, fringe=0, normal_noise=0, normal_flips=0, dropout=0, normal_radius=0
        ),
    ),
    # pictures as phones save them, not undistorted: the readers must undo it
    "distorted": CaptureOptions(
        dataset=DatasetOptions(camera_model="OPENCV", distortion=(-0.08, 0.03, 0.001, -0.0005))
    ),
    "radial": CaptureOptions(dataset=DatasetOptions(camera_model="SIMPLE_RADIAL", distortion=(-0.06,))),
    # poses as structure from motion gives them: half a pixel, 0.05 degree, an arbitrary frame, the floor left in
    "recovered": CaptureOptions(
        dataset=DatasetOptions(
            position_noise=0.3, angle_noise=0.05, pixel_noise=0.5, scale=3.7, turn=77.0, shift=(-2.2, 1.9, -0.3)
        ),
        cloud=CloudOptions(floor=True, noise=0.16, drift=0.2, tail=0.08, normal_flips=0.02),
    ),
    # dark or shiny wood and few pictures: twice the fringe, a third of the surface bare, tails three times as thick
    "rough": CaptureOptions(cloud=CloudOptions(noise=0.18, drift=0.25, tail=0.12, fringe=0.12, dropout=0.3)),
    # straight shadows and many knots on wood of one colour: none of them is a seam
    "shadows": CaptureOptions(images=ImageOptions(bars=True, knots=30.0)),
    # the surface sits too far out everywhere, as it did in two of the seven shared captures
    "biased": CaptureOptions(cloud=CloudOptions(bias=0.35)),
    # small and coarse, made in seconds: for trying the program out
    "quick": CaptureOptions(
        dataset=DatasetOptions(images=12, width=512, height=384), cloud=CloudOptions(points=60_000)
    ),
}
