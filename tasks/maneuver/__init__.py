"""Maneuvers: the steps of a plan, one task each."""

from tasks.maneuver.maneuver_task import Completed, Maneuver, ManeuverError, PathEnd

__all__ = ["Completed", "Maneuver", "ManeuverError", "PathEnd"]
