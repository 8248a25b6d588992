"""Positions in messages, and patterns of parallel rows."""

from imc.coordinates.local_origin import NOWHERE, LocalOrigin, absolute_position
from imc.coordinates.row_pattern import altitude_row_spacing, maneuver_corner_offsets, row_corners, sonar_row_spacing

__all__ = [
    "NOWHERE",
    "LocalOrigin",
    "absolute_position",
    "altitude_row_spacing",
    "maneuver_corner_offsets",
    "row_corners",
    "sonar_row_spacing",
]
