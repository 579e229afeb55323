"""The floor where it was cut out of the cloud: the height at which the photographs agree on what lies round the object.

A plane sweep (Collins, A space-sweep approach to true multi-image matching, 1996): every photograph is laid on a level
plane; at the floor's height the pictures of its texture fall on each other, and their normalised cross-correlation has
a sharp peak.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from kerfwright.capture.types import Cloud, View

__all__ = ["PhotoFloor", "floor_in_photos"]

VIEWS = 10  # each more costs as much and tells less
LOWEST_SIGHT = (
    0.2  # sine of the least angle between a line of sight and the floor: below it texture is too foreshortened
)
AROUND = 0.3  # of the object's size: how far the floor is looked at beside it
DEEPEST = 0.10  # of the object's size: how far under its lowest points the floor may lie
# Cells along the longer side, step in heights as a share of the object's size, and number of heights: each round looks
# closer about the peak of the one before.
ROUNDS = ((160, 0.004, 28), (400, 0.0015, 7), (720, 0.0008, 5))
WINDOW = 9  # cells a side of the patches that are compared
LEAST_PEAK = 0.2  # correlation at the floor; between unlike pictures it is about zero
LEAST_RISE = 0.15  # of the peak above the median over all heights
FEWEST_PATCHES = 500  # windows seen by three views or more
POINTS = 40_000  # of the cloud; enough to cover the object's shadow


@dataclass(frozen=True)
class PhotoFloor:
    """Height of the floor, its correlation there, and how many photographs were compared."""

    height: float
    correlation: float
    views: int


@dataclass(frozen=True, eq=False)
class _Grid:
    """Cells on a level plane: x = low + cell * (index + 0.5)."""

    low: np.ndarray
    cell: float
    shape: tuple[int, int]  # rows along y, columns along x

    @property
    def world_from_index(self) -> np.ndarray:
        """3x3: cell indices (column, row, 1) to x, y, 1."""
        x, y = self.low + 0.5 * self.cell
        return np.array([[self.cell, 0, x], [0, self.cell, y], [0, 0, 1]])


@dataclass(frozen=True, eq=False)
class _Picture:
    """A grey picture without distortion: index_from_world is 3x4, to cv2's indices; seen masks the floor it shows."""

    grey: np.ndarray
    index_from_world: np.ndarray
    seen: np.ndarray


def floor_in_photos(views: Sequence[View], cloud: Cloud, lowest: float) -> PhotoFloor | None:
    """Look for the floor in the photographs, from a tenth of the object's size below `lowest` to a hundredth above.

    Parameters
    ----------
    views : with images on disk, +z up, any unit
    cloud : the object alone
    lowest : height of its lowest points

    Returns
    -------
    None where the photographs show no textured floor: fewer than three look down on it, or they agree at no height.
    """
    views = _looking_down([view for view in views if view.path.is_file()], lowest, cloud)
    if len(views) < 3:
        return None
    with ThreadPoolExecutor() as pool:
        greys = list(pool.map(_grey, views))
    found = _search(views, greys, cloud, lowest - DEEPEST * cloud.diameter)
    return None if found is None else PhotoFloor(*found, len(views))


def _search(
    views: Sequence[View], greys: Sequence[np.ndarray], cloud: Cloud, deepest: float
) -> tuple[float, float] | None:
    """Height and correlation of the floor, looked for from `deepest` upwards; None without a clear peak."""
    (cells, step, count), *closer = ROUNDS
    heights = deepest + np.arange(count) * step * cloud.diameter
    scores = _sweep(views, greys, cloud, heights, cells)
    found = _peak(heights, scores) if scores.max() - np.median(scores) >= LEAST_RISE else None
    for cells, step, count in closer:
        if found is not None:
            heights = found[0] + (np.arange(count) - count // 2) * step * cloud.diameter
            found = _peak(heights, _sweep(views, greys, cloud, heights, cells))
    return found


def _looking_down(views: Sequence[View], lowest: float, cloud: Cloud) -> list[View]:
    """Up to VIEWS views from well above the floor, evenly round the object."""
    foot = np.array([*np.median(cloud.points[:, :2], axis=0), lowest])
    ways = [(view.centre - foot) / np.linalg.norm(view.centre - foot) for view in views]
    steep = [
        (float(np.arctan2(way[1], way[0])), view)
        for way, view in zip(ways, views, strict=True)
        if way[2] > LOWEST_SIGHT
    ]
    around = [view for _, view in sorted(steep, key=lambda pair: pair[0])]
    return [
        around[i] for i in np.unique(np.linspace(0, len(around), min(VIEWS, len(around)), endpoint=False).astype(int))
    ]


def _grey(view: View) -> np.ndarray:
    """The photograph in grey, float32, without distortion; same calibration matrix."""
    import cv2

    grey = cv2.cvtColor(view.image(), cv2.COLOR_RGB2GRAY)
    if view.camera.distortion.any():
        matrix = view.camera.matrix - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
        grey = cv2.undistort(grey, matrix, view.camera.distortion)
    return grey


def _sweep(
    views: Sequence[View], greys: Sequence[np.ndarray], cloud: Cloud, heights: np.ndarray, cells: int
) -> np.ndarray:
    """Correlation of the pictures at each height, (H,)."""
    grid = _grid(cloud, cells)
    pictures = [
        _picture(view, grey, cloud, grid, float(heights.mean())) for view, grey in zip(views, greys, strict=True)
    ]
    return np.array([_correlation(pictures, grid, height) for height in heights])


def _grid(cloud: Cloud, cells: int) -> _Grid:
    xy = cloud.points[:, :2]
    low, high = xy.min(axis=0) - AROUND * cloud.diameter, xy.max(axis=0) + AROUND * cloud.diameter
    cell = float((high - low).max()) / cells
    columns, rows = np.ceil((high - low) / cell).astype(int)
    return _Grid(low, cell, (int(rows), int(columns)))


def _picture(view: View, grey: np.ndarray, cloud: Cloud, grid: _Grid, height: float) -> _Picture:
    """The photograph at the grid's resolution, so that neither skips what the other shows."""
    import cv2

    middle = np.array([*np.median(cloud.points[:, :2], axis=0), height])
    factor = min(1.0, np.linalg.norm(view.centre - middle) / (view.camera.focal * grid.cell))
    small = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA).astype(np.float32)
    zoom = np.diag([small.shape[1] / grey.shape[1], small.shape[0] / grey.shape[0], 1.0])
    index_from_pixel = np.array([[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1]]) @ zoom
    projection = index_from_pixel @ view.camera.matrix @ view.camera_from_world[:3]
    return _Picture(small, projection, _unshadowed(view.centre, cloud, grid, height))


def _unshadowed(centre: np.ndarray, cloud: Cloud, grid: _Grid, height: float) -> np.ndarray:
    """Mask of cells, rows x columns, that the object does not hide: it casts a shadow from the camera's centre."""
    import cv2

    points = cloud.points[:: max(1, len(cloud) // POINTS)]
    points = points[points[:, 2] < centre[2] - 0.05 * (centre[2] - height)]
    reach = (centre[2] - height) / (centre[2] - points[:, 2])
    index = np.floor((centre[:2] + (points[:, :2] - centre[:2]) * reach[:, None] - grid.low) / grid.cell)
    inside = (index >= 0).all(axis=1) & (index < grid.shape[::-1]).all(axis=1)
    column, row = index[inside].astype(int).T
    shadow = np.zeros(grid.shape, np.uint8)
    shadow[row, column] = 1
    return cv2.dilate(shadow, np.ones((WINDOW, WINDOW), np.uint8)) == 0


def _correlation(pictures: Sequence[_Picture], grid: _Grid, height: float) -> float:
    """Mean correlation over pairs of pictures and over windows that three or more of them see; -1 where too few do.

    With z the pictures normalised in each window, the sum over pairs of their products is (|sum z|^2 - n) / 2.
    """
    import cv2

    total, count = np.zeros(grid.shape, np.float32), np.zeros(grid.shape, np.float32)
    for picture in pictures:
        values, whole = _normalised(*_laid_on(picture, grid, height))
        total += values
        count += whole
    square = cv2.boxFilter(total * total, -1, (WINDOW, WINDOW))
    several = count >= 3
    if several.sum() < FEWEST_PATCHES:
        return -1.0
    n = count[several]
    return float(((square[several] - n) / (n * (n - 1))).mean())


def _laid_on(picture: _Picture, grid: _Grid, height: float) -> tuple[np.ndarray, np.ndarray]:
    """The picture on the plane z = height, and a mask of cells that it shows."""
    import cv2

    m = picture.index_from_world
    homography = np.stack([m[:, 0], m[:, 1], m[:, 2] * height + m[:, 3]], axis=1) @ grid.world_from_index
    laid = cv2.warpPerspective(
        picture.grey, homography, grid.shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderValue=-1e4
    )
    return laid, picture.seen & (laid >= 0)


def _normalised(values: np.ndarray, shown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values less the mean, over the deviation, of the window about each; zero where that is not whole."""
    import cv2

    window = (WINDOW, WINDOW)
    whole = cv2.boxFilter(shown.astype(np.float32), -1, window) > 1 - 0.5 / WINDOW**2
    mean = cv2.boxFilter(values, -1, window)
    deviation = np.sqrt(
        np.maximum(cv2.boxFilter(values * values, -1, window) - mean * mean, 1.0)
    )  # at least one grey level: noise
    return np.where(whole, (values - mean) / deviation, 0).astype(np.float32), whole


def _peak(heights: np.ndarray, scores: np.ndarray) -> tuple[float, float] | None:
    """Place and height of the highest peak, by a parabola through its top; None where it is low or at the end."""
    i = int(scores.argmax())
    if not 0 < i < len(scores) - 1 or scores[i] < LEAST_PEAK:
        return None
    near = np.abs(np.arange(len(scores)) - i) <= 1
    near |= (np.abs(np.arange(len(scores)) - i) <= 2) & (scores > 0.5 * scores[i])
    steps = np.arange(len(scores))[near] - i
    curve, slope, _ = np.polyfit(steps, scores[near], 2)
    shift = float(np.clip(-0.5 * slope / curve, -1, 1)) if curve < 0 else 0.0
    return float(heights[i] + shift * (heights[1] - heights[0])), float(scores[i])
