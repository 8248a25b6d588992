"""`shoal log info`: shows what is in a log."""

from pathlib import Path

import click

from runtime.logs import LogSummary, PacketCount, read_log_run_position, summarize
from shoal.cli.console_tables import open_console, plain_table
from shoal.cli.json_output import json_option, print_json, summary_to_dict
from shoal.cli.log.log_input import (
    LOG,
    errors_as_messages,
    logs_of_argument,
    open_log,
    progress_bar,
    require_messages,
    run_selection_options,
)
from shoal.logs.inspect import (
    format_duration,
    format_noun_count,
    format_rate,
    format_size,
    format_time,
    read_chart_reference,
)
from support.terminal_text import printable

MOST_LINES = 20  # of damage


@click.command()
@click.argument("log", type=LOG, required=False)
@run_selection_options("log")
@click.option("--entities/--no-entities", default=True, help="Also list the entities.")
@json_option
def info(log: Path, entities: bool, as_json: bool) -> None:
    """Show what is in LOG, a folder or a Data.lsf: systems, times, messages, rates, damage."""
    with errors_as_messages():
        opened = open_log(log)
        with progress_bar(opened.path) as advance:
            summary = summarize(opened, advance)
        require_messages(opened, summary.packets, summary.losses)
    if as_json:
        logs = logs_of_argument(log)
        chart = read_chart_reference(logs[0])
        about = {"logs": [str(path) for path in logs], "chart": chart._asdict() if chart is not None else None}
        print_json(summary_to_dict(summary) | about)
        return
    console = open_console(markup=False)
    for title, text in _facts(summary, logs_of_argument(log)):
        console.print(f"{title:10}{printable(text)}", soft_wrap=True)
    console.print()
    table = plain_table("message", "count", "rate", "bytes", right=("count", "rate", "bytes"))
    for name, tally in summary.by_type.items():
        table.add_row(name, *_figures(tally))
    console.print(table)
    if entities:
        table = plain_table("entity", "id", "of", "count", "rate", "bytes", right=("id", "count", "rate", "bytes"))
        for (src, entity), tally in summary.by_entity.items():
            label, system = summary.names.entity_label(src, entity), summary.names.system_name(src)
            table.add_row(printable(label), str(entity), printable(system), *_figures(tally))
        console.print()
        console.print(table)


def _facts(summary: LogSummary, logs: list[Path]) -> list[tuple[str, str]]:
    others = [summary.names.system_name(src) for src in summary.clocks if src != summary.owner]
    senders = f", also messages from {', '.join(others)}" if others else ""
    packed = f", {format_size(summary.unpacked)} unpacked" if summary.path.suffix != ".lsf" else ""
    source = summary.schema_source or "built-in, none beside the log"
    if summary.schema_source and len(logs) > 1:  # that of all logs together is a temporary file
        source = str(logs[0] / Path(summary.schema_source).name)
    place = read_log_run_position(logs[0])
    if len(logs) > 1:
        facts = [("log", str(logs[0])), *(("", str(log)) for log in logs[1:])]
    else:
        facts = [("log", str(summary.path))]
        if place is not None:
            facts.append(("run", f"log {place.number} of the run that began with {place.first}; --run takes them all"))
    facts += [
        ("system", f"{summary.names.system_name(summary.owner)}{senders}"),
        ("from", format_time(summary.start)),
        ("to", f"{format_time(summary.end)} ({format_duration(summary.duration)})"),
        (
            "messages",
            f"{format_noun_count(summary.packets, 'message')} of {format_noun_count(len(summary.by_type), 'type')}",
        ),
        ("size", f"{format_size(summary.file_size)}{packed}"),
        ("schema", f"IMC {summary.schema.version}: {source}"),
    ]
    if (chart := read_chart_reference(logs[0])) is not None:
        use = "" if chart.is_found else ", for the report of detections, resim, rewind and render"
        facts.append(("chart", chart.describe() + use))
    for step in summary.clock_steps[:MOST_LINES]:
        leap = format_duration(step.after - step.before)
        text = (
            f"of {summary.names.system_name(step.src)} set by {leap} at {format_time(step.before)}, byte {step.offset}"
        )
        facts.append(("clock", text))
    if summary.losses:
        lost = sum(loss.length for loss in summary.losses)
        facts.append(("damage", f"{format_noun_count(len(summary.losses), 'place')}, {format_size(lost)}"))
        facts += [("", f"byte {at}: {format_size(length)}: {why}") for at, length, why in summary.losses[:MOST_LINES]]
        if len(summary.losses) > MOST_LINES:
            facts.append(("", f"and {len(summary.losses) - MOST_LINES} more"))
    else:
        facts.append(("damage", "none"))
    return facts


def _figures(tally: PacketCount) -> tuple[str, str, str]:
    return str(tally.count), format_rate(tally.rate), str(tally.size)
