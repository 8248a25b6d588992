"""Outcome of a run, in words."""

import os
from dataclasses import asdict
from pathlib import Path

from runtime.logs import logs_of_run
from shoal.campaigns.scenario_suite import ScenarioOutcome
from shoal.scenarios import ScenarioResult


def failure_lines(result: ScenarioResult) -> list[str]:
    """A line for each reason for which a run has not passed."""
    failed = [f"{verdict.name}: {verdict.reason}" for verdict in result.verdicts if not verdict.passed]
    return result.error.splitlines()[:1] + failed


def failure_details(result: ScenarioResult) -> list[str]:
    """The same, after the line of the file that it is about; and where an error was, as far as that is known."""
    failed = [
        f"{verdict.origin}: {verdict.name}: {verdict.reason}" for verdict in result.verdicts if not verdict.passed
    ]
    return result.error.splitlines() + failed


def warning_lines(outcome: ScenarioOutcome) -> list[str]:
    """Reasons for which a result is worth less than it seems."""
    lines = list(outcome.result.warnings)
    if not outcome.is_reproducible:
        lines.append("the run for the log went otherwise: something in it depends on more than file and seed")
    return lines


def other_consecutive_logs(folder: Path) -> list[Path]:
    """The other logs of the run that a log is of, in order: a vehicle begins a new one with a plan, and after it."""
    try:
        logs = logs_of_run(folder)
    except (OSError, ValueError):
        return []
    others = [log for log in logs if log != folder.absolute()]
    return others if folder.is_absolute() else [Path(os.path.relpath(log)) for log in others]


def outcome_to_dict(outcome: ScenarioOutcome) -> dict[str, object]:
    """All that is known of a run, by names that stay; see docs/command-line.md."""
    result = outcome.result
    return {
        "file": str(outcome.job.path),
        "variant": outcome.job.variant,
        "scenario": result.scenario,
        "seed": None if outcome.is_unreadable else result.seed,
        "passed": result.passed,
        "readable": not outcome.is_unreadable,
        "error": result.error,
        "margin": result.margin,
        "seconds": result.seconds,
        "wall": outcome.wall_time,
        "repeated": None if outcome.is_unreadable else outcome.is_reproducible,
        "verdicts": [asdict(verdict) for verdict in result.verdicts],
        "metrics": result.metrics,
        "outcomes": result.outcomes,
        "warnings": warning_lines(outcome),
        "logs": result.logs,
        "hashes": result.hashes,
        "fingerprint": result.fingerprint,
    }
