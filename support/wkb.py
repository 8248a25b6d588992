"""Reads well-known binary (OGC 06-103r4), the form in which GDAL gives geometries, into those of GeoJSON (RFC 7946)."""

import struct
from collections.abc import Callable
from typing import Any

NAMES = {1: "Point", 2: "LineString", 3: "Polygon", 4: "MultiPoint", 5: "MultiLineString", 6: "MultiPolygon"}
COLLECTION = 7
HAS_Z, HAS_M, HAS_SRID = 0x80000000, 0x40000000, 0x20000000  # of the older, extended form
DEEPEST = 8  # collections in collections

Geometry = dict[str, Any]


def geometries(data: bytes) -> list[Geometry]:
    """The geometries in some bytes, collections as their parts, M left out. Raises ValueError."""
    try:
        found, end = _Reader(data).read(0)
    except (struct.error, RecursionError):
        raise ValueError("a geometry is truncated") from None
    if end != len(data):
        raise ValueError("a geometry is followed by other bytes")
    return found


class _Reader:
    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0
        self._order = "<"

    def read(self, depth: int) -> tuple[list[Geometry], int]:
        if depth > DEEPEST:
            raise ValueError("collections are nested too deep")
        self._order = "<" if self._number("B") else ">"
        code = self._number("I")
        if code & HAS_SRID:
            self._number("I")
        flags, code = code & (HAS_Z | HAS_M), code & 0xFFFF
        thousands, kind = divmod(code, 1000)
        axes = 2 + bool(flags & HAS_Z or thousands in (1, 3)) + bool(flags & HAS_M or thousands in (2, 3))
        keep = 3 if flags & HAS_Z or thousands in (1, 3) else 2
        return self._geometries(kind, axes, keep, depth), self._at

    def _geometries(self, kind: int, axes: int, keep: int, depth: int) -> list[Geometry]:
        def place() -> list[float]:
            return list(self._numbers(axes))[:keep]

        def line() -> list[list[float]]:
            return self._list(place, 8 * axes)

        match kind:
            case 1:
                found: Any = place()
            case 2:
                found = line()
            case 3:
                found = self._list(line, 4)
            case 4 | 5 | 6 | 7:
                parts = [part for each in self._list(lambda: self.read(depth + 1)[0], 5) for part in each]
                if kind == COLLECTION:
                    return parts
                found = [part["coordinates"] for part in parts]
            case _:
                raise ValueError(f"geometries of type {kind} are not read")
        return [{"type": NAMES[kind], "coordinates": found}]

    def _list(self, read: Callable[[], Any], least: int) -> list[Any]:
        """Read as many items as are announced, each of at least some bytes."""
        count = self._number("I")
        if count * least > len(self._data) - self._at:
            raise ValueError("a geometry announces more places than it has")
        return [read() for _ in range(count)]

    def _number(self, form: str) -> int:
        found: int = struct.unpack_from(self._order + form, self._data, self._at)[0]
        self._at += struct.calcsize("=" + form)
        return found

    def _numbers(self, count: int) -> tuple[float, ...]:
        found: tuple[float, ...] = struct.unpack_from(f"{self._order}{count}d", self._data, self._at)
        self._at += 8 * count
        return found
