"""Ports, and a MAVLink id, of its own for each vehicle of a fleet on one computer."""

from collections.abc import Iterable

from mavlink import SYSTEMS, mavlink_system_id, parse_link_url
from runtime.profile import Profile, split_list
from runtime.vehicle import find_task

STEP = 10  # ports between two vehicles: some tasks take the next free one of a few
PORTS = ("Local Port", "Port", "Control Port")
LINKS = "Links"
SYSTEM_ID = "Transports.MAVLink", "System Id"
ENABLED = "Enabled"
MAVLINK_OFF = f"{SYSTEM_ID[0]}:{ENABLED}=Never"


def port_overrides(profile: Profile, place: int) -> list[str]:
    """Overrides that move all ports at which a profile's transports listen, for the vehicle at this place, from 0."""
    found: list[str] = []
    for section in profile.config.sections.values() if place else ():
        cls = find_task(section.name) if section.name.startswith("Transports.") else None
        if cls is None:
            continue
        for parameter in cls.parameters().values():
            text = section.value(parameter.name) or parameter.format(parameter.default)
            if parameter.name in PORTS and text.isdecimal() and int(text):
                found.append(f"{section.name}:{parameter.name}={shift_port(int(text), place)}")
            elif parameter.name == LINKS:
                links = ", ".join(shift_link(item.strip(), place) for item in text.split(","))
                found += [f"{section.name}:{parameter.name}={links}"] if links != text else []
    return found


def shift_link(text: str, place: int) -> str:
    """A link of MAVLink, with another port if the vehicle listens there."""
    try:
        route = parse_link_url(text)
    except ValueError:
        return text
    if not route.listens:
        return text
    head, options = text.partition("?")[::2] if "//" in text else text.rsplit(":", 1)
    mark = "?" if "//" in text else ":"
    head = f"{head.removesuffix(f':{route.port}')}:{shift_port(route.port, place)}"
    return f"{head}{mark}{options}" if options else head


def shift_port(port: int, place: int) -> int:
    """The port of the vehicle at a place; beyond the last one they begin again at 1024."""
    return 1024 + (port - 1024 + STEP * place) % (65536 - 1024)


def mavlink_id_overrides(profile: Profile, system: int, taken: set[int]) -> list[str]:
    """An override with the next free MAVLink id for an IMC system, if the one that it would have is `taken`.

    MAVLink has 250 ids for all vehicles; the chosen one is added to `taken`. Without a free one MAVLink is off.
    """
    wanted = mavlink_id(profile, system)
    if wanted is None:
        return []
    section, option = SYSTEM_ID
    for number in ((wanted - 1 + step) % SYSTEMS + 1 for step in range(SYSTEMS)):
        if number not in taken:
            taken.add(number)
            return [] if number == wanted else [f"{section}:{option}={number}"]
    return [MAVLINK_OFF]


def mavlink_id(profile: Profile, system: int, overrides: Iterable[str] = ()) -> int | None:
    """The MAVLink id of an IMC system with a profile; None if it never runs MAVLink."""
    section, option = SYSTEM_ID
    if section not in profile.config.sections:
        return None
    values = {name: profile.config.value(section, name) for name in (option, ENABLED)}
    for text in overrides:
        left, _, value = text.partition("=")
        name, _, changed = left.rpartition(":")
        if name.strip() == section and changed.strip() in values:
            values[changed.strip()] = value.strip()
    if split_list(values[ENABLED]) in ([], ["Never"]):
        return None
    number = values[option]
    return int(number) if number.isdecimal() and int(number) else mavlink_system_id(system)
