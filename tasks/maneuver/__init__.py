"""Maneuvers: the steps of a plan, one task each."""

from tasks.maneuver.maneuver_task import Completed, Leg, Maneuver, ManeuverError

__all__ = ["Completed", "Leg", "Maneuver", "ManeuverError"]
