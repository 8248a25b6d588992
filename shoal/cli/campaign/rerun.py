"""`shoal campaign rerun`: does one run of a campaign again, and compares."""

import sys
from pathlib import Path

import click

from shoal.campaigns import RepeatedRun, StudyRunner, open_results, repeat_run
from shoal.cli.campaign.campaign_errors import FILE, FOLDER, errors_as_messages, last_line
from shoal.cli.options import add_user_task_folders, check_log_folder, code_option, parse_values, values_option
from support.terminal_text import printable


@click.command()
@click.argument("folder", type=FOLDER)
@click.option("--run", "number", type=click.IntRange(0), required=True, help="Its number.")
@click.option("--log-dir", type=FOLDER, help="Keep its log in this folder.")
@click.option("--study", type=FILE, help="The study's file, if it is not where it was.")
@values_option
@code_option
def rerun(
    folder: Path,
    number: int,
    log_dir: Path | None,
    study: Path | None,
    values: tuple[str, ...],
    code: tuple[Path, ...],
) -> None:
    """Repeat one run of the campaign in FOLDER.

    The result must be the same: the exit status is 1 if the fingerprint differs, or the hash of the log if both runs
    have one. With --set it is another run, shown beside the first.
    """
    with errors_as_messages():
        data = open_results(folder)
        add_user_task_folders(code, [str(study or data.metadata["file"])])
        if log_dir is not None:
            check_log_folder(log_dir)
        again = repeat_run(data, number, StudyRunner(), changes=parse_values(values), log_root=log_dir, file=study)
    _show(again, number, bool(values))
    sys.exit(1 if again.differences else 0)


def _show(again: RepeatedRun, number: int, is_other: bool) -> None:
    """The run as it was, and as it is now if that is another one."""
    row, result = again.row, again.result
    verdict = "passed" if result.passed else "failed"
    click.echo(
        f"run {number}, seed {row['seed']}: {verdict}" + (f", {last_line(result.error)}" if result.error else "")
    )
    for name, value in again.values.items():
        was = again.original_values.get(name, value)
        click.echo(printable(f"  {name} = {value}" + (f" (was {was})" if was != value else "")))
    before = {name: value for name, value in row.items() if name.startswith(("metrics.", "margins."))}
    now = {f"metrics.{name}": value for name, value in result.metrics.items()}
    now |= {f"margins.{found.name}": found.margin for found in result.verdicts}
    for name, value in now.items():
        was = f" (was {before[name]:.6g})" if is_other and name in before else ""
        click.echo(f"  {printable(name)}: {value:.6g}{was}")
    for vehicle, log in result.logs.items():
        click.echo(f"  log of {printable(vehicle)}: {printable(str(log))}")
    for difference in again.differences:
        click.echo(f"not as it was: {printable(difference)}", err=True)
    if not is_other and not again.differences:
        hashes = " and log" if any(f"hashes.{vehicle}" in row for vehicle in result.hashes) else ""
        click.echo(f"as it was: fingerprint{hashes} {row['fingerprint'][:16]}")
