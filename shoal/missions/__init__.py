"""Missions: plan files, the flight of a plan, and its report."""

from autonomy.plans.yaml import PlanFileError, parse_plan, plan_text
from shoal.missions.mission import Mission
from shoal.missions.mission_context import announced_context, profile_context
from shoal.missions.plan_file_reader import MISSION_SUFFIXES, PLAN_SUFFIXES, load_plan, locate_reason
from shoal.missions.plan_file_writer import plan_file_text
from shoal.missions.report import COMPLETED, FAILED, LATE, ManeuverReport, Report
from shoal.missions.simulated_flight import AUTOSTART, fly, parse_modes_or_default, prepare
from shoal.missions.start_request import PlanStartRequest, find_start_request
from shoal.simulated_motion import fixed_wing_problem, motion_problem, motion_warning

__all__ = [
    "AUTOSTART",
    "COMPLETED",
    "FAILED",
    "LATE",
    "MISSION_SUFFIXES",
    "PLAN_SUFFIXES",
    "ManeuverReport",
    "Mission",
    "PlanFileError",
    "PlanStartRequest",
    "Report",
    "announced_context",
    "find_start_request",
    "fixed_wing_problem",
    "fly",
    "load_plan",
    "locate_reason",
    "motion_problem",
    "motion_warning",
    "parse_modes_or_default",
    "parse_plan",
    "plan_file_text",
    "plan_text",
    "prepare",
    "profile_context",
]
