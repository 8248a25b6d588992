"""Depth of the water: a smooth bottom through scattered soundings."""

import math
from collections.abc import Callable, Iterable, Sized
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from support.wgs84 import is_on_earth

Floats = NDArray[np.floating[Any]]
T = TypeVar("T")

PARTS = 4  # of each side of a cell; only soundings near a part are searched for its points
REMEMBERED = 20000  # parts whose soundings are kept, of a survey of some hours
CHUNK = 1 << 13  # pairs of soundings and points per step: their arrays fit into the L2 cache
SCATTERED = 24  # points in a part: if they are fewer, it is quicker to look at all soundings around a cell
FARTHEST_CELL = 2.0**31 - 2
NINE_CELLS = np.array([(i, j) for i in (-1.0, 0.0, 1.0) for j in (-1.0, 0.0, 1.0)]).T
Sounding = tuple[float, float, float]
OffsetFunction = Callable[[float, float, float, float], tuple[float, float]]


class BathymetryError(ValueError):
    """The section [Bathymetry] of a profile has no valid position, or rows that are not soundings."""


class Bathymetry:
    """Depth (m) between `soundings`: north, east and depth (m) from the reference, a latitude and longitude (rad).

    Between them it is Shepard's inverse-distance mean of those within `radius` m (Franke and Nielson 1980), which
    passes through each sounding and has no steps; if none is in range, it is `default_depth`. The water stands `level`
    m above the datum of all these depths. `shallowest` is the least depth of all, `deepest` the greatest; beams look at
    the bottom each `sampling_step` m.
    """

    def __init__(
        self,
        soundings: Iterable[Sounding] | NDArray[np.float64],
        radius: float,
        elsewhere: float,
        reference: tuple[float, float] = (0.0, 0.0),
        level: float = 0.0,
    ):
        self.reference = reference
        self._radius, self._elsewhere = radius, elsewhere + level
        self.sampling_step: float = radius / 4.0
        rows: Any = soundings if isinstance(soundings, Sized) else list(soundings)
        self._rows: NDArray[np.float64] = np.array(rows, dtype=np.float64, order="C").reshape(-1, 3)
        self._rows[:, 2] += level
        self.has_soundings: bool = len(self._rows) > 0
        self.shallowest: float = float(self._rows[:, 2].min(initial=self._elsewhere))
        self.deepest: float = float(self._rows[:, 2].max(initial=self._elsewhere))
        keys = _cell_keys(*np.floor(self._rows[:, :2].T / radius))
        self._order = np.argsort(keys, kind="stable")
        self._keys = keys[self._order]
        self._cells: dict[tuple[int, int], list[Sounding]] = {}
        self._shallowest: dict[tuple[int, int], float] = {}
        self._near: dict[tuple[int, int], list[Sounding]] = {}
        self._nearby: dict[tuple[int, int], Floats] = {}
        self._around: dict[tuple[int, int], Floats] = {}

    def depth(self, north: float, east: float) -> float:
        """Depth (m) at an offset (m) from the reference."""
        total = weights = 0.0
        radius, root = self._radius, math.sqrt
        nearness, square, side = 1.0 / radius, radius * radius, radius / PARTS
        part = math.floor(north / side), math.floor(east / side)
        near = self._near.get(part)
        if near is None:
            near = self._within_reach(part)
            if near:
                if len(self._near) >= REMEMBERED:
                    self._near.clear()
                self._near[part] = near
        for n, e, depth in near:
            dn, de = n - north, e - east
            distance = dn * dn + de * de
            if distance < square:
                if distance < 1e-6:
                    return depth
                weight = 1.0 / root(distance) - nearness
                weight *= weight
                weights += weight
                total += weight * depth
        return total / weights if weights else self._elsewhere

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Least and most north, least and most east (m) of the soundings; zeros without any."""
        if not self.has_soundings:
            return 0.0, 0.0, 0.0, 0.0
        (n0, e0), (n1, e1) = self._rows[:, :2].min(axis=0).tolist(), self._rows[:, :2].max(axis=0).tolist()
        return n0, n1, e0, e1

    @property
    def default_depth(self) -> float:
        """Depth (m) where no sounding is near."""
        return self._elsewhere

    def depths(self, north: Floats, east: Floats) -> Floats:
        """`depth` at many offsets (n,) at once, to the last bit."""
        side = self._radius / PARTS
        parts = np.floor(np.stack((north, east)) / side)
        order, borders = _grouped(parts)
        cells = len(borders) * SCATTERED > len(order)
        if cells:
            parts = np.floor_divide(parts, PARTS, out=parts)
            order, borders = _grouped(parts)
        found = np.empty(len(order))
        for first, last in pairwise(borders):
            group = order[first:last]
            place = int(parts[0, group[0]]), int(parts[1, group[0]])
            self._among(self._soundings(place, cells), north, east, group, found)
        return found

    def _soundings(self, place: tuple[int, int], cells: bool) -> Floats:
        """North, east and depth (3, n) of those that may be within the radius of a point in a cell, or in a part."""
        kept = self._around if cells else self._nearby
        found = kept.get(place)
        if found is None:
            rows = self._in_cells_around(place) if cells else self._within_reach(place)
            found = np.array(rows, dtype=np.float64).reshape(-1, 3).T
            if found.size:
                if len(kept) >= REMEMBERED:
                    kept.clear()
                kept[place] = found
        return found

    def _among(self, near: Floats, north: Floats, east: Floats, places: NDArray[np.intp], found: Floats) -> None:
        """Set the depths at some of the offsets, next to which all soundings are `near`."""
        if not near.size:
            found[places] = self._elsewhere
            return
        n, e, depth = near[..., np.newaxis]
        count = max(2, CHUNK // near.shape[1])
        for start in range(0, len(places), count):
            own = places[start : start + count]
            own = own.repeat(2) if len(own) == 1 else own  # a single column would be summed in another order
            square = n - north[own]
            square *= square
            across = e - east[own]
            across *= across
            square += across
            at = square < 1e-6
            on_any = bool(at.any())
            weight = np.sqrt(np.where(at, 1.0, square) if on_any else square)
            np.divide(1.0, weight, out=weight)
            weight -= 1.0 / self._radius
            weight *= weight
            weight *= square < self._radius * self._radius
            weights = np.add.reduce(weight, axis=0)  # row by row, in the order of `depth`
            weight *= depth
            total = np.add.reduce(weight, axis=0)
            in_range = weights > 0.0
            if in_range.all():
                result = np.divide(total, weights, out=total)
            else:
                result = np.full(len(own), self._elsewhere)
                np.divide(total, weights, out=result, where=in_range)
            if on_any:
                for column in np.flatnonzero(at.any(axis=0)).tolist():
                    result[column] = depth[at[:, column].argmax(), 0]
            found[own] = result

    def _within_reach(self, part: tuple[int, int]) -> list[Sounding]:
        """The soundings that may be within the radius of a point in a part of a cell."""
        side, reach = self._radius / PARTS, 1.001 * self._radius  # rounding must not lose one
        north, east = (index * side for index in part)
        return [
            (n, e, depth)
            for n, e, depth in self._in_cells_around((part[0] // PARTS, part[1] // PARTS))
            if math.hypot(n - min(max(n, north), north + side), e - min(max(e, east), east + side)) < reach
        ]

    def is_clear(self, north: float, east: float, keel: float) -> bool:
        """Whether no bottom around an offset (m) from the reference position reaches up to the depth `keel` (m)."""
        return keel < self.shallowest_near(north, east)

    def shallowest_near(self, north: float, east: float) -> float:
        """A depth (m) that is nowhere less around an offset (m) from the reference position."""
        cell = math.floor(north / self._radius), math.floor(east / self._radius)
        found = self._shallowest.get(cell)
        if found is None:
            found = min((depth for *_, depth in self._in_cells_around(cell)), default=self._elsewhere)
            found = _remember(self._shallowest, cell, min(self._elsewhere, found))
        return found

    def is_known(self, north: float, east: float) -> bool:
        """Whether a sounding is within the radius of an offset (m) from the reference."""
        side = self._radius / PARTS
        near = self._within_reach((math.floor(north / side), math.floor(east / side)))
        return any(math.hypot(n - north, e - east) < self._radius for n, e, _ in near)

    def _in_cells_around(self, cell: tuple[int, int]) -> list[Sounding]:
        """The soundings in a cell, whose sides are as long as the radius, and in those around it, in their order."""
        found = self._cells.get(cell) if self.has_soundings else []
        if found is None:
            keys = _cell_keys(*(np.array(cell, dtype=np.float64)[:, np.newaxis] + NINE_CELLS))
            first, last = (np.searchsorted(self._keys, keys, side).tolist() for side in ("left", "right"))
            places = np.sort(np.concatenate([self._order[i:j] for i, j in zip(first, last, strict=True)]))
            found = _remember(self._cells, cell, [(n, e, depth) for n, e, depth in self._rows[places].tolist()])
        return found


def _cell_keys(north: NDArray[Any], east: NDArray[Any]) -> NDArray[np.int64]:
    """One number for each cell (n,); those beyond 2³¹ cells, where no vehicle comes, share theirs."""
    rows, columns = (np.clip(places, -FARTHEST_CELL, FARTHEST_CELL).astype(np.int64) for places in (north, east))
    return (rows << 32) + columns


def _remember(kept: dict[tuple[int, int], T], place: tuple[int, int], found: T) -> T:
    if len(kept) >= REMEMBERED:
        kept.clear()
    kept[place] = found
    return found


def _grouped(places: Floats) -> tuple[NDArray[np.intp], list[int]]:
    """The order of whole places (2, n) that puts equal ones together, and where in it they begin, and end."""
    order = np.lexsort((places[1], places[0]))
    rows, columns = places[:, order]
    ends = (np.flatnonzero((rows[1:] != rows[:-1]) | (columns[1:] != columns[:-1])) + 1).tolist()
    return order, [0, *ends, len(order)] if len(order) else []


def read_bathymetry(
    value: Callable[[str, str], str],
    radius: float,
    elsewhere: float,
    level: float = 0.0,
    origin: tuple[float, float] | None = None,
    offset: OffsetFunction | None = None,
) -> Bathymetry:
    """Read the section [Bathymetry], in DUNE's form; `value(section, option)` returns its texts.

    Without soundings the bottom is flat. The reference is that of the section, or `origin` (rad), if that is given:
    `offset` then returns north and east (m) from one latitude and longitude to another. Raises BathymetryError.
    """
    rows = [row.split() for row in value("Bathymetry", "Data").split(",") if row.strip()]
    if not rows:
        return Bathymetry((), radius, elsewhere, origin or (0.0, 0.0), level)
    reference = read_bathymetry_reference(value)
    if reference is None:
        raise BathymetryError("Latitude (degrees) and Longitude (degrees) are needed")
    soundings = [_sounding(row) for row in rows]
    if origin is not None and origin != reference and offset is not None:
        north, east = offset(*origin, *reference)
        soundings = [(n + north, e + east, depth) for n, e, depth in soundings]
        reference = origin
    return Bathymetry(soundings, radius, elsewhere, reference, level)


def read_bathymetry_reference(value: Callable[[str, str], str]) -> tuple[float, float] | None:
    """Latitude and longitude (rad) of the section [Bathymetry]; None without them. Raises BathymetryError."""
    texts = [value("Bathymetry", f"{name} (degrees)") for name in ("Latitude", "Longitude")]
    if not any(texts):
        return None
    try:
        lat, lon = map(float, texts)
    except ValueError:
        raise BathymetryError("Latitude (degrees) and Longitude (degrees) are needed") from None
    if not is_on_earth(math.radians(lat), math.radians(lon)):
        names = "Latitude (degrees) and Longitude (degrees)"
        raise BathymetryError(f"{names}: {lat:g}, {lon:g} is not a latitude and a longitude")
    return math.radians(lat), math.radians(lon)


def _sounding(row: list[str]) -> Sounding:
    try:
        north, east, depth = map(float, row)
    except ValueError:
        north = math.nan
        east = depth = 0.0
    if not math.isfinite(north + east + depth):
        raise BathymetryError(f"Data has a row that is no sounding: {' '.join(row)!r} is not north, east and depth")
    return north, east, depth
