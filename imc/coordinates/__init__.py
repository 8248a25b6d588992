"""Positions on the WGS-84 ellipsoid, offsets between them, and patterns of rows; `arrays` has the first for NumPy."""

from imc.coordinates.patterns import rows, rows_of, swath
from imc.coordinates.wgs84 import FLATTENING, SEMI_MAJOR_AXIS, absolute, displace, displacement

__all__ = ["FLATTENING", "SEMI_MAJOR_AXIS", "absolute", "displace", "displacement", "rows", "rows_of", "swath"]
