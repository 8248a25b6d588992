"""Plans: their database, the engine that executes them, and the checks before a start."""

from tasks.plan.conditions import parse_condition
from tasks.plan.logic import COMPARISONS, NUMBER, SIGN, Logic, Meaning, truth

__all__ = ["COMPARISONS", "NUMBER", "SIGN", "Logic", "Meaning", "parse_condition", "truth"]
