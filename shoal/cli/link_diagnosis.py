"""`shoal link`: finds out why packets of a vehicle, or ours, do not arrive."""

import math
from dataclasses import asdict
from typing import Any

import click

import imc
from shoal.cli.console_tables import open_console
from shoal.cli.findings import print_findings
from shoal.cli.json_output import json_option, print_json_line
from shoal.cli.messages_option import messages_option
from shoal.cli.remote_command import complete_vehicle, network_options, run_on_network
from shoal.cli.time_texts import parse_duration_option
from shoal.network import Contact, Diagnosis, Network, diagnose
from support.terminal_text import printable

LISTEN = 2.5  # s


@click.command()
@click.argument("vehicle", required=False, shell_complete=complete_vehicle)
@click.option(
    "--for", "duration", callback=parse_duration_option, metavar="TIME", help="Listen for this time [default: 2.5s]."
)
@messages_option
@network_options
@json_option
def link(
    vehicle: str | None, duration: float | None, schema: imc.Schema, connection: dict[str, Any], as_json: bool
) -> None:
    """Diagnose the connection to VEHICLE, or to all systems: traffic both ways, drops with reasons, fixes.

    Exit status 0 if nothing is wrong, else 1.
    """

    async def act(network: Network) -> tuple[int, Diagnosis]:
        return network.console.id, await diagnose(network, vehicle or "", LISTEN if duration is None else duration)

    console, found = run_on_network({**connection, "messages": schema}, act)
    if as_json:
        findings = [{"about": each.about, "text": each.text, "advice": each.remedy} for each in found.findings]
        print_json_line({"console": console, **asdict(found), "findings": findings})
    else:
        click.echo(f"this console is 0x{console:04X}")
        for name, trouble in found.links.items():
            click.echo(printable(f"{name}: {trouble or 'works'}"))
        for contact in found.contacts:
            click.echo(printable(_line(contact)))
        print_findings(open_console(markup=False), found.findings)
        if not found.findings:
            click.echo("nothing is wrong")
    raise click.exceptions.Exit(1 if found.findings else 0)


def _line(contact: Contact) -> str:
    words = [contact.name, "" if contact.id is None else f"0x{contact.id:04X}"]
    words += [f"{rate:.1f} packets/s by {name}" for name, rate in contact.rates.items()]
    words += ["receives from us" if contact.answered else "receives nothing from us"] if contact.asked else []
    words += [f"{1e3 * contact.round_trip:.1f} ms there and back"] if math.isfinite(contact.round_trip) else []
    words += [f"clock {contact.clock:+.3f} s"] if math.isfinite(contact.clock) else []
    return "  ".join(word for word in words if word)
