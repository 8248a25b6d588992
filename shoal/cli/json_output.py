"""Output of `--json`: plain values under names that stay; see docs/logs.md and docs/command-line.md."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, cast

import click

if TYPE_CHECKING:
    from runtime.logs import LogSummary, PacketCount
    from runtime.task import Parameter
    from support.diagnostics import Problem

json_option: Final = click.option("--json", "as_json", is_flag=True, help="Print as JSON.")


def print_json(value: object) -> None:
    """Print as JSON; a number that is not finite becomes null, a byte that is not UTF-8 its escape."""
    click.echo(json_text(value))


def print_json_line(value: object) -> None:
    """Print as JSON on one line, as `print_json` does."""
    click.echo(json.dumps(_plain(value), ensure_ascii=True))


def json_text(value: object) -> str:
    """Text that print_json prints."""
    return json.dumps(_plain(value), indent=1, ensure_ascii=True)


def summary_to_dict(summary: "LogSummary") -> dict[str, object]:
    """A log summed up; times are s since 1970 UTC, rates Hz, sizes bytes."""
    names = summary.names
    return {
        "path": str(summary.path),
        "system": names.system_name(summary.owner),
        "system_id": summary.owner,
        "others": [names.system_name(src) for src in summary.clocks if src != summary.owner],
        "start": summary.start,
        "end": summary.end,
        "duration": summary.duration,
        "messages": summary.packets,
        "size": summary.file_size,
        "unpacked": summary.unpacked,
        "schema": summary.schema.version,
        "schema_file": str(summary.schema_source) if summary.schema_source else None,
        "types": {name: _count(tally) for name, tally in summary.by_type.items()},
        "entities": [
            {"label": names.entity_label(src, entity), "id": entity, "system": names.system_name(src), **_count(tally)}
            for (src, entity), tally in summary.by_entity.items()
        ],
        "clock_steps": [
            {"system": names.system_name(step.src), "before": step.before, "after": step.after, "offset": step.offset}
            for step in summary.clock_steps
        ],
        "damage": [{"offset": at, "length": length, "reason": why} for at, length, why in summary.losses],
    }


def problem_to_dict(problem: "Problem") -> dict[str, object]:
    """A problem of a profile; the line is null if it has none."""
    return {
        "severity": problem.severity,
        "file": problem.file,
        "line": problem.line or None,
        "text": problem.text,
        "hint": problem.hint,
    }


def parameter_to_dict(parameter: "Parameter") -> dict[str, object]:
    """A parameter of a task; the default is the text that an ini file would have."""
    return {
        "name": parameter.name,
        "default": parameter.format(parameter.default),
        "unit": parameter.unit,
        "minimum": parameter.minimum,
        "maximum": parameter.maximum,
        "choices": [str(choice) for choice in parameter.choices],
        "description": parameter.description,
    }


def _count(tally: "PacketCount") -> dict[str, object]:
    return {"count": tally.count, "rate": tally.rate, "size": tally.size}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in cast(Mapping[object, object], value).items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in cast(Sequence[object], value)]
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, (bool, int, str)) or value is None else str(value)
