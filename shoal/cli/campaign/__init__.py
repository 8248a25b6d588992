"""`shoal campaign`: runs a study, repeats one of its runs, reports and compares."""

from pathlib import Path
from typing import Any, ClassVar

import click

from shoal.cli import LazyGroup

COMMANDS = {
    "run": ("shoal.cli.campaign.run", "Run a study (the default command)."),
    "rerun": ("shoal.cli.campaign.rerun", "Repeat one run of a campaign, with the same or with other values."),
    "merge": ("shoal.cli.campaign.merge", "Merge the data sets of several computers."),
    "report": ("shoal.cli.campaign.report", "Draw a campaign as one HTML page."),
    "compare": ("shoal.cli.campaign.compare", "Show what a change made better and worse, run by run."),
}


class CampaignGroup(LazyGroup):
    """The commands of `shoal campaign`; without one of them it is `run`."""

    table: ClassVar[dict[str, tuple[str, str]]] = COMMANDS

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[Any, Any, list[str]]:
        first = args[0] if args else ""
        if first not in self.table and (first.startswith("-") or "." in first or Path(first).exists()):
            args = ["run", *args]
        return super().resolve_command(ctx, args)


@click.group(cls=CampaignGroup, context_settings={"ignore_unknown_options": True}, subcommand_metavar="STUDY | COMMAND")
def campaign() -> None:
    """Run a scenario many times with varying values, and report the results.

    shoal campaign drift.study.yaml runs a study, and resumes one that was interrupted.
    """
