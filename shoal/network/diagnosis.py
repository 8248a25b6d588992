"""Finds out why packets of two systems do not arrive: received, answered, dropped, and why."""

import asyncio
import math
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field

import imc
from shoal.network.link import NoAnswer, Unlisted, VehicleLost
from shoal.network.message_listener import MessageListener
from shoal.network.network import COMPANY, Network
from shoal.network.system_table import CONTACT, NetworkSystem
from support.diagnostics import Finding

PROBES = 5
ENOUGH = 2  # probes without any answer
PATIENCE = 1.0  # s for the answer to a probe; a busy computer is no bad link
LAST_WORDS = 0.3  # s for a word in its log book
WELL = ("in contact", "within range", "new system")
APART = 2.0  # s between two clocks
LOSSY = 0.02  # part of the packets
CARRIERS = ("in contact", "dropped", "within range", "packets taken")
"""Words of entities about their network; no other message names the systems that a vehicle does not receive."""

UNREACHED = "a firewall closes its port; or its Consoles do not list us; or it has not received our Announce"
UNLISTED = "the name of our certificate or user is not in its Commanders, see [Zenoh]; or it is too busy"
TAKEN = "another program"
ADVICE = {
    "not announced": "its Announce does not get here: multicast 224.0.75.69, broadcast and the ports of discovery "
    "30100-30104 must be open; or it announces another address; or only every 10 s, and --for 11s receives it",
    "wrong CRC": "something on the way changes packets, or another protocol uses this port",
    "truncated": "a packet was cut on the way: datagrams above the MTU need a path that carries fragments",
    "synchronization": "this is not IMC: another program speaks to this port",
    "unknown message": "its messages are not ours: compare the versions of IMC, or name their file with --messages",
    "schema mismatch": "it defines this message in another way: compare the versions of IMC",
    "lost on the way": "the link is too slow for what the vehicle sends, or this program for what it asked for",
    "from ": "a second system uses its id, or it has two addresses and announces only one",
    TAKEN: "give each program its own (SHOAL_CONSOLE), and list all in Consoles",
    "this program is too slow": "ask for fewer messages",
    "announced without": "its transport for packets does not run, or listens nowhere",
    "announcement": "a program that does not speak IMC sends to the ports of discovery",
}


@dataclass
class Contact:
    """The measurements with one system: rates in packets/s, the round trip and the clock difference in s.

    `answered` of `asked` probes came back. `says` is the report of its own transports, `refusal` why it rejects orders.
    """

    name: str
    id: int | None
    rates: dict[str, float]
    age: float
    asked: int = 0
    answered: int = 0
    round_trip: float = math.nan
    clock: float = math.nan
    missed: dict[str, int] = field(default_factory=dict[str, int])
    says: dict[str, str] = field(default_factory=dict[str, str])
    is_vehicle: bool = True
    refusal: str = ""


@dataclass
class Diagnosis:
    """All that was found; without findings all is well. `links` has what is wrong with each network, or nothing."""

    links: dict[str, str]
    contacts: list[Contact] = field(default_factory=list[Contact])
    findings: list[Finding] = field(default_factory=list[Finding])


async def diagnose(network: Network, name: str = "", seconds: float = 2.5, patience: float = PATIENCE) -> Diagnosis:
    """Listen for some seconds, ask each vehicle or the one that is named, and judge; answers may take `patience` s."""
    network.subscribe(None, (imc.Heartbeat, imc.EntityState))
    if name:
        network.subscribe(None, (imc.EstimatedState, imc.VehicleState))
    await _await_contact(network, name)
    began = time.monotonic()
    before = {system.name: Counter(system.received) for system in network.systems.values()}
    await asyncio.sleep(seconds)
    past = time.monotonic() - began
    found = Diagnosis({link.name: link.trouble for link in network.links})
    chosen = [s for s in network.systems.values() if name in ("", s.name) and (s.last or s.parts or name)]
    contacts = [_contact(system, before.get(system.name, Counter()), past) for system in chosen]
    vehicles = [(s, c) for s, c in zip(chosen, contacts, strict=True) if s.is_vehicle and s.id is not None]
    await asyncio.gather(*(_probe(network, system, contact, patience) for system, contact in vehicles))
    found.contacts = contacts
    for system, contact in zip(chosen, contacts, strict=True):
        found.findings += _judge(network, system, contact)
    found.findings += _of_here(network, name, found)
    return found


async def _await_contact(network: Network, name: str) -> None:
    """Wait for who announces itself seldom, and for the first data of who has announced itself."""
    began = time.monotonic()
    while True:
        past = time.monotonic() - began
        there = [each for each in network.systems.values() if each.is_vehicle and name in ("", each.name)]
        there = [each for each in there if each.is_there]
        is_late = any(each.contact_timeout for each in there)
        enough = network.search.discovery_timeout + (CONTACT if there else 0.0)  # new ones may appear for ever
        if past > enough or (past > COMPANY and there and not is_late):
            return
        network.search.explain(past, there)
        await asyncio.sleep(0.05)


def _contact(system: NetworkSystem, before: Counter[str], past: float) -> Contact:
    rates = {link: (count - before[link]) / past for link, count in system.received.items()}
    return Contact(system.name, system.id, rates, system.age, clock=system.clock, is_vehicle=system.is_vehicle)


async def _probe(network: Network, system: NetworkSystem, contact: Contact, patience: float) -> None:
    """Ask a vehicle, and read its report on this program."""
    book = network.listen(system, (imc.LogBookEntry,))
    try:
        times = await _question(network, system, contact, patience)
        if not contact.answered:
            contact.says |= await _words_of_us(network, book)
    finally:
        network.close_listener(book)
    if times:
        contact.round_trip = sorted(times)[len(times) // 2]
    contact.missed = dict(system.missed)
    for state in system.latest_entity_messages(imc.EntityState):
        if any(words in state.description for words in CARRIERS):
            contact.says[system.label(state.src_ent)] = state.description


async def _question(network: Network, system: NetworkSystem, contact: Contact, patience: float) -> list[float]:
    """Questions that every vehicle answers, one after the other, each sent once; the times to the answers (s)."""
    times: list[float] = []
    for _ in range(PROBES):
        began = time.monotonic()
        contact.asked += 1

        def answer(message: imc.Message) -> bool | None:
            is_reply = isinstance(message, imc.EntityList) and message.op == imc.EntityList.Op.REPORT
            return True if is_reply and message.dst == network.console.id else None

        query = imc.EntityList(op=imc.EntityList.Op.QUERY)
        try:
            await network.request(system, query, (imc.EntityList,), answer, timeout=patience, repeat=patience)
        except Unlisted as refusal:
            contact.refusal = str(refusal)
            break
        except NoAnswer:
            if contact.asked == ENOUGH and not contact.answered:
                break
            continue
        except VehicleLost:
            break
        contact.answered += 1
        times.append(time.monotonic() - began)
    return times


async def _words_of_us(network: Network, book: MessageListener) -> dict[str, str]:
    """The entries about us in the log book of a system; it may be full of other entries."""
    with suppress(TimeoutError):
        async with asyncio.timeout(LAST_WORDS):
            while True:
                _, entry = await book.next()
                if isinstance(entry, imc.LogBookEntry) and f"0x{network.console.id:04X}" in entry.text:
                    return {"log book": entry.text}
    return {}


def _judge(network: Network, system: NetworkSystem, contact: Contact) -> list[Finding]:
    found: list[Finding] = []

    def add_finding(text: str, advice: str) -> None:
        found.append(Finding("error", text, remedy=advice, about=system.name))

    if clash := system.conflict_text:
        add_finding(clash, "end one, or give it another name and id")
    if not system.is_vehicle:
        return found
    rate = math.fsum(contact.rates.values())
    if not rate:
        says = "announces itself, but sends nothing to us" if system.parts else "has fallen silent"
        add_finding(
            f"{says}: nothing arrives from the vehicle",
            "a firewall closes our port; or its Consoles list does not have us; or its contact timeout has passed",
        )
    elif contact.refusal:
        add_finding(f"is received, but does not obey us: {contact.refusal}", "list our id in its [General] Consoles")
    elif contact.asked and not contact.answered:
        over_zenoh = contact.rates.get("zenoh", 0.0) == rate
        add_finding(
            "is received, but does not answer: nothing arrives from here", UNLISTED if over_zenoh else UNREACHED
        )
    elif contact.answered < contact.asked:
        lost = 100.0 * (1.0 - contact.answered / contact.asked)
        add_finding(
            f"answers only {contact.answered} of {contact.asked} questions ({lost:.0f} % lost)", "the link is bad"
        )
    if abs(contact.clock) > APART:
        ahead = "ahead of" if contact.clock > 0 else "behind"
        add_finding(
            f"its clock is {abs(contact.clock):.1f} s {ahead} ours",
            "set the clocks by NTP or GPS; a simulation on a scaled clock deviates by design",
        )
    total = sum(system.received.values())  # integers
    for reason, number in sorted(contact.missed.items()):
        if not reason.startswith("lost") or number > LOSSY * total:
            add_finding(f"{number} packets: {reason}", advice_for(reason))
    for entity, description in system.errors.items():
        add_finding(
            f"{entity} is not well{description and f': {description}'}",
            f"`shoal spy {system.name} LogBookEntry` shows why",
        )
    for entity, words in contact.says.items():
        ours = f"0x{network.console.id:04X}"
        for part in words.split(";"):
            if ours in part and not any(good in part for good in WELL):
                add_finding(
                    f"{entity} there reports on us: {part.strip()}", "see its report, and docs/running-vehicle.md"
                )
    return found


def _of_here(network: Network, name: str, found: Diagnosis) -> list[Finding]:
    """The problems that concern no system with a known name."""
    findings: list[Finding] = []
    working = [link for link, trouble in found.links.items() if not trouble]
    vehicles = [contact for contact in found.contacts if contact.is_vehicle]
    if not vehicles:
        whom = f"{name} is not" if name else "no vehicle is"
        findings.append(Finding("error", f"{whom} received", remedy="start it; `shoal ls` lists who is there"))
    for link, trouble in found.links.items():
        if trouble and (not working or not vehicles or network.expects_all):
            findings.append(Finding("error", f"{link}: {trouble}", remedy=_advice_for_link(link, trouble)))
    for link in network.links:
        if getattr(link, "deaf", False):
            text = "all ports of discovery are taken by other programs of this computer: no announcement is received"
            findings.append(
                Finding("error", text, remedy="end one of them; vehicles at ports 6002-6006 of this computer are asked")
            )
    for (peer, reason), number in sorted(network.unknown_drops.items()):
        findings.append(Finding("error", f"{number} packets: {reason}", remedy=advice_for(reason), about=peer))
    return findings


def _advice_for_link(link: str, trouble: str) -> str:
    if trouble.startswith(TAKEN):
        return advice_for(trouble)
    if "did not accept us" in trouble:
        return "name ours in --zenoh-config"
    if link.startswith("zenoh"):
        return "start a vehicle with --bus zenoh, or see --connect"
    return "see that a vehicle serves it there, and --connect"


def advice_for(reason: str) -> str:
    """The remedy for packets that were dropped for a reason."""
    return next((advice for start, advice in ADVICE.items() if reason.startswith(start)), "see docs/running-vehicle.md")
