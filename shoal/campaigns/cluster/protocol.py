"""Orders, jobs and results as lines of JSON: nothing else passes between computers, but the contents of files."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from shoal.campaigns.jobs import Job, TimedResult, UnfinishedResult, UnreadableResult
from shoal.scenarios import ExpectationVerdict, ScenarioResult

_KINDS: dict[str, type[ScenarioResult]] = {
    kind.__name__: kind for kind in (ScenarioResult, TimedResult, UnfinishedResult, UnreadableResult)
}
JsonLine = dict[str, Any]


def encode_line(line: JsonLine) -> bytes:
    """A line of JSON, with its end. Numbers keep all their bits."""
    return json.dumps(line, separators=(",", ":"), default=_plain).encode() + b"\n"


def job_to_line(job: Job) -> JsonLine:
    """A job; of its folder for logs only whether it has one, since it is another one elsewhere."""
    line = {"key": job.key, "path": str(job.path), "values": job.values, "seed": job.seed}
    return {**line, "logs": job.log_root is not None}


def job_from_line(line: JsonLine) -> Job:
    """The job in a line, which has a folder for logs added."""
    logs = Path(line["log_root"]) if line["logs"] else None
    return Job(line["key"], Path(line["path"]), line["values"], line["seed"], logs)


def result_to_line(result: ScenarioResult, log_root: Path) -> JsonLine:
    """A result; its logs by their path below the folder for logs."""
    logs = {name: folder.absolute().relative_to(log_root).as_posix() for name, folder in result.logs.items()}
    return {"kind": type(result).__name__, **asdict(replace(result, logs={})), "logs": logs}


def result_from_line(line: JsonLine, log_root: Path | None) -> ScenarioResult:
    """The result in a line, with logs in this folder."""
    given = {key: value for key, value in line.items() if key != "kind"}
    given["verdicts"] = tuple(ExpectationVerdict(**verdict) for verdict in line["verdicts"])
    given["warnings"] = tuple(line["warnings"])
    given["logs"] = {name: log_root / path for name, path in line["logs"].items()} if log_root is not None else {}
    return _KINDS[line["kind"]](**given)


def _plain(value: Any) -> Any:
    """A number of NumPy as one of Python."""
    return value.item()
