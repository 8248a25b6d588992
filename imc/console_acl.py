"""Systems that may command a vehicle over networks that prove no identity, and the addresses they send from."""

from collections.abc import Callable, Iterable
from ipaddress import ip_address

import imc
from imc.discovery import check_address
from imc.reserved_ids import UNKNOWN_SYSTEM
from support.terminal_text import quoted
from support.token_bucket import TokenBuckets

REPORTS = frozenset(
    kind.ID
    for kind in (
        *(imc.Announce, imc.Heartbeat, imc.EntityInfo, imc.EntityState, imc.EstimatedState, imc.SimulatedState),
        *(imc.VehicleState, imc.PlanControlState, imc.GpsFix, imc.RemoteSensorInfo, imc.FuelLevel, imc.LogBookEntry),
        *(imc.AngularVelocity, imc.Acceleration, imc.EulerAngles, imc.Temperature, imc.Salinity, imc.WaterVelocity),
    )
)
"""Messages that any announced system may send, because no task obeys them: reports of other vehicles."""
OVER_ZENOH = "zenoh"
"""Stands for an address: zenoh does not report the source of a packet."""
MAVLINK = "mavlink:"
PAGE = "page:"
ANSWER_PERIOD = 1.0  # s between two answers to one console in the long run
ANSWERS = 4  # at once: a console asks for more than its user does
MOST_ANSWERED = 64
NOT_LISTED = "command of a console that is not listed"
GENERAL = "[General] Consoles"
CONTEXT = "Consoles"
"""The context of the LogBookEntry that answers an order of a system that is not listed."""


class ConsoleAcl:
    """The systems that may command; without any listed, all may.

    An item is the name or the id of a system, optionally with an address: `ccu-lsts-1-1`, `0x4101@10.0.0.5`,
    `0x4101@zenoh`; `mavlink:255` and `mavlink:255@10.0.0.5` are ground stations by their MAVLink system ids;
    `page:anna` is a user of the vehicle's page, `page:local` who opens the link that `shoal run` prints.
    `id_of(name)` is the id of a system. Raises ValueError for an item that is not in the syntax, or an unknown name.
    """

    def __init__(self, items: Iterable[str], id_of: Callable[[str], int | None]):
        items = list(filter(None, map(str.strip, items)))
        self.is_open: bool = not items
        self.listed: dict[int, set[str]] = listed_systems(
            (item for item in items if not item.startswith((MAVLINK, PAGE))), id_of
        )
        self.page_users: frozenset[str] = frozenset(
            item[len(PAGE) :].strip() for item in items if item.startswith(PAGE)
        )
        if "" in self.page_users:
            raise ValueError(f"{quoted(PAGE)} names no user of the page")
        self.stations: dict[int, set[str]] = _listed_stations(
            item[len(MAVLINK) :] for item in items if item.startswith(MAVLINK)
        )
        who = f"only {', '.join(items)} may" if items else "anyone who reaches it can"
        self.risk: str = f"{who} command the vehicle"

    def allows(self, system: int, address: str, kind: int) -> bool:
        """Whether to take a message, given the id of its type, from a system at an address, or OVER_ZENOH."""
        return self.is_open or kind in REPORTS or _is_at(self.listed.get(system, ()), address)

    def may_command(self, system: int) -> bool:
        """Whether a system may command from somewhere."""
        return self.is_open or system in self.listed

    def allows_station(self, system: int, address: str) -> bool:
        """Whether to obey a ground station, given its MAVLink system id and its address or serial device."""
        return self.is_open or _is_at(self.stations.get(system, ()), address)

    def allows_page_user(self, name: str) -> bool:
        """Whether to obey a user of the vehicle's page."""
        return self.is_open or name in self.page_users

    def allows_address(self, address: str) -> bool:
        """Whether an item names an address, for clients that show no id."""
        listed = (*self.listed.values(), *self.stations.values())
        return self.is_open or any(address in places for places in listed)


class OrderRefusals:
    """Answers to systems whose orders are not obeyed: a LogBookEntry, to each in the long run one in ANSWER_PERIOD.

    `place` is the section and option with the list.
    """

    def __init__(self, vehicle: str, system: int, place: str = GENERAL):
        self._system, self._place = system, f"{place} of {vehicle}"
        self._answered = TokenBuckets(1.0 / ANSWER_PERIOD, ANSWERS, MOST_ANSWERED)

    def answer(self, packet: bytes, now: float) -> bytes | None:
        """The packet to send to the source of an order that is not obeyed (s since 1970); None if it just got one."""
        source = imc.packet_source(packet)
        if source == UNKNOWN_SYSTEM or not self._answered[source].try_acquire(now):
            return None
        entry = imc.LogBookEntry(
            type=imc.LogBookEntry.Type.ERROR, htime=now, context=CONTEXT, text=self.reason(packet, source)
        )
        return imc.encode_with_header(entry, now, self._system, 0, source, imc.header(packet).src_ent)

    def reason(self, packet: bytes, source: int) -> str:
        """Reason why an order is not obeyed, for people."""
        return f"{message_type_name(imc.packet_id(packet))} of 0x{source:04X} rejected: not in {self._place}"


def message_type_name(number: int) -> str:
    """The name of a built-in type by its id, "message 4711" for an unknown one."""
    known = imc.builtin()
    return known.by_id(number).__name__ if number in known.types_by_id else f"message {number}"


def listed_systems(items: Iterable[str], id_of: Callable[[str], int | None]) -> dict[int, set[str]]:
    """The ids of systems by `NAME` or `NAME@ADDRESS`, and from where each may send; "" is anywhere.

    Raises ValueError for an item that is not in the syntax, or an unknown name.
    """
    found: dict[int, set[str]] = {}
    for item in filter(None, map(str.strip, items)):
        name, at, address = (part.strip() for part in item.partition("@"))
        if at and address != OVER_ZENOH:
            check_address(address)
        found.setdefault(_system(name, id_of), set()).add(address)
    return found


def _listed_stations(items: Iterable[str]) -> dict[int, set[str]]:
    found: dict[int, set[str]] = {}
    for item in items:
        name, at, place = (part.strip() for part in item.partition("@"))
        if not (name.isdecimal() and 0 < int(name) < 256):
            raise ValueError(f"{quoted(MAVLINK + item)}: {quoted(name)} is not a MAVLink system id from 1 to 255")
        if at and not place.startswith("/"):
            try:
                ip_address(place)
            except ValueError:
                raise ValueError(f"{quoted(place)} is neither an address nor a serial device") from None
        found.setdefault(int(name), set()).add(place)
    return found


def _is_at(places: Iterable[str], address: str) -> bool:
    return any(place in ("", address) for place in places)


def _system(name: str, id_of: Callable[[str], int | None]) -> int:
    found = id_of(name)
    if found is None:
        try:
            found = int(name, 0)
        except ValueError:
            raise ValueError(f"{quoted(name)} is not in [IMC Addresses]: give the id of the system instead") from None
    if not 0 <= found < 0xFFFF:
        raise ValueError(f"{quoted(name)} is not the id of a system")
    return found
