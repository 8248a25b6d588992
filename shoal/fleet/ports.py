"""Ports, and a MAVLink id, of its own for each vehicle of a fleet on one computer."""

import re

from mavlink import SYSTEMS, system_of
from runtime.profile import Profile
from runtime.vehicle import find_task

STEP = 10  # ports between two vehicles: some tasks take the next free one of a few
PORTS = ("Local Port", "Port", "Control Port")
LINKS = "Links"
SYSTEM_ID = "Transports.MAVLink", "System Id"
_WAITING = re.compile(r"(\b(?:udpin|tcpin|tcp-server):[^:,\s]*:)(\d{1,5})")


def own_ports(profile: Profile, place: int) -> list[str]:
    """Overrides that move all ports at which a profile's transports listen, for the vehicle at this place, from 0."""
    found: list[str] = []
    for section in profile.config.sections.values() if place else ():
        cls = find_task(section.name) if section.name.startswith("Transports.") else None
        if cls is None:
            continue
        for parameter in cls.parameters().values():
            text = section.value(parameter.name) or parameter.format(parameter.default)
            if parameter.name in PORTS and text.isdecimal() and int(text):
                found.append(f"{section.name}:{parameter.name}={moved(int(text), place)}")
            elif parameter.name == LINKS and _WAITING.search(text):
                links = _WAITING.sub(lambda match: f"{match[1]}{moved(int(match[2]), place)}", text)
                found.append(f"{section.name}:{parameter.name}={links}")
    return found


def moved(port: int, place: int) -> int:
    """The port of the vehicle at a place; beyond the last one they begin again at 1024."""
    return 1024 + (port - 1024 + STEP * place) % (65536 - 1024)


def own_mavlink_id(profile: Profile, system: int, taken: set[int]) -> list[str]:
    """An override with the next free MAVLink id for an IMC system, if the one that it would have is `taken`.

    MAVLink has 250 ids for all vehicles; the chosen one is added to `taken`.
    """
    text = profile.config.value(*SYSTEM_ID)
    wanted = int(text) if text.isdecimal() and int(text) else system_of(system)
    number = next((n for n in ((wanted - 1 + step) % SYSTEMS + 1 for step in range(SYSTEMS)) if n not in taken), wanted)
    taken.add(number)
    section, option = SYSTEM_ID
    return [] if number == wanted or section not in profile.config.sections else [f"{section}:{option}={number}"]
