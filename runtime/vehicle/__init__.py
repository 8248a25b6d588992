"""A profile brought to life: the vehicle, fleets of them, and what checks and explains a profile."""

from runtime.vehicle.builder import Build, build, config_warnings, join_zenoh, missing_extra_problem
from runtime.vehicle.effective_config import ProfileValues, general_number
from runtime.vehicle.fleet import Fleet, FleetError
from runtime.vehicle.option_explainer import OptionRow, explain_section
from runtime.vehicle.profile_lint import check_profile
from runtime.vehicle.task_registry import (
    TaskImportError,
    add_task_folder,
    all_tasks,
    find_task,
    missing_extra,
    missing_task_reason,
    section_name,
    task_modules,
)
from runtime.vehicle.vehicle import Vehicle

__all__ = [
    "Build",
    "Fleet",
    "FleetError",
    "OptionRow",
    "ProfileValues",
    "TaskImportError",
    "Vehicle",
    "add_task_folder",
    "all_tasks",
    "build",
    "check_profile",
    "config_warnings",
    "explain_section",
    "find_task",
    "general_number",
    "join_zenoh",
    "missing_extra",
    "missing_extra_problem",
    "missing_task_reason",
    "section_name",
    "task_modules",
]
