"""Positions in messages, and patterns of parallel rows."""

from imc.coordinates.limits_area import area_contains, area_corners
from imc.coordinates.row_pattern import altitude_row_spacing, maneuver_corner_offsets, row_corners, sonar_row_spacing
from imc.coordinates.state_reference import NOWHERE, LocalOrigin, absolute_position

__all__ = [
    "NOWHERE",
    "LocalOrigin",
    "absolute_position",
    "altitude_row_spacing",
    "area_contains",
    "area_corners",
    "maneuver_corner_offsets",
    "row_corners",
    "sonar_row_spacing",
]
