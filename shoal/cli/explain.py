"""`shoal explain`: shows the values of a profile, what they mean and where they are set."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import click
from rich.console import Console

from mavlink.vehicle.parameters import is_valid_mavlink_parameter, parameter_ids
from runtime.profile import Profile, Section, default_label, dune_section_names, load_profile, own_etc
from runtime.task import Parameter, Task, shared_options
from runtime.vehicle import OptionRow, TaskImportError, all_tasks, find_task
from runtime.vehicle import explain_section as rows_of
from shoal.cli.completion import complete_profile
from shoal.cli.console_tables import find_task_class, first_sentence, open_console, plain_table
from shoal.cli.options import add_user_task_folders, code_option, config_dir_option, modes_option, overrides_option
from support.diagnostics import Origin, Problem, ProfileError
from support.terminal_text import printable, suggestion

MAVLINK = "Transports.MAVLink"


@click.command()
@click.argument("profile", shell_complete=complete_profile)
@click.argument("section", required=False)
@config_dir_option
@modes_option
@overrides_option
@code_option
def explain(
    profile: str,
    section: str | None,
    config_dir: tuple[Path, ...],
    profiles: tuple[str, ...],
    overrides: tuple[str, ...],
    code: tuple[Path, ...],
) -> None:
    """Show each value of PROFILE with its unit, its meaning and the line that set it.

    Saved parameters (db/<vehicle>-saved.ini) are included; virtual runs ignore them.
    """
    add_user_task_folders(code, [profile])
    console = open_console()
    try:
        loaded = load_profile(profile, config_dir, saved=Path("db"), overrides=overrides, strict=False)
        selected = loaded.parse_modes(profiles)
        if section is not None:
            _explain_section(console, loaded, section)
            _print_place_of_own_files()
            return
        table = plain_table("section", "enabled in", "task", "set in")
        for found in loaded.config.sorted_sections():
            try:
                cls = find_task(found.name)
                what = first_sentence(cls) if cls else _without_class(found)
            except TaskImportError as error:
                cls, what = Task, str(error)
            if selected and (cls is None or not loaded.is_task_enabled(found.name, selected)):
                continue
            origin = _short(found.origin)
            table.add_row(*map(printable, (found.name, found.value("Enabled"), what, origin)))
        console.print(table)
        _print_place_of_own_files()
    except ProfileError as error:
        raise click.ClickException(str(error)) from None


def _without_class(section: Section) -> str:
    if "Enabled" not in section.options:
        return "data"
    return "not in Shoal" if section.name.partition("/")[0] in dune_section_names.TASKS else "not a task"


def _explain_section(console: Console, profile: Profile, section: str) -> None:
    cls = find_task_class(section)
    shared = shared_options(all_tasks([]).values(), section) if cls is None else {}
    if section not in profile.config.sections and cls is None and not shared:
        hint = suggestion(section, profile.config.sections)
        raise ProfileError([Problem("error", str(profile.path), 0, f"there is no section [{section}]", hint)])
    if cls is not None:
        console.print(f"[bold]{section}[/]: {first_sentence(cls)}")
    rows = rows_of(profile, section, cls, shared)
    mavlink = _mavlink_names(profile, section, rows)
    table = plain_table("option", "value", "unit", *(["MAVLink"] if mavlink else []), "set by", "meaning")
    for row in rows:
        before = ", ".join(_short(origin) for origin in row.overwritten)
        origin = _short(row.origins[0]) if row.origins else "default"
        origin += f" (overrides {before})" if before else ""
        name = [mavlink.get(row.option, "")] if mavlink else []
        table.add_row(*map(printable, (row.option, row.value, row.unit, *name, origin, row.meaning)))
    console.print(table)


def _mavlink_names(profile: Profile, section: str, rows: Iterable[OptionRow]) -> dict[str, str]:
    """The names that ground stations show, by option; none if the vehicle does not speak MAVLink."""
    if not any(name.partition("/")[0] == MAVLINK for name in profile.config.sections):
        return {}
    found = profile.config.sections.get(section)
    label = found.value("Entity Label", default_label(section)) if found else default_label(section)
    pairs = {
        row.option: (label, row.parameter.name)
        for row in rows
        if row.parameter and _is_shown(row, row.parameter, found)
    }
    names = parameter_ids(pairs.values())
    return {option: names[pair] for option, pair in pairs.items()}


def _is_shown(row: OptionRow, parameter: Parameter, section: Section | None) -> bool:
    """Whether MAVLink has a parameter, which an attribute in the profile can make editable, or not."""
    option = section.options.get(row.option) if section else None
    editable = option.attributes.get("editable") if option else None
    if editable in ("true", "false"):
        parameter = replace(parameter, editable=editable == "true")
    try:
        return is_valid_mavlink_parameter(parameter, parameter.parse(row.value))
    except ValueError:
        return False


def _short(origin: Origin) -> str:
    """File and line; a file below the working folder is relative to it, and one of Shoal's own to `_own_root`."""
    path, here, root = Path(origin.file).absolute(), Path.cwd(), _own_root()
    roots = [here] if root is None else [here, root]
    found = next((each for each in roots if path.is_relative_to(each)), None)
    return str(origin) if found is None else str(origin._replace(file=str(path.relative_to(found))))


def _own_root() -> Path | None:
    """The folder to which Shoal's own files are relative: that of its etc/, or its parent if there is an etc/ here.

    None if etc/ is below the working folder, or if both would name files of the working folder.
    """
    own, here = own_etc(), Path.cwd()
    free = (root for root in own.parents[:2] if not (here / own.relative_to(root)).exists())
    return None if own.is_relative_to(here) else next(free, None)


def _print_place_of_own_files() -> None:
    """Print where the files that are shown as etc/... can be opened."""
    own, root = own_etc(), _own_root()
    if root is not None:
        click.echo(printable(f"{own.relative_to(root)}/ is {own}"), err=True)
