"""Shared by the commands of `shoal log`: opens logs, shows progress, turns errors into messages."""

import functools
import os
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import click

import imc
from imc.lsf import ParallelMap
from runtime.logs import UnknownNameError, logs_of_run, missing_logs
from shoal.cli.progress_bar import ProgressBar
from shoal.logs.inspect import format_noun_count
from shoal.logs.joined_logs import joined_logs, newest_log
from support.diagnostics import ProfileError
from support.file_errors import describe_os_error
from support.terminal_text import printable

F = TypeVar("F", bound=Callable[..., Any])
LOG = click.Path(path_type=Path)
IMPORTED = (".mcap", ".tlog", ".bin", ".ulg")
LOGS = Path("log")  # where --last searches by default
MOST_REASONS = 3


def last_option(function: F) -> F:
    """Adds --last, which replaces the argument `log`, to a command."""

    @functools.wraps(function)
    def command(*args: Any, log: Path | None, last: bool, **values: Any) -> Any:
        return function(*args, log=_require_log("log", log or _default(last), last), **values)

    return cast(F, _last(command))


def run_selection_options(*names: str, optional: Sequence[str] = ()) -> Callable[[F], F]:
    """Adds --run and --last, which change what the arguments `names` mean, to a command; `optional` ones may lack.

    --last alone chooses the first of all.
    """
    first = (*names, *optional)[0]

    def decorate(function: F) -> F:
        @functools.wraps(function)
        def command(*args: Any, run: bool, last: bool, **values: Any) -> Any:
            values[first] = values[first] or _default(last)
            for name in (*names, *(name for name in optional if values[name])):
                values[name] = _joined(_require_log(name, values[name], last), run)
            return function(*args, **values)

        whole = click.option("--run", is_flag=True, help="Take all logs of the run that the log belongs to, as one.")
        return cast(F, whole(_last(command)))

    return decorate


def _last(command: F) -> F:
    return click.option("--last", is_flag=True, help="Take the newest log below a folder [default: log].")(command)


def _default(last: bool) -> Path | None:
    return LOGS if last else None


def _require_log(name: str, path: Path | None, last: bool) -> Path:
    """The log of an argument, or the newest one below it, which is named."""
    if path is None:
        raise click.UsageError(f"name a {name.upper()}, or use --last")
    if not last:
        return path
    if path != LOGS and not path.is_dir():
        raise click.UsageError(printable(f"{path} is not a folder; --last searches one: --last log {path}"))
    with errors_as_messages():
        newest = newest_log(path)
    click.echo(printable(f"log: {newest}"), err=True)
    return newest


def _joined(path: Path, run: bool) -> Path:
    """The log, or the logs of its run as one, which are removed when the command ends."""
    if not run:
        return path
    with errors_as_messages():
        logs = logs_of_run(path.parent if path.is_file() else path)
        whole = click.get_current_context().with_resource(joined_logs(logs))
    click.get_current_context().meta[str(whole)] = logs
    for missing in missing_logs(logs):
        click.echo(f"log {missing} of the run is missing", err=True)
    return whole


def logs_of_argument(path: Path) -> list[Path]:
    """The logs that a command takes as one; only the log itself without --run."""
    context = click.get_current_context(silent=True)
    return [path] if context is None else context.meta.get(str(path), [path])


@contextmanager
def errors_as_messages() -> Generator[None]:
    """Turns errors with files and names into messages of the command line."""
    try:
        yield
    except imc.SchemaError as error:
        hint = "`shoal log doctor` explains and repairs it"
        raise click.ClickException(printable(f"the definitions of the log are bad: {error}; {hint}")) from None
    except ProfileError as error:  # each on a line of its own
        raise click.ClickException("\n".join(printable(str(problem)) for problem in error.problems)) from None
    except (UnknownNameError, ValueError) as error:
        raise click.ClickException(printable(str(error))) from None
    except OSError as error:
        raise click.ClickException(printable(describe_os_error(error))) from None


def open_log(path: Path) -> imc.Log:
    """A log that is unpacked on all processors. Raises what imc.Log raises."""
    return imc.Log(path, spread=make_parallel_map(), keep_index=len(logs_of_argument(path)) == 1)


def make_parallel_map() -> ParallelMap:
    """The `spread` of imc.Log that unpacks on all processors."""
    return ThreadPoolExecutor(os.cpu_count()).map


def require_messages(log: imc.Log, packets: int, losses: Sequence[imc.Loss] = ()) -> None:
    """Raises ClickException for a file without a message."""
    if packets == 0:
        length = log.path.stat().st_size
        why = f"none of its {length} bytes belongs to a message" if length else "the file is empty"
        why += "".join(f"; {loss.reason}" for loss in losses[:MOST_REASONS] if not loss.length)
        if log.path.suffix.lower() in IMPORTED and length:
            why += f"; convert it with shoal log import {log.path}"
        raise click.ClickException(printable(f"{log.path}: there is no message in this log: {why}"))


@contextmanager
def progress_bar(path: Path, what: str = "reading") -> Generator[Callable[[float], None]]:
    """A progress bar on a terminal; its function takes the share that is done, 0 to 1."""
    with ProgressBar(f"{what} {printable(path.parent.name)}/{printable(path.name)}") as bar:
        yield bar.show


def fail_if_most_is_lost(what: str, kept: int, lost: int) -> None:
    """End with exit status 1 if nothing was kept, or less than was lost; both count the same: bytes, rows, messages."""
    if not kept or lost > kept:
        share = "nothing" if not kept else "less than half"
        click.echo(printable(f"Error: {share} of {what} was written"), err=True)
        raise click.exceptions.Exit(1)


def report_losses(losses: list[tuple[Path, imc.Loss]]) -> None:
    """Print which bytes of logs were skipped, and why."""
    for path, (offset, length, reason) in losses[:20]:
        click.echo(
            printable(f"skipped: {path}: byte {offset}: {format_noun_count(length, 'byte')}: {reason}"), err=True
        )
    if len(losses) > 20:
        click.echo(f"skipped: {format_noun_count(len(losses) - 20, 'more damaged place')}", err=True)
