"""A profile brought to life: the vehicle, fleets of them, and what checks and explains a profile."""

from runtime.vehicle.builder import Build, build, doubts, join_zenoh
from runtime.vehicle.effective_config import Settings, general_number
from runtime.vehicle.explainer import Row, explain
from runtime.vehicle.fleet import Fleet, FleetError
from runtime.vehicle.profile_lint import check
from runtime.vehicle.task_registry import (
    TaskImportError,
    all_tasks,
    find_task,
    missing_extra,
    own_tasks,
    search_code,
    section_name,
    why_missing,
)
from runtime.vehicle.vehicle import Vehicle

__all__ = [
    "Build",
    "Fleet",
    "FleetError",
    "Row",
    "Settings",
    "TaskImportError",
    "Vehicle",
    "all_tasks",
    "build",
    "check",
    "doubts",
    "explain",
    "find_task",
    "general_number",
    "join_zenoh",
    "missing_extra",
    "own_tasks",
    "search_code",
    "section_name",
    "why_missing",
]
