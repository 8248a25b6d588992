"""Plans: their database, the engine that executes them, and the checks before a start."""

from tasks.plan.conditions import parse_condition

__all__ = ["parse_condition"]
