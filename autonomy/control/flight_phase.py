"""Phases of a multirotor's flight."""

from enum import Enum


class FlightPhase(Enum):
    """Phase of the flight; the value is the mode in AutopilotMode."""

    GROUND = "GROUND"
    FOLLOW = "GUIDED"
    HOVER = "LOITER"
    LAND = "LAND"
    BLIND = "BLIND"
