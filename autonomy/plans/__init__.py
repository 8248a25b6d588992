"""Plans: conditions, graph, checks, estimates and templates; plan files are in `autonomy.plans.yaml`."""

from autonomy.plans.conditions import Condition, parse_condition
from autonomy.plans.duration_energy_forecast import (
    PlanForecast,
    feasibility_violations,
    forecast_plan,
    forecast_totals,
    format_tuple_list,
)
from autonomy.plans.estimate import LATENESS, LatLon, ManeuverEstimate, Powertrain, estimate_maneuver, waypoints
from autonomy.plans.graph import Actions, PlanError, PlanGraph, PlanNode, parse_graph
from autonomy.plans.limit_violations import PlanBounds, area_violations, flight_violations, is_airborne
from autonomy.plans.place_in_plan import remaining_plan_at
from autonomy.plans.plan_estimate import PlanEstimate, format_percent
from autonomy.plans.preflight import Preflight, PreflightOptionError
from autonomy.plans.sequence import FINISH, main_sequence, remaining_plan, sequential_plan, sequential_transitions
from autonomy.plans.templates import TEMPLATES, TemplateDefaults, TemplateError, plan_from_template
from autonomy.plans.value_ranges import value_range_violations

__all__ = [
    "FINISH",
    "LATENESS",
    "TEMPLATES",
    "Actions",
    "Condition",
    "LatLon",
    "ManeuverEstimate",
    "PlanBounds",
    "PlanError",
    "PlanEstimate",
    "PlanForecast",
    "PlanGraph",
    "PlanNode",
    "Powertrain",
    "Preflight",
    "PreflightOptionError",
    "TemplateDefaults",
    "TemplateError",
    "area_violations",
    "estimate_maneuver",
    "feasibility_violations",
    "flight_violations",
    "forecast_plan",
    "forecast_totals",
    "format_percent",
    "format_tuple_list",
    "is_airborne",
    "main_sequence",
    "parse_condition",
    "parse_graph",
    "plan_from_template",
    "remaining_plan",
    "remaining_plan_at",
    "sequential_plan",
    "sequential_transitions",
    "value_range_violations",
    "waypoints",
]
