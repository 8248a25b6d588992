"""`shoal log doctor`: finds what is wrong with a log, and repairs it."""

import sys
from dataclasses import asdict
from pathlib import Path

import click
from rich.text import Text

from shoal.cli.console_tables import open_console
from shoal.cli.findings import print_findings, worst_first
from shoal.cli.json_output import json_option, print_json
from shoal.cli.log.log_input import LOG, errors_as_messages, make_parallel_map, progress_bar, run_selection_options
from shoal.logs.inspect import examine_log, format_duration, format_noun_count
from shoal.logs.inspect import repair_log as repair_log
from support.terminal_text import printable


@click.command()
@click.argument("log", type=LOG, required=False)
@run_selection_options("log")
@click.option("--repair", type=LOG, metavar="OUT", help="Write the good packets and definitions to a new folder.")
@json_option
def doctor(log: Path, repair: Path | None, as_json: bool) -> None:
    """Find what is wrong with LOG, and explain it. Exit status 1 if there are errors or warnings."""
    with errors_as_messages():
        with progress_bar(log) as advance:
            examination = examine_log(log, advance, make_parallel_map())
        console = open_console(markup=False)
        findings = worst_first(examination.findings)
        if as_json:
            found = [{key: value for key, value in asdict(each).items() if key != "about"} for each in findings]
            print_json({"log": log, "healthy": examination.healthy, "findings": found})
        else:
            print_findings(console, findings)
        if (summary := examination.summary) is not None:
            if examination.healthy and not as_json:
                console.print(Text("healthy: ", "green") + Text(_size(summary.packets, summary.duration)))
            if repair is not None:
                count = repair_log(examination, repair)
                click.echo(printable(f"repaired: {format_noun_count(count, 'message')}: {repair}"), err=as_json)
        elif repair is not None:
            raise click.ClickException("there is no message to save")
    sys.exit(0 if examination.healthy else 1)


def _size(packets: int, seconds: float) -> str:
    return f"{format_noun_count(packets, 'message')} in {format_duration(seconds)}, no damage"
