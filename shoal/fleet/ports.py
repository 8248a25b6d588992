"""Ports, and a MAVLink id, of its own for each vehicle of a fleet on one computer."""

from mavlink import SYSTEMS, system_of
from runtime.profile import Profile
from runtime.vehicle import find_task
from tasks.transports.mavlink_protocol.routes import parse_route

STEP = 10  # ports between two vehicles: some tasks take the next free one of a few
PORTS = ("Local Port", "Port", "Control Port")
LINKS = "Links"
SYSTEM_ID = "Transports.MAVLink", "System Id"


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
            elif parameter.name == LINKS:
                links = ", ".join(own_link(item.strip(), place) for item in text.split(","))
                found += [f"{section.name}:{parameter.name}={links}"] if links != text else []
    return found


def own_link(text: str, place: int) -> str:
    """A link of MAVLink, with another port if the vehicle listens there."""
    try:
        route = parse_route(text)
    except ValueError:
        return text
    if not route.listens:
        return text
    head, options = text.partition("?")[::2] if "//" in text else text.rsplit(":", 1)
    mark = "?" if "//" in text else ":"
    head = f"{head.removesuffix(f':{route.port}')}:{moved(route.port, place)}"
    return f"{head}{mark}{options}" if options else head


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
