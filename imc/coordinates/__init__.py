"""Positions in messages, and patterns of parallel rows."""

from imc.coordinates.local_origin import NOWHERE, LocalOrigin, absolute_position
from imc.coordinates.row_pattern import maneuver_corners, row_corners, sonar_row_spacing, swath_width

__all__ = [
    "NOWHERE",
    "LocalOrigin",
    "absolute_position",
    "maneuver_corners",
    "row_corners",
    "sonar_row_spacing",
    "swath_width",
]
