"""`shoal spy`: the messages of running vehicles, or their rates."""

import asyncio
import json
import re
import time
from collections import Counter
from collections.abc import Callable
from contextlib import aclosing, suppress
from typing import Any

import click
from rich.console import Console
from rich.live import Live
from rich.table import Table

import imc
from shoal.cli.completion import complete_fields, complete_message, find_message_type
from shoal.cli.field_values import format_fields
from shoal.cli.json_output import json_option, print_json_line
from shoal.cli.log.selection_options import split_names
from shoal.cli.messages_option import messages_option
from shoal.cli.remote_command import complete_entity, network_options
from shoal.cli.time_texts import format_clock_time, parse_duration_option
from shoal.cli.unlisted_messages import unlisted_messages_text
from shoal.cli.vehicle_selection import (
    Say,
    VehicleSelection,
    prefixed,
    print_error,
    run_on_selection,
    vehicles_argument,
)
from shoal.network import (
    AsyncRemoteVehicle,
    NetworkError,
    NetworkSystem,
    NoAnswer,
    VehicleLost,
    field_value,
    parse_message_filter,
)
from support.terminal_text import printable, suggestion

REFRESH = 0.5  # s
QUIET = 5.0  # s without a message to show, after which the reason is printed
MOST_NAMED = 8
WINDOW = 3.0  # s over which a live rate is taken
RATES = re.compile(r"\b(rates?|hz|frequency|period)\b", re.IGNORECASE)
SHORTEST = 0.1  # s over which a rate means something
ASK_AGAIN = 0.5  # s between questions for the labels of entities


@click.command()
@vehicles_argument
@click.argument("messages", metavar="[MESSAGE]...", nargs=-1, shell_complete=complete_message)
@click.option("--where", default="", help='Only messages that match, such as "depth > 2 and u < 0.5".')
@click.option(
    "--fields", default="", shell_complete=complete_fields, help="Only these fields, separated by commas: x,y,depth."
)
@click.option(
    "-e", "--entities", multiple=True, shell_complete=complete_entity, help="Only messages of these entities, by label."
)
@click.option("--hz", is_flag=True, help="Rates of all types, instead of the messages.")
@click.option(
    "--for", "duration", callback=parse_duration_option, metavar="TIME", help="End after this time: 3s, 1min."
)
@click.option("--count", type=click.IntRange(1), help="End after this many messages.")
@messages_option
@network_options
@json_option
def spy(
    vehicle: VehicleSelection,
    messages: tuple[str, ...],
    where: str,
    fields: str,
    entities: tuple[str, ...],
    hz: bool,
    duration: float | None,
    count: int | None,
    schema: imc.Schema,
    connection: dict[str, Any],
    as_json: bool,
) -> None:
    """Show the messages of VEHICLE as they come: all, or those of the types named.

    VEHICLE is a name, several with commas, or a pattern in quotes such as 'lauv-*'; --count is for each of several.
    --json prints an object on each line. Exit status 1 if a vehicle sends nothing, or ends.
    """
    kinds = [find_message_type(name, schema) for name in messages]
    try:
        test = parse_message_filter(where, kinds, schema)
    except ValueError as error:
        raise click.BadParameter(f"{error}{_rates_hint(where)}", param_hint="--where") from None
    names = tuple(name.strip() for name in fields.split(",") if name.strip())
    _check_fields(names, kinds or [schema[name] for name in schema.types])
    if hz and (names or count is not None):
        raise click.UsageError("--hz shows rates: it takes --for, but no --fields and no --count")

    single, labels = bool(vehicle.single_name), split_names(entities)

    async def act(there: AsyncRemoteVehicle) -> None:
        if clash := there.system.conflict_text:
            click.echo(printable(f"{there.name}: {clash}"), err=True)
        if labels:
            with suppress(NoAnswer):  # zenoh brings the labels with the messages
                await there.param.entity_ids()
        sieve = SpyFilter(there, test, where, labels)
        say = click.echo if single else prefixed(there.name)
        if hz:
            await _measure(there, kinds, sieve, duration, as_json, None if single else say)
            return
        explanation = asyncio.create_task(_explain_silence(sieve, kinds))
        try:
            async with asyncio.timeout(duration), aclosing(there.messages(*kinds)) as stream:
                async for message in stream:
                    if sieve.accepts(message):
                        if as_json:
                            values = message_to_dict(there, message, names)
                            print_json_line(values if single else {"vehicle": there.name, **values})
                        else:
                            say(format_message(there, message, names))
                        if sieve.accepted == count:
                            return
        except TimeoutError:
            if not sieve.accepted:
                raise NoAnswer(sieve.no_match_text(duration or 0.0)) from None
        finally:
            explanation.cancel()

    options = {**connection, "messages": schema}
    results = run_on_selection(vehicle, options, act, takes_clash=True, on_error=print_error)
    if any(result.error for result in results):
        raise click.exceptions.Exit(1)


def _rates_hint(where: str) -> str:
    """A pointer to --hz for a condition about rates, which no single message has."""
    return "; spy --hz shows the rates of messages" if RATES.search(where) else ""


class SpyFilter:
    """Filter of the messages to show, and the reason why none was shown."""

    def __init__(self, vehicle: AsyncRemoteVehicle, test: Callable[[imc.Message], bool], where: str, labels: list[str]):
        self.vehicle: AsyncRemoteVehicle = vehicle
        self._test = test
        self._labels = labels or [""]
        given = {"where": where, "entities": ",".join(labels)}
        self._words = " ".join(f"--{name} {value!r}" for name, value in given.items() if value)
        self.received: int = 0
        self.accepted: int = 0
        self._unknown: set[int] = set()

    def accepts(self, message: imc.Message) -> bool:
        self.received += 1
        named = any(self.vehicle.system.matches_label(message.src_ent, label) for label in self._labels)
        wanted = named and self._test(message)
        self.accepted += wanted
        if wanted and isinstance(message, imc.Unknown) and message.id not in self._unknown:
            self._unknown.add(message.id)
            click.echo(f"there is no message with id {message.id} here: name its definition with --messages", err=True)
        return wanted

    def no_match_text(self, seconds: float) -> str:
        """The reason for that no message passed."""
        if not self.received:
            return f"{self.vehicle.name}: nothing came within {seconds:g} s"
        return f"{self.vehicle.name}: none of {self.received} messages within {seconds:g} s matched {self._words}"


async def _explain_silence(sieve: SpyFilter, kinds: list[type[imc.Message]]) -> None:
    """Print to a person who waits for messages why none has come."""
    await asyncio.sleep(QUIET)
    if sieve.accepted:
        return
    click.echo(printable(f"{sieve.no_match_text(QUIET)}; waiting, Ctrl-C ends"), err=True)
    if not sieve.received and (reason := await unlisted_messages_text(sieve.vehicle, kinds)):
        click.echo(printable(reason), err=True)


def _check_fields(names: tuple[str, ...], kinds: list[type[imc.Message]]) -> None:
    known = {field.name for kind in kinds for field in imc.fields(kind)}
    for name in names:
        if name.partition(".")[0] not in known | {"src", "src_ent", "dst", "dst_ent", "timestamp"}:
            where = ", ".join(kind.__name__ for kind in kinds) if len(kinds) <= MOST_NAMED else "any message"
            hint = suggestion(name, known)
            raise click.BadParameter(f"no field {name!r} in {where}{hint and f'; {hint}'}", param_hint="--fields")


def format_message(vehicle: AsyncRemoteVehicle, message: imc.Message, names: tuple[str, ...] = ()) -> str:
    """A message, or some of its fields, on one line."""
    entity = printable(vehicle.system.label(message.src_ent))
    name = type(message).__name__
    return f"{format_clock_time(message.timestamp)} {name} {entity}: {format_fields(message, names)}"


def message_to_dict(vehicle: AsyncRemoteVehicle, message: imc.Message, names: tuple[str, ...]) -> dict[str, Any]:
    """The same for JSON."""
    entity = printable(vehicle.system.label(message.src_ent))
    if not names:
        return {"entity": entity, **(message.to_dict() if _is_plain(message) else _json(message))}
    values: dict[str, Any] = {"abbrev": type(message).__name__, "timestamp": message.timestamp, "entity": entity}
    for name in names:
        try:
            value = field_value(message, name)
        except AttributeError:
            continue
        values[name] = _json(value) if isinstance(value, imc.Message) else value
    return values


def _is_plain(message: imc.Message) -> bool:
    known = not isinstance(message, imc.Unknown)
    return known and not any(field.type == "rawdata" or field.messages for field in imc.fields(type(message)))


def _json(message: imc.Message) -> dict[str, Any]:
    return json.loads(message.to_json())


async def _measure(
    vehicle: AsyncRemoteVehicle,
    kinds: list[type[imc.Message]],
    sieve: SpyFilter,
    duration: float | None,
    as_json: bool,
    say: Say | None = None,
) -> None:
    """Rates of all types at once: at the end, and meanwhile on a terminal.

    `say` prints the lines of one of several vehicles, which have no table that changes.
    """
    rates = MessageRates(vehicle.system)
    console = Console(highlight=False, markup=False, emoji=False, width=None if Console().is_terminal else 120)
    has_screen = console.is_terminal and not as_json and say is None
    live = Live(Table(), console=console, refresh_per_second=4) if has_screen else None
    began = drawn = asked = time.monotonic()
    gone: VehicleLost | None = None
    if live is not None:
        live.start()
    try:
        by_itself = duration is None and live is None
        limit = QUIET + vehicle.system.contact_timeout if by_itself else duration
        async with asyncio.timeout(limit) as scope, aclosing(vehicle.messages(*kinds)) as stream:
            async for message in stream:
                if by_itself and not sieve.received:  # the window begins with the first message
                    scope.reschedule(asyncio.get_running_loop().time() + WINDOW)
                is_wanted, now = sieve.accepts(message), time.monotonic()
                rates.add(message, now, is_wanted=is_wanted)
                if rates.lacks_labels and now - asked > ASK_AGAIN:
                    asked = now
                    vehicle.network.request_labels(vehicle.system)
                if live is not None and now - drawn > REFRESH:
                    live.update(rates.table(now))
                    drawn = now
    except TimeoutError:
        pass
    except VehicleLost as error:
        gone = error
    finally:
        if live is not None:
            live.stop()
    now = time.monotonic()
    if gone is None and rates.lacks_labels:  # the answers to single questions may have got lost
        with suppress(NetworkError):
            await vehicle.param.entity_ids()
    if as_json:
        rows = rates.rows(now)
        print_json_line(rows if say is None else {"vehicle": vehicle.name, "rates": rows})
    elif say is not None:
        with console.capture() as printed:
            console.print(rates.table(now))
        say(printed.get().rstrip())
    elif live is None:
        console.print(rates.table(now))
    if gone is not None:
        raise gone
    if not sieve.accepted:
        raise NoAnswer(sieve.no_match_text(round(now - began, 1)))


class MessageRates:
    """The rate of messages of a type from an entity, since the first message: before, nothing was received."""

    def __init__(self, system: NetworkSystem):
        self._system = system
        self._counts: Counter[tuple[str, int]] = Counter()
        self._sizes: Counter[tuple[str, int]] = Counter()
        self._began = 0.0

    def add(self, message: imc.Message, now: float, *, is_wanted: bool) -> None:
        """Count a message that came `now` (s)."""
        self._began = self._began or now
        if is_wanted:
            place = type(message).__name__, message.src_ent
            self._counts[place] += 1
            self._sizes[place] += len(imc.encode(message))

    @property
    def lacks_labels(self) -> bool:
        """Whether the label of an entity is still unknown."""
        return any(entity not in self._system.labels for _, entity in self._counts)

    def rows(self, now: float) -> list[dict[str, object]]:
        """Type, entity, count and rates of each, until `now`; an entity is named as it is known by then."""
        past = max(now - self._began, SHORTEST)
        return [
            {
                "message": name,
                "entity": entity,
                "count": self._counts[name, number],
                "hz": self._counts[name, number] / past,
                "bytes_per_s": self._sizes[name, number] / past,
            }
            for name, entity, number in sorted((n, printable(self._system.label(e)), e) for n, e in self._counts)
        ]

    def table(self, now: float) -> Table:
        """The same for people, with the sums."""
        table = Table(box=None, header_style="dim", pad_edge=False)
        for column in ("message", "entity", "Hz", "B/s"):
            table.add_column(column, justify="right" if column in ("Hz", "B/s") else "left")
        for row in self.rows(now):
            table.add_row(str(row["message"]), str(row["entity"]), f"{row['hz']:.2f}", f"{row['bytes_per_s']:.0f}")
        past = max(now - self._began, SHORTEST)
        total, size = sum(self._counts.values()), sum(self._sizes.values())  # integers
        table.add_row("all", "", f"{total / past:.1f}", f"{size / past:.0f}")
        return table
