"""`shoal campaign report`: draws a campaign as one HTML page."""

from pathlib import Path

import click

from shoal.campaigns import campaign_html, open_results
from shoal.cli.campaign.campaign_errors import FILE, FOLDER, errors_as_messages
from shoal.cli.campaign.progress_text import progress_line, uncounted_runs_text
from support.atomic_files import write_output
from support.terminal_text import printable


@click.command()
@click.argument("folder", type=FOLDER)
@click.argument("out", type=FILE, required=False)
def report(folder: Path, out: Path | None) -> None:
    """Draw the campaign in FOLDER as one HTML page, which needs no network [default: FOLDER/report.html]."""
    with errors_as_messages():
        data = open_results(folder)
        place = out or folder / "report.html"
        text = campaign_html(data, place.parent)
        write_output(place, text.encode())
    click.echo(f"{printable(str(place))}: {progress_line(data)}")
    for words in filter(None, (data.progress_text, uncounted_runs_text(data))):
        click.echo(words)
