"""Positions in messages, and patterns of parallel rows."""

from imc.coordinates.local_origin import NOWHERE, StartPoint, absolute
from imc.coordinates.row_pattern import rows, rows_of, spacing, swath

__all__ = [
    "NOWHERE",
    "StartPoint",
    "absolute",
    "rows",
    "rows_of",
    "spacing",
    "swath",
]
