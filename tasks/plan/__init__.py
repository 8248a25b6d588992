"""Plans: their database, the engine that executes them, and the checks before a start."""

from tasks.plan.conditions import parse_condition
from tasks.plan.logic import NUMBER, SIGN, Logic

__all__ = ["NUMBER", "SIGN", "Logic", "parse_condition"]
