"""`shoal send`: sends messages to a running vehicle."""

import asyncio
import json
import math
import time
from contextlib import suppress
from typing import Any

import click

import imc
from shoal.cli.completion import complete_field, complete_message, find_message_type
from shoal.cli.field_values import parse_value
from shoal.cli.json_output import json_option, print_json_line
from shoal.cli.messages_option import messages_option
from shoal.cli.remote_command import network_options
from shoal.cli.spy import format_message
from shoal.cli.time_texts import parse_duration_option
from shoal.cli.vehicle_selection import VehicleSelection, prefixed, print_error, run_on_selection, vehicles_argument
from shoal.network import AsyncRemoteVehicle, MessageListener
from support.terminal_text import printable, suggestion

FASTEST = 1000.0  # Hz
FLIGHT = 0.2  # s until a packet is out, and the answer here that we are not listed


class Rate(click.FloatRange):
    """A rate in Hz, with or without its unit."""

    name = "rate"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        plain: Any = value
        if isinstance(value, str) and value.strip().casefold().endswith("hz"):
            plain = value.strip()[:-2].strip()
        rate = super().convert(plain, param, ctx)
        if math.isnan(rate):  # it is in no range, nor outside of one
            self.fail(f"{value!r} is not a rate.", param, ctx)
        return rate


@click.command()
@vehicles_argument
@click.argument("name", metavar="MESSAGE", shell_complete=complete_message)
@click.argument("assignments", metavar="[FIELD=VALUE]...", nargs=-1, shell_complete=complete_field)
@click.option(
    "--rate",
    type=Rate(0.0, FASTEST, min_open=True),
    metavar="HZ",
    help="Send again and again, so many times a second.",
)
@click.option("--count", type=click.IntRange(1), help="With --rate: end after this many.")
@click.option(
    "--for", "duration", callback=parse_duration_option, metavar="TIME", help="With --rate: end after this time."
)
@click.option(
    "--wait", callback=parse_duration_option, metavar="TIME", help="Show the replies of the vehicle for this time."
)
@messages_option
@network_options
@json_option
def send(
    vehicle: VehicleSelection,
    name: str,
    assignments: tuple[str, ...],
    rate: float | None,
    count: int | None,
    duration: float | None,
    wait: float | None,
    schema: imc.Schema,
    connection: dict[str, Any],
    as_json: bool,
) -> None:
    """Send MESSAGE to VEHICLE, for example: shoal send lauv-noptilus-1 QueryEntityState --wait 1s

    A value is a number, an angle such as 15deg or 41.1850000°, the name of an enumerated value, a text, hexadecimal
    digits for rawdata, or JSON for a message inside:
    maneuver='{"abbrev": "Goto", "lat": "41.185°", "lon": "-8.706°"}'. With --wait the exit status is 1 if no reply
    comes.

    \b
    shoal send lauv-noptilus-1 DesiredSpeed value=1.2 --rate 10 --for 5s

    With --rate each is a new message, and the vehicle executes each. Without --count and --for, Ctrl-C ends
    it. VEHICLE is a name, several with commas, or a pattern in quotes such as 'lauv-*'; rate and count are of each.
    """
    if rate is None and not (count is None and duration is None):
        raise click.UsageError("--count and --for need --rate")
    if count is not None and duration is not None:
        raise click.UsageError("use either --count or --for")
    message, single = build_message(name, assignments, schema), bool(vehicle.single_name)

    async def act(there: AsyncRemoteVehicle) -> int:
        listener = there.network.listen(there.system, () if wait is not None else (imc.LogBookEntry,))
        replies = ReplyDisplay(there, listener, as_json, "" if single else there.name, shows=wait is not None)
        began = time.monotonic()
        await there.send(message)
        sent = 1
        if rate is not None:
            replying = asyncio.create_task(replies.show_all()) if wait is not None else None
            try:
                sent += await _repeat(there, message, rate, count, duration)
            finally:
                if replying is not None:
                    replying.cancel()
                    with suppress(asyncio.CancelledError):
                        await replying
        if not as_json:
            times = f" {sent} times in {time.monotonic() - began:.1f} s" if rate is not None else ""
            click.echo(f"sent {type(message).__name__} to {there.name}{times}")
        with suppress(TimeoutError):
            async with asyncio.timeout(max(wait or 0.0, FLIGHT)):
                await replies.show_all()
        return replies.count

    results = run_on_selection(vehicle, {**connection, "messages": schema}, act, on_error=print_error)
    silent = [result.name for result in results if wait is not None and result.value == 0]
    for each in silent:
        click.echo(f"{printable(each)} sent no reply within {wait:g} s", err=True)
    if silent or any(result.error for result in results):
        raise click.exceptions.Exit(1)


async def _repeat(
    there: AsyncRemoteVehicle, message: imc.Message, rate: float, count: int | None, duration: float | None
) -> int:
    """Send copies after the first one, at times that do not drift; returns how many. Raises VehicleLost.

    What is late is sent at once, but not what is late by more than a period: a burst would not be a rate.
    """
    began, slot, sent = time.monotonic(), 1, 0
    while count is None or sent < count - 1:
        if duration is not None and slot >= duration * rate:
            break
        await asyncio.sleep(max(0.0, began + slot / rate - time.monotonic()))
        there.network.check_is_there(there.system)
        there.network.send(there.system, message)
        sent += 1
        slot = max(slot + 1, int((time.monotonic() - began) * rate))
    return sent


class ReplyDisplay:
    """Prints messages of the vehicle to this program, and counts them, if it `shows` anything. Raises Unlisted.

    `name` is that of one of several vehicles.
    """

    def __init__(
        self, vehicle: AsyncRemoteVehicle, listener: MessageListener, as_json: bool, name: str, *, shows: bool
    ) -> None:
        self.count: int = 0
        self._shows = shows
        self._name, self._say = name, prefixed(name) if name else click.echo
        self._vehicle, self._listener, self._as_json = vehicle, listener, as_json

    async def show_all(self) -> None:
        """Print replies for ever."""
        while True:
            _, reply = await self._listener.next()
            if reply.src != self._vehicle.id or reply.dst != self._vehicle.network.console.id:
                continue
            self._vehicle.network.raise_if_unlisted(reply)
            if not self._shows:
                continue
            self.count += 1
            if self._as_json:
                values = json.loads(reply.to_json())
                print_json_line({"vehicle": self._name, **values} if self._name else values)
            else:
                self._say(format_message(self._vehicle, reply))


def build_message(name: str, assignments: tuple[str, ...], schema: imc.Schema) -> imc.Message:
    """The message of a name and texts such as depth=2. Raises UsageError that names field and mistake."""
    kind = find_message_type(name, schema)
    infos = {field.name: field for field in imc.fields(kind)}
    values: dict[str, Any] = {"abbrev": kind.__name__}
    for assignment in assignments:
        field, equals, text = assignment.partition("=")
        field = field.strip()
        if not equals:
            raise click.UsageError(f"{assignment!r} is not FIELD=VALUE")
        if field in values:
            raise click.UsageError(f"{field} is given twice")
        if field not in infos:
            hint = suggestion(field, infos) or f"`shoal message {kind.__name__}` lists them"
            raise click.UsageError(f"{kind.__name__} has no field {field!r}; {hint}")
        values[field] = parse_value(infos[field], text, schema)
    try:
        message = imc.from_json(json.dumps(values), schema)
        imc.encode(message)
    except (imc.DecodeError, imc.EncodeError, ValueError) as error:
        raise click.UsageError(str(error)) from None
    return message
