"""Rows of a data set: one run each, flat, with numbers and texts only."""

import base64
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shoal.campaigns.jobs.job import UnfinishedResult
from shoal.campaigns.sampling import Scalar
from shoal.scenarios import ScenarioResult

ResultRow = dict[str, Any]
"""A run: `run`, `seed`, `passed`, `margin` ..., and columns of groups such as `metrics.drift`."""

FIXED_COLUMNS = (
    *("run", "seed", "finished", "passed", "margin", "error", "reason", "warnings", "seconds", "cpu"),
    *("versions", "fingerprint"),
)
_STEPS = (1e7, 1e7, 1e2)
_MOST = 2.0**31 - 1.0
COLUMN_GROUPS = ("values", "metrics", "margins", "verdicts", "applied", "outcomes", "hashes", "logs", "tracks")


def make_row(
    run: int,
    seed: int,
    values: Mapping[str, Scalar],
    result: ScenarioResult,
    *,
    versions: str,
    cpu: float,
    folder: Path,
) -> ResultRow:
    """The row of a run. `values` are those drawn, as numbers; paths of logs are relative to `folder`."""
    failed = min((v for v in result.verdicts if not v.passed), key=lambda verdict: verdict.margin, default=None)
    row: ResultRow = {
        "run": run,
        "seed": seed,
        "finished": not isinstance(result, UnfinishedResult),
        "passed": result.passed,
        "margin": float(result.margin) if result.verdicts else math.nan,
        "error": result.error,
        "reason": f"{failed.name}: {failed.reason}" if failed else "",
        "warnings": "\n".join(result.warnings),
        "seconds": float(result.seconds),
        "cpu": cpu,
        "versions": versions,
        "fingerprint": result.fingerprint,
    }
    row |= {f"values.{name}": value for name, value in values.items()}
    row |= {f"metrics.{name}": float(value) for name, value in result.metrics.items()}
    row |= {f"margins.{verdict.name}": float(verdict.margin) for verdict in result.verdicts}
    row |= {f"verdicts.{verdict.name}": verdict.passed for verdict in result.verdicts}
    row |= {f"applied.{verdict.name}": verdict.applied for verdict in result.verdicts}
    row |= {f"outcomes.{vehicle}": outcome for vehicle, outcome in result.outcomes.items()}
    row |= {f"hashes.{vehicle}": digest for vehicle, digest in result.hashes.items()}
    row |= {f"tracks.{vehicle}": pack_track(track) for vehicle, track in result.tracks.items()}
    whole = folder.absolute()
    for vehicle, log in result.logs.items():
        row[f"logs.{vehicle}"] = (log.relative_to(whole) if log.is_relative_to(whole) else log).as_posix()
    return row


def is_finished(row: ResultRow) -> bool:
    """Whether the run came to an end: neither its limit of wall time nor the death of its process cut it short."""
    return row.get("finished", True)


def pack_track(track: Sequence[float]) -> str:
    """A track as one text, which is read ten times faster than numbers: latitude, longitude (1e-7 °), depth (cm)."""
    places = np.asarray(track, float).reshape(-1, 3) * _STEPS
    return base64.b64encode(np.rint(np.clip(places, -_MOST, _MOST)).astype("<i4").tobytes()).decode()


def unpack_track(text: str) -> Any:
    """The places in a packed track, shape (n, 3): latitude, longitude (°), depth (m)."""
    return np.frombuffer(base64.b64decode(text), "<i4").reshape(-1, 3) / _STEPS


def column_names(rows: Iterable[ResultRow]) -> list[str]:
    """All columns of rows, in an order that does not depend on that of the rows."""
    found = {name for row in rows for name in row}
    groups = {group: place for place, group in enumerate(COLUMN_GROUPS)}
    rest = sorted(
        found.difference(FIXED_COLUMNS), key=lambda name: (groups.get(name.partition(".")[0], len(groups)), name)
    )
    return [*FIXED_COLUMNS, *rest]
