"""Plans as YAML or JSON text: read with the line of each mistake, written without loss."""

from autonomy.plans.yaml.reader import PlanFileError, maneuver_lines, parse_plan, plan_from_node
from autonomy.plans.yaml.value_codec import (
    parse_in_unit,
    parse_position,
    parse_quantity,
    read_field,
    split_quantity,
)
from autonomy.plans.yaml.writer import plan_text

__all__ = [
    "PlanFileError",
    "maneuver_lines",
    "parse_in_unit",
    "parse_plan",
    "parse_position",
    "parse_quantity",
    "plan_from_node",
    "plan_text",
    "read_field",
    "split_quantity",
]
