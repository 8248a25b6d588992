"""Missions: plan files, the flight of a plan, and its report."""

from shoal.missions.files import load_plan, parse_plan, plan_text, read_plan
from shoal.missions.mission import Mission
from shoal.missions.reader import PlanFileError
from shoal.missions.report import COMPLETED, FAILED, LATE, ManeuverReport, Report
from shoal.missions.simulated_flight import AUTOSTART, fly, prepare, usual_modes
from shoal.missions.start_request import PlanStartRequest, find_start_request
from shoal.missions.values import UNITS, in_unit, position, quantity, read_field, split

__all__ = [
    "AUTOSTART",
    "COMPLETED",
    "FAILED",
    "LATE",
    "UNITS",
    "ManeuverReport",
    "Mission",
    "PlanFileError",
    "PlanStartRequest",
    "Report",
    "find_start_request",
    "fly",
    "in_unit",
    "load_plan",
    "parse_plan",
    "plan_text",
    "position",
    "prepare",
    "quantity",
    "read_field",
    "read_plan",
    "split",
    "usual_modes",
]
