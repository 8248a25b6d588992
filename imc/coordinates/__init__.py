"""Positions on the WGS-84 ellipsoid, offsets between them (in `arrays` also for NumPy), and patterns of rows."""

from imc.coordinates.patterns import rows, rows_of, spacing, swath
from imc.coordinates.start import NOWHERE, StartPoint
from imc.coordinates.wgs84 import FLATTENING, SEMI_MAJOR_AXIS, absolute, displace, displacement, offset

__all__ = [
    "FLATTENING",
    "NOWHERE",
    "SEMI_MAJOR_AXIS",
    "StartPoint",
    "absolute",
    "displace",
    "displacement",
    "offset",
    "rows",
    "rows_of",
    "spacing",
    "swath",
]
