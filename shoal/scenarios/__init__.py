"""Scenarios: what happens to vehicles in one run, and what is expected of them."""

from shoal.scenarios.result import Result, Verdict

__all__ = ["Result", "Verdict"]
