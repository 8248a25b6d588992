"""`shoal log diff`: shows where two logs differ."""

import sys
from pathlib import Path
from typing import Any

import click

from shoal.cli.console_tables import open_console, plain_table
from shoal.cli.json_output import json_option, print_json
from shoal.cli.log.log_input import (
    LOG,
    errors_as_messages,
    open_log,
    progress_bar,
    require_messages,
    run_selection_options,
)
from shoal.logs.inspect import (
    FieldDifference,
    LogDifference,
    LogMessage,
    compare_logs,
    differing_fields,
    format_noun_count,
    format_time,
)
from support.terminal_text import printable
from support.text_length import clip

MOST_FIELDS = 30
LONGEST = 60  # characters of a value


@click.command()
@click.argument("a", type=LOG)
@click.argument("b", type=LOG)
@run_selection_options("a", "b")
@json_option
def diff(a: Path, b: Path, as_json: bool) -> None:
    """Show where logs A and B first differ, and what differs. Exit status 0: equal, 1: different, 2: trouble."""
    try:
        with errors_as_messages():
            logs = open_log(a), open_log(b)
            with progress_bar(logs[0].path) as advance:
                found = compare_logs(*logs, advance)
            for log, count, losses in zip(logs, found.packets, found.losses, strict=True):
                require_messages(log, count or not losses, losses)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    for log, losses in zip(logs, found.losses, strict=True):
        if losses:
            click.echo(printable(f"{log.path}: {format_noun_count(len(losses), 'damaged place')} skipped"), err=True)
    if as_json:
        print_json(_as_plain(found, a, b))
        sys.exit(0 if found.equal else 1)
    if found.equal:
        click.echo(f"equal: {format_noun_count(found.packets[0], 'message')}, byte for byte")
        return
    console = open_console(markup=False)
    for name, path, count in zip("AB", (a, b), found.packets, strict=True):
        console.print(printable(f"{name}: {path}: {format_noun_count(count, 'message')}"), soft_wrap=True)
    console.print()
    for line in _first(found):
        console.print(printable(line), soft_wrap=True)
    if found.reordered:
        console.print("Both have the same messages in a different order.")
    else:
        _show_types(found)
        _show_fields(found)
    sys.exit(1)


def _as_plain(found: LogDifference, a: Path, b: Path) -> dict[str, object]:
    def place(at: LogMessage) -> dict[str, object] | None:
        if at.message is None:
            return None
        kind, time = type(at.message).__name__, at.message.timestamp
        return {"number": at.number, "offset": at.offset, "message": kind, "time": time}

    return {
        "equal": found.equal,
        "logs": [str(a), str(b)],
        "messages": found.packets,
        "damaged_places": [len(losses) for losses in found.losses],
        "first": [place(at) for at in found.first] if found.first is not None else None,
        "reordered": found.reordered,
        "types": {
            name: {"equal": row.same, "changed": row.changed, "only_a": row.only_a, "only_b": row.only_b}
            for name, row in found.types.items()
        },
        "fields": [
            {"message": name, "field": field, "differs": row.count, "mean": row.mean, "greatest": row.greatest}
            for (name, field), row in found.fields.items()
        ],
    }


def _first(found: LogDifference) -> list[str]:
    assert found.first is not None
    one, two = found.first
    if one.message is None or two.message is None:
        longer, place, ended = ("B", two, "A") if one.message is None else ("A", one, "B")
        more = format_noun_count(abs(found.packets[0] - found.packets[1]), "more message")
        begin = f"{ended} ends after message {one.number - 1}; up to there they are equal. {longer} has {more}"
        return [f"{begin}, the first is {_what(place, found)}"]
    until = "; up to there they are equal" if one.number > 1 else ""
    lines = [f"They first differ at message {one.number}, {format_time(one.message.timestamp)}{until}."]
    same = type(one.message) is type(two.message) or type(one.message).__name__ == type(two.message).__name__
    if same and one.message.src == two.message.src and one.message.src_ent == two.message.src_ent:
        lines.append(f"Both have {_what(one, found)}, but:")
        rows = differing_fields(one.message, two.message)
        lines += [f"  {name}: {_value(before)} in A, {_value(after)} in B" for name, before, after in rows]
        return lines if rows else [*lines, "  only its bytes differ, not its fields"]
    return [*lines, f"A has {_what(one, found)}", f"B has {_what(two, found)}"]


def _what(place: LogMessage, found: LogDifference) -> str:
    message = place.message
    assert message is not None
    who = f"{found.names.entity_label(message.src, message.src_ent)} of {found.names.system_name(message.src)}"
    return f"{type(message).__name__} of {who}, byte {place.offset}"


def _value(value: Any) -> str:
    return clip(repr(value), LONGEST)


def _show_types(found: LogDifference) -> None:
    columns = ("equal", "changed", "only in A", "only in B")
    table = plain_table("message", *columns, right=columns)
    different = {name: row for name, row in found.types.items() if row.changed or row.only_a or row.only_b}
    for name, row in sorted(different.items(), key=lambda item: -item[1].changed - item[1].only_a - item[1].only_b):
        table.add_row(name, *(str(count or "") for count in (row.same, row.changed, row.only_a, row.only_b)))
    console = open_console(markup=False)
    console.print()
    console.print(table)
    same = sum(row.same for name, row in found.types.items() if name not in different)
    if len(different) < len(found.types):
        types = format_noun_count(len(found.types) - len(different), "other type")
        console.print(f"{types} with {format_noun_count(same, 'message')} are equal", style="dim")


def _show_fields(found: LogDifference) -> None:
    if not found.fields:
        return
    columns = ("differs", "mean", "greatest")
    table = plain_table("field", *columns, "at", right=columns)
    rows = sorted(found.fields.items(), key=lambda item: -item[1].count)
    for (name, attribute), row in rows[:MOST_FIELDS]:
        table.add_row(f"{name}.{attribute}", *map(printable, _figures(row)))
    console = open_console(markup=False)
    how = "type, sender and time" if found.by_time else "type, sender and order (the times differ)"
    some = f", the first {format_noun_count(found.compared, 'pair')}" if found.compared < found.pairs else ""
    console.print(f"\nFields that differ in messages of the same {how}{some}:")
    console.print(table)
    if len(rows) > MOST_FIELDS:
        console.print(f"and {format_noun_count(len(rows) - MOST_FIELDS, 'more field')}", style="dim")


def _figures(row: FieldDifference) -> tuple[str, str, str, str]:
    if not row.numeric:
        return str(row.count), "", "", ""
    return str(row.count), f"{row.mean:.4g}", f"{row.greatest:.4g}", format_time(row.at) if row.at == row.at else ""
