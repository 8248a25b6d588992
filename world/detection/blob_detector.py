"""Finds things of one color in a picture, by what makes them different from the water and ground around them."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from world.detection.connected_components import label_components

Floats = NDArray[np.floating[Any]]

YELLOW = (255.0, 200.0, 20.0)  # of gliders
TILES = 8  # per side of the picture, each with a background of its own
SMALLEST_TILE = 60  # px: a near glider must not fill one
SAMPLES = 16  # per side of a tile, at most
DEVIATION = 1.4826  # from the median of absolute deviations to the standard deviation of a normal one
QUANTUM = 1.0  # of 255: no background is quieter
HUE = 0.5  # least cosine between the desired direction and that in which a set differs from what is around it
GAP = 2  # px between parts of a set
MOST_PIXELS = 0.1  # share of the picture: what is larger is no thing in front of a background


class ImageDetection(NamedTuple):
    """A blob in a picture: its middle (px), how many pixels it has (0 if unknown), and the marker's number.

    `strength` is how far it stands out, in standard deviations of the background.
    """

    u: float
    v: float
    pixels: float = 0.0
    strength: float = math.inf
    marker: int | None = None


@dataclass(frozen=True)
class BlobDetector:
    """Finds sets of pixels that stand out in the direction of a color (red, green, blue; 0 to 255).

    A matched filter: the direction is weighted with the inverse covariance of the background (Reed, Mallett and Brennan
    1974), so that shades of sand and waves cancel out. A pixel belongs to a set beyond `pixel_threshold` standard
    deviations; the set counts if it has `least_pixels` pixels and their sum has `least_strength`. Sets that touch the
    border of what the camera sees are left out: their middle is not known.
    """

    color: tuple[float, float, float] = YELLOW
    pixel_threshold: float = 3.0
    least_strength: float = 15.0
    least_pixels: int = 6

    def detect(self, image: NDArray[np.uint8]) -> list[ImageDetection]:
        """The marks in an RGBA picture (height, width, 4), from top to bottom; transparent pixels show nothing."""
        height, width = image.shape[:2]
        tiles = _Tiles(width, height)
        samples = tiles.sampled(image)
        seen = samples[..., 3] > 0
        if not seen.any():
            return []
        background = _Background.of(samples[..., :3].astype(np.float32), seen, self.color)
        over = self._over(image, background, tiles)
        at = np.flatnonzero(over.reshape(-1) > 0.0)
        if not 0 < len(at) <= MOST_PIXELS * width * height:
            return []
        rows, columns = np.divmod(at, width)
        numbers, count = _sets(rows, columns)
        sizes = np.bincount(numbers, minlength=count)
        weights = over.reshape(-1)[at].astype(np.float64) + self.pixel_threshold
        total = np.bincount(numbers, weights, count)
        good = (sizes >= self.least_pixels) & (total >= self.least_strength * np.sqrt(sizes))
        tile = tiles.of(rows, columns)
        apart = image.reshape(-1, 4)[at, :3] - background.colors[tile]
        apart = np.stack([np.bincount(numbers, apart[:, k], count) for k in range(3)], axis=-1)
        good &= _score(apart, background.direction) >= HUE * np.linalg.norm(apart, axis=-1)
        even = np.minimum(weights, 2.0 * self.pixel_threshold)  # a side in the sun weighs no more than one in the shade
        share = np.bincount(numbers, even, count)
        u = np.bincount(numbers, even * (columns + 0.5), count) / share
        v = np.bincount(numbers, even * (rows + 0.5), count) / share
        cut = _cut(image, rows, columns, numbers, count)
        return [
            ImageDetection(float(u[k]), float(v[k]), float(sizes[k]), float(total[k] / math.sqrt(sizes[k])))
            for k in np.flatnonzero(good & ~cut)
        ]

    def _over(self, image: NDArray[np.uint8], background: "_Background", tiles: "_Tiles") -> Floats:
        """Excess of each pixel over the edge, in standard deviations of its tile; negative where nothing is seen."""
        found = np.empty(image.shape[:2], np.float32)
        for rows, columns, j, i in tiles:
            pixels = image[rows, columns]
            over = _score(pixels, background.weights / background.sigma[j, i])
            down, across = background.around(j, i, *pixels.shape[:2])
            over -= (down / background.sigma[j, i] + np.float32(self.pixel_threshold))[:, None]
            over -= across / background.sigma[j, i]
            if (hidden := pixels[..., 3] == 0).any():
                over[hidden] = -1.0
            found[rows, columns] = over
        return found


class _Tiles:
    """Cuts a picture into rectangles."""

    def __init__(self, width: int, height: int):
        self.down, self.across = (max(1, min(TILES, side // SMALLEST_TILE)) for side in (height, width))
        self.rows = np.linspace(0, height, self.down + 1).astype(np.int64)
        self.columns = np.linspace(0, width, self.across + 1).astype(np.int64)

    def __iter__(self):
        for j in range(self.down):
            for i in range(self.across):
                yield slice(*self.rows[j : j + 2].tolist()), slice(*self.columns[i : i + 2].tolist()), j, i

    def of(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The tiles (n,), (n,) of pixels."""
        j = np.searchsorted(self.rows, rows, side="right") - 1
        return j, np.searchsorted(self.columns, columns, side="right") - 1

    def sampled(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Pixels of all tiles (rows of tiles, columns of tiles, n, 4), as many of each."""
        rows, columns = _spread(self.rows), _spread(self.columns)
        picked = image[rows.reshape(-1, 1), columns.reshape(1, -1)]
        shape = self.down, rows.shape[1], self.across, columns.shape[1], 4
        return picked.reshape(shape).swapaxes(1, 2).reshape(self.down, self.across, -1, 4)


def _spread(borders: NDArray[np.int64]) -> NDArray[np.int64]:
    """(tiles, n) places between the borders of each tile."""
    count = max(1, min(SAMPLES, int(np.diff(borders).max())))
    shares = (np.arange(count) + 0.5) / count
    return (borders[:-1, None] + shares * np.diff(borders)[:, None]).astype(np.int64)


class _Background(NamedTuple):
    """Background of pixels: the median of the `colors` of each tile, and of their scores the median and deviation.

    `weights` (3,) make scores of colors; `direction` (3,) is the unit vector of the desired hue.
    """

    colors: Floats
    direction: Floats
    weights: Floats
    middle: Floats
    sigma: Floats

    @classmethod
    def of(cls, colors: Floats, seen: NDArray[np.bool_], wanted: tuple[float, float, float]) -> "_Background":
        """Estimate from samples (rows, columns, n, 3) of tiles, some of which are visible."""
        known = np.where(seen[..., None], colors, np.nan)
        known[~seen.any(axis=-1)] = np.median(colors[seen], axis=0)
        middle_color = _medians(known, 2)
        apart = (known - middle_color[:, :, None])[seen]
        # Things in front of the background must not count as a part of it.
        limit = 4.0 * DEVIATION * np.median(np.abs(apart), axis=0) + 2.0 * QUANTUM
        usual = apart[(np.abs(apart) <= limit).all(axis=-1)].astype(np.float64)
        spread: Floats = np.einsum("ni,nj->ij", usual, usual) / max(1, len(usual)) + QUANTUM**2 * np.eye(3)
        # Brightness differs with the light: only the hue is looked for.
        direction = np.array(wanted) - math.fsum(wanted) / 3.0
        direction /= np.linalg.norm(direction)
        weights: Floats = np.asarray(np.linalg.solve(spread, direction), np.float64)
        weights = (weights / math.sqrt(float(direction @ weights))).astype(np.float32)
        scores = _score(known, weights)
        middle = _medians(scores, 2)
        sigma = DEVIATION * _medians(np.abs(scores - middle[..., None]), 2)
        quiet = max(float(np.median(sigma)), QUANTUM * float(np.linalg.norm(weights)))
        return cls(middle_color, direction, weights, middle, np.maximum(sigma, np.float32(quiet)))

    def around(self, j: int, i: int, height: int, width: int) -> tuple[Floats, Floats]:
        """Usual scores in a tile, as a sum of parts for its rows (height,) and columns (width,): they may slope."""
        down, across = _slope(self.middle[:, i], j), _slope(self.middle[j], i)
        rows, columns = ((np.arange(size) + 0.5) / size - 0.5 for size in (height, width))
        return (self.middle[j, i] + down * rows).astype(np.float32), (across * columns).astype(np.float32)


def _slope(values: Floats, at: int) -> float:
    """The change from one value to the next, of both sides the smaller one; 0 at a peak."""
    before = float(values[at] - values[at - 1]) if at else math.nan
    after = float(values[at + 1] - values[at]) if at + 1 < len(values) else math.nan
    known = [change for change in (before, after) if not math.isnan(change)]
    if not known or min(known) * max(known) <= 0.0:
        return 0.0
    return min(known, key=abs)


def _score(colors: NDArray[Any], weights: Floats) -> Floats:
    """The weighted sum of red, green and blue (..., 3 or 4); not by BLAS, whose last digit depends on its threads."""
    red, green, blue = weights
    found = colors[..., 0] * red
    found += colors[..., 1] * green
    found += colors[..., 2] * blue
    return found


def _medians(values: Floats, axis: int) -> Floats:
    """Medians of those that are not NaN, of which there is one at least."""
    ordered = np.sort(values, axis=axis)  # NaN comes last
    middle = (np.count_nonzero(np.isfinite(values), axis=axis, keepdims=True) - 1) // 2
    return np.take_along_axis(ordered, middle, axis=axis).squeeze(axis)


def _sets(rows: NDArray[np.int64], columns: NDArray[np.int64]) -> tuple[NDArray[np.integer[Any]], int]:
    """The set (n,) of each pixel, and how many there are; noise may part pixels of a set by one or two others."""
    stride = int(columns.max()) + GAP
    cells, within = np.unique(rows // GAP * stride + columns // GAP, return_inverse=True)
    numbers, count = label_components(*np.divmod(cells, stride))
    return numbers[within.reshape(-1)], count


def _cut(
    image: NDArray[np.uint8],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    numbers: NDArray[np.integer[Any]],
    count: int,
) -> NDArray[np.bool_]:
    """(count,) which sets touch the border of the picture, or transparent pixels."""
    height, width = image.shape[:2]
    touching = (rows == 0) | (rows == height - 1) | (columns == 0) | (columns == width - 1)
    for j, i in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        touching |= image[np.clip(rows + j, 0, height - 1), np.clip(columns + i, 0, width - 1), 3] == 0
    return np.bincount(numbers, touching, count) > 0.0
