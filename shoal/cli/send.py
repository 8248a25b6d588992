"""`shoal send`: sends a message to a running vehicle."""

import asyncio
import json
import math
import time
from collections.abc import Mapping
from typing import Any

import click

import imc
from shoal.cli.messages_option import messages_option
from shoal.cli.remote_command import (
    complete_message,
    find_message_type,
    format_clock_time,
    format_fields,
    json_option,
    network_options,
    parse_duration_option,
    print_json_line,
    run_on_vehicle,
    vehicle_argument,
)
from shoal.network import AsyncRemoteVehicle
from support.terminal_text import printable, suggestion


@click.command()
@vehicle_argument
@click.argument("name", metavar="MESSAGE", shell_complete=complete_message)
@click.argument("assignments", metavar="[FIELD=VALUE]...", nargs=-1)
@click.option(
    "--wait", callback=parse_duration_option, metavar="TIME", help="Show for this time what the vehicle replies to us."
)
@messages_option
@network_options
@json_option
def send(
    vehicle: str,
    name: str,
    assignments: tuple[str, ...],
    wait: float | None,
    schema: imc.Schema,
    connection: dict[str, Any],
    as_json: bool,
) -> None:
    """Send MESSAGE to VEHICLE, for example: shoal send lauv-noptilus-1 QueryEntityState --wait 1s

    A value is a number, an angle such as 15deg, the name of an enumerated value, a text, hexadecimal digits for
    rawdata, or JSON for a message inside:
    maneuver='{"abbrev": "IdleManeuver", "duration": 10}'. With --wait the exit status is 1 if no reply comes.
    """
    message = build_message(name, assignments, schema)

    async def act(there: AsyncRemoteVehicle) -> int:
        listener = there.network.listen(there.system, () if wait is not None else (type(message),))
        await there.send(message)
        if not as_json:
            click.echo(f"sent {type(message).__name__} to {there.name}")
        await asyncio.sleep(0.05)  # until the packet is out
        until, replies = time.monotonic() + (wait or 0.0), 0
        while (left := until - time.monotonic()) > 0.0:
            try:
                _, reply = await listener.next(left)
            except TimeoutError:
                break
            if reply.src != there.id or reply.dst != there.network.console.id:
                continue
            replies += 1
            if as_json:
                print_json_line(json.loads(reply.to_json()))
            else:
                entity = printable(there.system.label(reply.src_ent))
                click.echo(
                    f"{format_clock_time(reply.timestamp)} {type(reply).__name__} {entity}: {format_fields(reply)}"
                )
        return replies

    replies = run_on_vehicle(vehicle, {**connection, "messages": schema}, act)
    if wait is not None and not replies:
        click.echo(f"{vehicle} sent no reply within {wait:g} s", err=True)
        raise click.exceptions.Exit(1)


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
        values[field] = _value(infos[field], text)
    try:
        message = imc.from_json(json.dumps(values), schema)
        imc.encode(message)
    except (imc.DecodeError, imc.EncodeError, ValueError) as error:
        raise click.UsageError(str(error)) from None
    return message


def _value(field: imc.FieldInfo, text: str) -> Any:
    """The value in the JSON of the message. Raises UsageError."""
    kind = field.type
    members: Mapping[str, int] = field.enum.__members__ if field.enum is not None else {}
    what = f"one of {', '.join(members)}, and no whole number" if members else "a whole number"
    try:
        if kind == "plaintext":
            return text
        if kind == "rawdata":
            what = "bytes in hexadecimal digits, such as 00ff"
            return bytes.fromhex(text).hex()
        if kind.startswith("message"):
            what = 'JSON, such as {"abbrev": "IdleManeuver", "duration": 10}' + (" in [ ]" if kind != "message" else "")
            return json.loads(text)
        if kind.startswith("fp"):
            what = "an angle, such as 0.26 or 15deg" if field.unit == "rad" else "a number"
            return _real(text, field.unit)
        known = {name.lower(): int(value) for name, value in members.items()}
        total = 0
        for word in text.lower().split("|"):
            total |= known[word.strip()] if word.strip() in known else _whole(word)
        return total
    except ValueError:
        raise click.UsageError(f"{field.name}: {text[:80]!r} is not {what}") from None


def _real(text: str, unit: str) -> float | str:
    """A number, or what stands for it in JSON; angles in rad may be in degrees."""
    plain = text.strip().removesuffix("deg").removesuffix("°") if unit == "rad" else text
    value = float(plain) if plain == text.strip() else math.radians(float(plain))
    if math.isinf(value) and "inf" not in text.lower():
        raise ValueError("too large")
    return value if math.isfinite(value) else str(value)


def _whole(text: str) -> int:
    """A whole number; 0x10 is 16, and 010 is 10."""
    try:
        return int(text)
    except ValueError:
        return int(text, 0)
