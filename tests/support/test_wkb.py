"""Geometries of well-known binary become those of GeoJSON, or an error."""

import struct

import pytest

from support.wkb import geometries

POINT = struct.pack("<BIdd", 1, 1, -8.7, 41.2)
POINT_Z = struct.pack(">BIddd", 0, 1001, -8.7, 41.2, 3.5)
POINT_M = struct.pack("<BIddd", 1, 2001, -8.7, 41.2, 9.0)
EXTENDED = struct.pack("<BIIddd", 1, 0xA0000001, 4326, -8.7, 41.2, 3.5)
LINE = struct.pack("<BII4d", 1, 2, 2, 0.0, 1.0, 2.0, 3.0)
RING = struct.pack("<BIII8d", 1, 3, 1, 4, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0)


def nested(kind: int, *parts: bytes) -> bytes:
    return struct.pack("<BII", 1, kind, len(parts)) + b"".join(parts)


@pytest.mark.parametrize(
    ("data", "kind", "coordinates"),
    [
        (POINT, "Point", [-8.7, 41.2]),
        (POINT_Z, "Point", [-8.7, 41.2, 3.5]),
        (POINT_M, "Point", [-8.7, 41.2]),
        (EXTENDED, "Point", [-8.7, 41.2, 3.5]),
        (LINE, "LineString", [[0.0, 1.0], [2.0, 3.0]]),
        (RING, "Polygon", [[[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]]),
        (nested(4, POINT, POINT_Z), "MultiPoint", [[-8.7, 41.2], [-8.7, 41.2, 3.5]]),
        (nested(5, LINE), "MultiLineString", [[[0.0, 1.0], [2.0, 3.0]]]),
    ],
)
def test_each_form_is_read(data, kind, coordinates):
    assert geometries(data) == [{"type": kind, "coordinates": coordinates}]


def test_a_collection_is_its_parts():
    assert [found["type"] for found in geometries(nested(7, POINT, nested(7, LINE)))] == ["Point", "LineString"]


def too_deep() -> bytes:
    data = POINT
    for _ in range(20):
        data = nested(7, data)
    return data


@pytest.mark.parametrize(
    "data", [b"", POINT[:-1], POINT + b"x", struct.pack("<BII", 1, 2, 2**31), struct.pack("<BI", 1, 99), too_deep()]
)
def test_what_is_no_geometry_is_an_error(data):
    with pytest.raises(ValueError, match=r"geometr|collections"):
        geometries(data)
