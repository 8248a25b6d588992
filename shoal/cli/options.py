"""Options that several commands have, and the parsing of their values."""

import errno
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import click

from runtime.vehicle import Vehicle
from support.terminal_text import printable
from tasks.transports.logging import Logging

LOG_FILES = ("data.lsf", "config.ini", "imc.xml.gz", "run.json", "state-")  # how their names begin


def _require_virtual(context: click.Context, _: click.Parameter, clock: str | None) -> None:
    """Click callback: the clock as `shoal run` names it. Raises UsageError for any but a virtual one."""
    if clock is not None and clock.strip().lower() != "virtual":
        words = f"shoal {context.info_name} uses a virtual clock only, not {clock!r}; shoal run has others"
        raise click.UsageError(printable(words))


virtual_clock_option: Final = click.option("--clock", hidden=True, expose_value=False, callback=_require_virtual)
"""Accepts `--clock virtual`, as `shoal run` has it, for a command with no other clock."""
config_dir_option: Final = click.option(
    "-d",
    "--config-dir",
    multiple=True,
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Search this folder for profiles first.",
)
modes_option: Final = click.option(
    "-p", "--profiles", multiple=True, help="Modes to select, separated by commas, such as Simulation."
)
overrides_option: Final = click.option(
    "--set", "overrides", multiple=True, metavar="SECTION:OPTION=VALUE", help="Override an option; can be repeated."
)
values_option: Final = click.option(
    "--set", "values", multiple=True, metavar="PLACE=VALUE", help="Replace a value of the file; can be repeated."
)
code_option: Final = click.option(
    "--code",
    multiple=True,
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder with tasks of your own; by default the current one, unless it has a log.",
)
code_of_log_option: Final = click.option(
    "--code",
    multiple=True,
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder with tasks of your own that the log needs; there is no default.",
)
log_dir_option: Final = click.option(
    "--log-dir", default="log", show_default=True, type=click.Path(path_type=Path), help="Folder for logs."
)


def add_user_task_folders(
    code: Sequence[Path], profiles: Iterable[str] = (), *, of_log: bool = False
) -> Sequence[Path]:
    """Search these folders for a user's tasks; without any the current one, unless it or a profile is part of a log.

    Returns the folders, for other processes that do the same work.

    A log received from others must not run code: its Config.ini may name any module beside it. A Config.ini alone is
    enough, with any content, since its sender may leave out all other files.
    """
    from runtime.vehicle import add_task_folder  # slow to import, and not every command needs it

    here = Path.cwd()
    if not code and not of_log:
        places = [here, *(Path(name).parent for name in profiles if Path(name).is_file())]
        log = next((found for place in places if (found := _log_in(place))), None)
        if log is None:
            code = [here]
        elif (here / "tasks").is_dir() or any(here.glob("*.py")):
            why = f"{log} is named like a part of a log, and a log received from others must not run code"
            rename = f"; or, if it is a profile of yours, rename {log.name}" if log.suffix.lower() == ".ini" else ""
            words = f"own tasks in {here} are not searched for: {why}; to run the code in this folder add --code ."
            click.echo(printable(f"note: {words}{rename}"), err=True)
    for folder in code:
        for clash in add_task_folder(folder):
            click.echo(f"warning: {clash}", err=True)
    return code


def _log_in(folder: Path) -> Path | None:
    """A file of a log in a folder, or in one that the folder may be a part of: <date>/<time>_<plan>/Data.lsf.

    Each file counts, in any letter case: a sender may leave out or rename the others.
    """
    day, time = "[0-9]" * 8, "[0-9]" * 6
    files = [file for depth in ("", f"{time}*/", f"{day}/{time}*/") for file in folder.glob(f"{depth}*")]
    return next((file for name in LOG_FILES for file in files if file.name.lower().startswith(name)), None)


def parse_values(texts: Iterable[str]) -> dict[str, object]:
    """Values by their place in a scenario, of texts such as world/current/north=0.5. Raises click.BadParameter."""
    from support.located_yaml import parse_yaml_tree  # slow to import

    values: dict[str, object] = {}
    for text in texts:
        place, equals, value = text.partition("=")
        if not (place.strip() and equals and value.strip()):
            why = f"{text!r} is no assignment such as world/current/north=0.5"
            raise click.BadParameter(printable(why), param_hint="--set")
        try:
            node, place = parse_yaml_tree(value.strip(), "the value"), place.strip()
            values[place] = node.text() if place == "variant" else node.value()  # as in the file: 4 is a number
        except ValueError as error:
            raise click.BadParameter(printable(f"{text!r}: {error}"), param_hint="--set") from None
    return values


def require_text(_: click.Context, __: click.Parameter, text: str | None) -> str:
    """Click callback: a text that is not empty if it is given."""
    if text is not None and not text.strip():
        raise click.BadParameter("it is empty")
    return text or ""


def check_vehicle_log_folder(vehicle: Vehicle) -> None:
    """Reject a run that is to record where nothing can be written. Raises click.BadParameter."""
    if any(isinstance(task, Logging) for task in vehicle.tasks):
        check_log_folder(vehicle.log_root / vehicle.name)


def check_log_folder(folder: Path) -> None:
    """Raise click.BadParameter if no log can be written to a folder.

    A full disk is no reason: the logger holds messages until there is space.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            why = f"no log can be written to {folder}: {error.strerror or error}"
            raise click.BadParameter(printable(why), param_hint="--log-dir") from None
