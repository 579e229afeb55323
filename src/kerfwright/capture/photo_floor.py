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

from kerfwright.capture.steady import on_grid
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
LEAST_RISE = 0.15  # of the peak above the least in its range
TILES = 6  # along each side: parts of the floor whose heights are looked for apart, so that they tell its tilt
FEWEST_TILES = 5  # with a peak
FEWEST_PATCHES = 60  # windows of a tile that three views or more see
STEP = 2.0**-20  # of slopes, and of heights as a share of the object's size: pictures are worked on in single precision
POINTS = 40_000  # of the cloud; enough to cover the object's shadow


@dataclass(frozen=True, eq=False)
class PhotoFloor:
    """The plane normal @ x = offset, unit normal up.

    Its height under the object, the standard error of its tilt in radians, and how many photographs were compared.
    """

    normal: np.ndarray
    offset: float
    height: float
    tilt_error: float
    views: int


@dataclass(frozen=True, eq=False)
class _Plane:
    """z = height + slope @ (xy - middle), and the standard error of the slope."""

    middle: np.ndarray
    height: float
    slope: np.ndarray
    slope_error: float = np.inf

    def raised(self, offset: float) -> np.ndarray:
        """The plane at an offset in z as a row, (3,): z = row @ (x, y, 1)."""
        return np.array([*self.slope, self.height + offset - self.slope @ self.middle])


@dataclass(frozen=True, eq=False)
class _Grid:
    """Cells on a level plane: x = low + cell * (index + 0.5)."""

    low: np.ndarray
    cell: float
    shape: tuple[int, int]  # rows along y, columns along x

    @property
    def middle(self) -> np.ndarray:
        """(2,): x and y."""
        return self.low + 0.5 * self.cell * np.array(self.shape[::-1])

    @property
    def tile(self) -> np.ndarray:
        """Number of the tile that each cell lies in, rows x columns."""
        row, column = (np.arange(n) * TILES // n for n in self.shape)
        return row[:, None] * TILES + column

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
    plane = _search(views, greys, cloud, lowest)
    if plane is None:
        return None
    slope, height = on_grid(plane.slope, STEP), lowest + float(on_grid(plane.height - lowest, STEP * cloud.diameter))
    normal = np.array([*-slope, 1.0]) / np.sqrt(1 + slope @ slope)
    return PhotoFloor(normal, float(normal @ [*plane.middle, height]), height, plane.slope_error, len(views))


def _search(views: Sequence[View], greys: Sequence[np.ndarray], cloud: Cloud, lowest: float) -> _Plane | None:
    """The plane of the floor, looked for about the lowest points; None without clear peaks over the whole range."""
    plane = None
    for cells, step, count in ROUNDS:
        grid = _grid(views, cloud, cells)
        offsets = (np.arange(count) - count // 2) * step * cloud.diameter
        about = plane or _Plane(grid.middle, lowest - DEEPEST * cloud.diameter - offsets[0], np.zeros(2))
        pictures = [_picture(view, grey, cloud, grid, about.height) for view, grey in zip(views, greys, strict=True)]
        scores, patches = _sweep(pictures, grid, about, offsets)
        closer = _fitted(about, grid, offsets, scores, patches, 0.0 if plane else LEAST_RISE)
        if closer is None:
            break  # what the rounds before found cannot be told more exactly from these photographs
        plane = closer
    return plane


def _fitted(
    plane: _Plane, grid: _Grid, offsets: np.ndarray, scores: np.ndarray, patches: np.ndarray, least_rise: float
) -> _Plane | None:
    """The plane through the peaks of all tiles; None with too few."""
    peaks = [_peak(offsets, score, least_rise) for score in scores.T]
    good = [t for t, peak in enumerate(peaks) if peak is not None and patches[:, t].min() >= FEWEST_PATCHES]
    if len(good) < FEWEST_TILES:
        return None
    row, column = np.divmod(good, TILES)
    place = (np.stack([column, row], axis=1) + 0.5) / TILES * grid.cell * np.array(grid.shape[::-1])
    design = np.c_[place + grid.low - plane.middle, np.ones(len(good))]
    fit, error = _robust_fit(design, np.array([peaks[t] for t in good]), 0.05 * float(offsets[1] - offsets[0]))
    return _Plane(plane.middle, plane.height + float(fit[2]), plane.slope + fit[:2], error)


def _robust_fit(design: np.ndarray, heights: np.ndarray, least_spread: float) -> tuple[np.ndarray, float]:
    """Coefficients, (3,), and the standard error of the first two; tiles that peak elsewhere lose their weight."""
    weight = np.ones(len(heights))
    for _ in range(10):
        fit = np.linalg.lstsq(design * weight[:, None], heights * weight, rcond=None)[0]
        residual = heights - design @ fit
        spread = max(1.4826 * float(np.median(np.abs(residual))), least_spread)
        weight = 1 / (1 + (residual / (2 * spread)) ** 2)
    covariance = np.linalg.pinv((design * weight[:, None]).T @ (design * weight[:, None])) * spread**2
    return fit, float(np.sqrt(covariance[:2, :2].trace()))


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
        focal, middle = np.diag(view.camera.matrix)[:2], view.camera.matrix[:2, 2]
        rows, columns = np.indices(grey.shape)
        ideal = (np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5 - middle) / focal
        maps = (view.camera.distort(ideal) * focal + middle - 0.5).astype(np.float32).reshape(*grey.shape, 2)
        grey = cv2.remap(grey, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR)
    return grey


def _sweep(
    pictures: Sequence[_Picture], grid: _Grid, plane: _Plane, offsets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean correlation in each tile with the plane at each offset, (H, T), and of how many windows it is the mean."""
    tile = grid.tile.ravel()
    scores, patches = np.zeros((2, len(offsets), TILES * TILES))
    for i, offset in enumerate(offsets):
        correlation, several = _correlation(pictures, grid, plane.raised(offset))
        patches[i] = np.bincount(tile, several.ravel(), TILES * TILES)
        scores[i] = np.bincount(tile, correlation.ravel(), TILES * TILES) / np.maximum(patches[i], 1)
    return scores, patches


def _grid(views: Sequence[View], cloud: Cloud, cells: int) -> _Grid:
    """The object's surroundings in so many cells, but none smaller than a pixel sees."""
    xy = cloud.points[:, :2]
    low, high = xy.min(axis=0) - AROUND * cloud.diameter, xy.max(axis=0) + AROUND * cloud.diameter
    middle = np.median(cloud.points, axis=0)
    pixel = np.median([np.linalg.norm(view.centre - middle) / view.camera.focal for view in views])
    cell = max(float((high - low).max()) / cells, float(pixel))
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


def _correlation(pictures: Sequence[_Picture], grid: _Grid, z_of_xy1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean correlation over pairs of pictures about each cell, and where three or more see it; zero elsewhere.

    With z the pictures normalised in each window, the sum over pairs of their products is (|sum z|^2 - n) / 2.
    """
    import cv2

    total, count = np.zeros(grid.shape, np.float32), np.zeros(grid.shape, np.float32)
    for picture in pictures:
        values, whole = _normalised(*_laid_on(picture, grid, z_of_xy1))
        total += values
        count += whole
    square = cv2.boxFilter(total * total, -1, (WINDOW, WINDOW))
    several = count >= 3
    return np.where(several, (square - count) / np.maximum(count * (count - 1), 1), 0), several


def _laid_on(picture: _Picture, grid: _Grid, z_of_xy1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The picture on the plane z = z_of_xy1 @ (x, y, 1), and a mask of cells that it shows."""
    import cv2

    world_from_plane = np.array([[1, 0, 0], [0, 1, 0], z_of_xy1, [0, 0, 1]])
    homography = picture.index_from_world @ world_from_plane @ grid.world_from_index
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


def _peak(offsets: np.ndarray, scores: np.ndarray, least_rise: float) -> float | None:
    """Place of the highest peak, by a parabola through its top; None where it is low, or at the end of the range."""
    i = int(scores.argmax())
    if not 0 < i < len(scores) - 1 or scores[i] < LEAST_PEAK or scores[i] - scores.min() < least_rise:
        return None
    before, at, after = scores[i - 1 : i + 2]
    return float(offsets[i] + 0.5 * (before - after) / (before - 2 * at + after) * (offsets[1] - offsets[0]))
