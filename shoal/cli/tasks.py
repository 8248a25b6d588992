"""`shoal tasks`: lists tasks, or the parameters of one."""

import sys
from pathlib import Path

import click
from rich.console import Console

from runtime.task import Parameter, Task, consumer_methods
from runtime.vehicle import TaskImportError, all_tasks, missing_extra
from shoal.cli.console_tables import (
    find_task_class,
    first_sentence,
    format_range,
    open_console,
    plain_table,
    resolve_name,
)
from shoal.cli.json_output import json_option, parameter_to_dict, print_json
from shoal.cli.options import add_user_task_folders, code_option


@click.command()
@click.argument("name", metavar="[NAME|WORD]", required=False)
@code_option
@json_option
def tasks(name: str | None, code: tuple[Path, ...], as_json: bool) -> None:
    """List Shoal's tasks, or the parameters of the task NAME, which may be one of your own.

    A WORD that is no task lists the tasks that have it in their name, description or parameters, or that subscribe to
    the message of this name.
    """
    add_user_task_folders(code)
    broken: list[TaskImportError] = []
    console, known = open_console(), all_tasks(broken)
    for error in broken:
        click.echo(f"Error: {error}", err=True)
    if name is not None:
        if name not in known and (own := find_task_class(name)) is not None:
            known[name] = own
        try:
            section = resolve_name(name, known, "task")
        except click.ClickException:
            if not (found := _search(name, known)):
                raise
            _list(console, found, as_json)
            return
        if as_json:
            parameters = [parameter_to_dict(parameter) for parameter in known[section].parameters().values()]
            print_json(_heading(section, known[section]) | {"parameters": parameters})
        else:
            _describe(console, section, known)
        return
    _list(console, known, as_json)
    if broken:
        sys.exit(1)


def _search(word: str, known: dict[str, type[Task]]) -> dict[str, type[Task]]:
    """The tasks that have a word in their texts, or the message of this name as an input."""
    wanted = word.casefold()

    def matches(section: str, cls: type[Task]) -> bool:
        parameters = cls.parameters().values()
        texts = [section, cls.__doc__ or "", *(p.name for p in parameters), *(p.description for p in parameters)]
        inputs = (consumer.type.__name__ for consumer in consumer_methods(cls))
        return any(wanted in text.casefold() for text in texts) or wanted in map(str.casefold, inputs)

    return {section: cls for section, cls in known.items() if matches(section, cls)}


def _list(console: Console, found: dict[str, type[Task]], as_json: bool) -> None:
    if as_json:
        print_json([_heading(section, cls) for section, cls in found.items()])
        return
    table = plain_table("task", "what it does")
    for section, cls in found.items():
        extra = missing_extra(cls)
        need = f" [yellow](needs pip install 'shoal\\[{extra}]')[/]" if extra else ""
        table.add_row(section, first_sentence(cls) + need)
    console.print(table)


def _heading(section: str, cls: type[Task]) -> dict[str, object]:
    return {"task": section, "description": first_sentence(cls), "missing_extra": missing_extra(cls)}


def _describe(console: Console, section: str, known: dict[str, type[Task]]) -> None:
    cls = known[section]
    console.print(f"[bold]{section}[/]: {first_sentence(cls)}")
    table = plain_table("parameter", "default", "unit", "range", "meaning")
    for parameter in cls.parameters().values():
        default = parameter.format(parameter.default)
        table.add_row(parameter.name, default, parameter.unit, _limits(parameter), parameter.description)
    console.print(table)


def _limits(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(map(str, parameter.choices))
    return format_range(parameter.minimum, parameter.maximum)
