"""`shoal check`, `explain`, `tasks` and `message`: what there is, what it means, what is wrong with it."""

import sys
from collections import Counter
from collections.abc import Collection, Iterable
from difflib import get_close_matches
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

import imc
from runtime.kernel import WallClock
from runtime.problem import Origin, Problem, ProfileError, printable, suggestion
from runtime.profile import Profile, available, load_profile
from runtime.task import Parameter, Task
from runtime.vehicle import TaskImportError, all_tasks, build, doubts, find_task, missing_extra
from runtime.vehicle import check as find_problems
from runtime.vehicle import explain as rows_of

STYLES = {"error": "red", "warning": "yellow", "note": "dim"}

_config_dir = click.option(
    "-d", "--config-dir", multiple=True, type=click.Path(path_type=Path), help="A folder with profiles."
)
_modes = click.option("-p", "--profiles", multiple=True, help="Modes to select, such as Simulation.")
_overrides = click.option(
    "--set", "overrides", multiple=True, metavar="SECTION:OPTION=VALUE", help="Overrides a value."
)


@click.command()
@click.argument("names", nargs=-1, metavar="[PROFILE]...")
@_config_dir
@_modes
@_overrides
@click.option("--strict", is_flag=True, help="Exit status 1 for warnings, too.")
def check(
    names: tuple[str, ...],
    config_dir: tuple[Path, ...],
    profiles: tuple[str, ...],
    overrides: tuple[str, ...],
    strict: bool,
) -> None:
    """Look for mistakes in PROFILEs, all that are found by default. Exit status 1 where there are errors."""
    console = Console(highlight=False, soft_wrap=True)
    counts: Counter[str] = Counter()
    broken: list[TaskImportError] = []
    known = all_tasks(broken)
    for error in broken:
        counts["error"] += 1
        console.print(f"error: {error}", style=STYLES["error"], markup=False)
    for name in names or sorted(available(config_dir)):
        try:
            profile = load_profile(name, config_dir, overrides=overrides, strict=False)
            selected = profile.select(profiles) if profiles else None
            problems = find_problems(profile, known, selected, find_task)
            if not any(problem.severity == "error" for problem in problems):
                problems += _misfits(profile, [{mode} for mode in profile.modes] if selected is None else [selected])
        except ProfileError as error:
            problems = error.problems
        for problem in problems:
            counts[problem.severity] += 1
            console.print(str(problem), style=STYLES[problem.severity], markup=False)
        if not problems:
            console.print(f"{name}: nothing wrong", markup=False)
    if counts:
        console.print(", ".join(f"{number} {severity}{'s' * (number > 1)}" for severity, number in counts.items()))
    sys.exit(1 if counts["error"] or (strict and counts["warning"]) else 0)


def _misfits(profile: Profile, selections: Iterable[Collection[str]]) -> list[Problem]:
    """What the tasks themselves have against their values, and what they need, in any of the selections."""
    found: list[Problem] = []
    for selected in selections:
        try:
            made = build(profile, selected, clock=WallClock())
            try:
                found += doubts(made.vehicle, profile)
            finally:
                made.vehicle.close()
            for reason, names in made.left_out.items():
                sections = [profile.config.sections[name] for name in names if find_task(name) is not None]
                found += [Problem("note", *section.origin, f"[{section.name}] {reason}") for section in sections]
        except ProfileError as error:
            found += error.problems
    return list(dict.fromkeys(found))


@click.command()
@click.argument("profile")
@click.argument("section", required=False)
@_config_dir
@_modes
@_overrides
def explain(
    profile: str,
    section: str | None,
    config_dir: tuple[Path, ...],
    profiles: tuple[str, ...],
    overrides: tuple[str, ...],
) -> None:
    """Say what each value of PROFILE is, its unit and meaning, and which line set it.

    Saved parameters (db/<vehicle>-saved.ini) count, as they do in all but virtual runs.
    """
    console = _console()
    try:
        loaded = load_profile(profile, config_dir, saved=Path("db"), overrides=overrides, strict=False)
        selected = loaded.select(profiles)
        if section is not None:
            _explain_section(console, loaded, section)
            return
        table = _table("section", "enabled in", "task", "set in")
        for found in loaded.config.sorted_sections():
            try:
                cls = find_task(found.name)
                what = _sentence(cls) if cls else "not in Shoal" if "Enabled" in found.options else "data"
            except TaskImportError as error:
                cls, what = Task, str(error)
            if selected and (cls is None or not loaded.enabled(found.name, selected)):
                continue
            origin = _short(found.origin, loaded)
            table.add_row(*map(printable, (found.name, found.value("Enabled"), what, origin)))
        console.print(table)
    except ProfileError as error:
        raise click.ClickException(str(error)) from None


def _explain_section(console: Console, profile: Profile, section: str) -> None:
    cls = _find_task(section)
    if section not in profile.config.sections and cls is None:
        hint = suggestion(section, profile.config.sections)
        raise ProfileError([Problem("error", str(profile.path), 0, f"there is no section [{section}]", hint)])
    if cls is not None:
        console.print(f"[bold]{section}[/]: {_sentence(cls)}")
    table = _table("option", "value", "unit", "set by", "meaning")
    for row in rows_of(profile, section, cls):
        before = ", ".join(_short(origin, profile) for origin in row.overwritten)
        origin = _short(row.origins[0], profile) if row.origins else "default"
        origin += f" (over {before})" if before else ""
        table.add_row(*map(printable, (row.option, row.value, row.unit, origin, row.meaning)))
    console.print(table)


def _console() -> Console:
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=200)


def _short(origin: Origin, profile: Profile) -> str:
    """File and line, the file relative to the folder that the profile's folder is in."""
    root = profile.path.absolute().parent.parent
    path = Path(origin.file).absolute()
    return str(origin._replace(file=str(path.relative_to(root)))) if path.is_relative_to(root) else str(origin)


def _find_task(section: str) -> type[Task] | None:
    try:
        return find_task(section)
    except TaskImportError as error:
        raise click.ClickException(str(error)) from None


@click.command()
@click.argument("name", required=False)
def tasks(name: str | None) -> None:
    """List Shoal's tasks, or the parameters of the task NAME, which may be one of your own."""
    broken: list[TaskImportError] = []
    console, known = _console(), all_tasks(broken)
    for error in broken:
        click.echo(f"Error: {error}", err=True)
    if name is not None:
        if name not in known and (own := _find_task(name)) is not None:
            known[name] = own
        _describe(console, _choose(name, known, "task"), known)
        return
    table = _table("task", "what it does")
    for section, cls in known.items():
        extra = missing_extra(cls)
        need = f" [yellow](needs pip install 'shoal\\[{extra}]')[/]" if extra else ""
        table.add_row(section, _sentence(cls) + need)
    console.print(table)
    if broken:
        sys.exit(1)


@click.command()
@click.argument("name")
def message(name: str) -> None:
    """Describe a message, by NAME or id."""
    known = {cls.__name__: cls for cls in imc.messages.BY_ID.values()}
    if name.isdecimal():
        found = next((cls for cls in known.values() if int(name) == cls.ID), None)
        if found is None:
            raise click.ClickException(f"no message has the id {name}")
    else:
        found = known[_choose(name, known, "message")]
    console, table = _console(), _table("field", "type", "unit", "range", "values")
    console.print(f"[bold]{found.__name__}[/], id {found.ID}: {_sentence(found)}")
    for field in imc.fields(found):
        limits = _range(field.minimum, field.maximum)
        values = ", ".join(f"{member.value} {member.name}" for member in field.enum) if field.enum else ""
        table.add_row(field.name, field.type, field.unit, limits, values)
    if table.row_count:
        console.print(table)


def _describe(console: Console, section: str, known: dict[str, type[Task]]) -> None:
    cls = known[section]
    console.print(f"[bold]{section}[/]: {_sentence(cls)}")
    table = _table("parameter", "default", "unit", "range", "meaning")
    for parameter in cls.parameters().values():
        default = parameter.format(parameter.default)
        table.add_row(parameter.name, default, parameter.unit, _limits(parameter), parameter.description)
    console.print(table)


def _limits(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(map(str, parameter.choices))
    return _range(parameter.minimum, parameter.maximum)


def _range(low: float | None, high: float | None) -> str:
    if low is None and high is None:
        return ""
    return f"{'-inf' if low is None else f'{low:g}'} to {'inf' if high is None else f'{high:g}'}"


def _sentence(cls: type) -> str:
    return (cls.__doc__ or "").strip().partition("\n")[0]


def _table(*columns: str) -> Table:
    table = Table(box=None, header_style="dim", pad_edge=False)
    for number, column in enumerate(columns):
        table.add_column(column, overflow="fold", no_wrap=number == 0)
    return table


def _choose(name: str, known: dict[str, type], what: str) -> str:
    if name in known:
        return name
    folded = {word: key for key in known for word in (key.lower().rpartition(".")[2], key.lower())}
    if name.lower() in folded:
        return folded[name.lower()]
    close = dict.fromkeys(folded[key] for key in get_close_matches(name.lower(), folded, 3, 0.5))
    raise click.ClickException(
        f"there is no {what} {name!r}" + (f"; did you mean {', '.join(close)}?" if close else "")
    )
