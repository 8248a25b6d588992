"""Completion of words that no vehicle is asked for: profiles, messages, fields and the names of their values."""

from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import NamedTuple

import click
from click.shell_completion import CompletionItem

import imc
from runtime.profile import available_profiles
from support.terminal_text import printable

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def find_message_type(name: str, schema: imc.Schema) -> type[imc.Message]:
    """The type of a message, by its name in any case. Raises UsageError that names the nearest."""
    names = {known.lower(): known for known in schema.types}
    if name.lower() not in names:
        close = [names[word] for word in get_close_matches(name.lower(), names, 3, 0.5)]
        hint = f"; did you mean {', '.join(close)}?" if close else ""
        own = "a message of your own needs --messages FILE, the file of [General] Messages"
        raise click.UsageError(f"there is no message {printable(name)!r}{hint} ({own})")
    return schema[names[name.lower()]]


def complete_profile(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The names of the profiles, and files."""
    names = available_profiles(context.params.get("config_dir") or ())
    found = [CompletionItem(name) for name in names if name.startswith(incomplete)]
    return [CompletionItem(incomplete, type="file"), *found]  # bash forgets what comes before it


def complete_message(context: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The names of all messages."""
    return completion_items(list((context.params.get("schema") or imc.builtin()).types), incomplete)


def complete_field(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The fields of the message that was written before, and after the sign = the names of its values."""
    schema = context.params.get("schema") or imc.builtin()
    name = context.params.get("name")
    try:
        kind = find_message_type(str(name), schema)
    except click.UsageError:
        return []
    field, equals, _value = incomplete.partition("=")
    infos = {info.name: info for info in imc.fields(kind)}
    if not equals:
        return completion_items([f"{each}=" for each in infos], incomplete)
    members = infos[field].enum if field in infos else None
    return completion_items([f"{field}={member.name}" for member in members or ()], incomplete)


def complete_fields(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The fields of the messages that were written before, with commas; without messages those of all."""
    schema = context.params.get("schema") or imc.builtin()
    before, comma, last = incomplete.rpartition(",")
    given = context.params.get("messages") or context.args[1:]  # click assigns none behind an option without its value
    names = given or tuple(schema.types)
    try:
        kinds = [find_message_type(name, schema) for name in names]
    except click.UsageError:
        return []
    fields = dict.fromkeys(info.name for kind in kinds for info in imc.fields(kind))
    return [CompletionItem(f"{before}{comma}{item.value}") for item in completion_items(list(fields), last)]


def completion_items(words: list[str], incomplete: str) -> list[CompletionItem]:
    return [CompletionItem(word) for word in words if word.lower().startswith(incomplete.lower())]


class _Arguments(NamedTuple):
    """Completion of the arguments of a command: the first ones, None for a vehicle, and all further ones."""

    first: tuple[Completer | None, ...]
    further: Completer | None = None


_ARGUMENTS = {
    **dict.fromkeys(("run", "mission", "explain", "service"), _Arguments((complete_profile,))),
    "check": _Arguments((), complete_profile),
    "spy": _Arguments((None,), complete_message),
    "send": _Arguments((None, complete_message), complete_field),
}


def complete_without_command(words: Sequence[str], incomplete: str) -> list[CompletionItem] | None:
    """Complete the command `words[0]` without its import, which takes longer than all else.

    None where only the command itself can complete: of options, and of arguments behind them.
    """
    command, *given = words
    arguments, completer = _ARGUMENTS.get(command), None
    if command == "spy" and given[-1:] == ["--fields"]:
        given, completer = given[:-1], complete_fields
    elif arguments and not incomplete.startswith("-"):
        completer = (*arguments.first, *[arguments.further] * len(given), arguments.further)[len(given)]
    if completer is None or any(word.startswith("-") for word in given):
        return None
    context = click.Context(click.Command(command))
    context.params = {"name": "".join(given[1:2]), "messages": tuple(given[1:])}
    return completer(context, click.Argument(["word"]), incomplete)
