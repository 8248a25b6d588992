"""The Announce of a vehicle: who and where it is, and its services as seen from one side of the network."""

from collections.abc import Iterable

import imc
from imc.coordinates import absolute_position
from imc.discovery import LOOPBACK, Service, Services
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.network_interfaces import EVERYWHERE, is_loopback_address

LOCAL, EXTERNAL = imc.AnnounceService.ServiceType.LOCAL, imc.AnnounceService.ServiceType.EXTERNAL
ANY = "imc+any"
SYSTEM_TYPES = tuple(kind.name.lower() for kind in imc.SystemType)


def announcement(name: str, system_type: str, state: imc.EstimatedState | None, services: str) -> imc.Announce:
    """The Announce of a vehicle. Position 0, 0 means unknown, as in DUNE."""
    lat, lon, height = absolute_position(state) if state is not None and (state.lat or state.lon) else (0.0, 0.0, 0.0)
    return imc.Announce(
        sys_name=name,
        sys_type=imc.SystemType[system_type.upper()],
        owner=UNKNOWN_SYSTEM,
        lat=lat,
        lon=lon,
        height=height,
        services=services,
    )


def is_for_log(announce: imc.Announce) -> bool:
    """Whether an Announce of this vehicle only begins a log: it names no run, and a console would take it for a second
    vehicle with the same id.
    """
    return not Services.parse(announce.services).uid


def custom_message_signatures(schema: imc.Schema) -> dict[int, str]:
    """The signatures of the messages that are not the built-in ones, by id."""
    usual = imc.builtin().types_by_id
    own = (schema.by_id(m.id) for m in schema.messages if usual.get(m.id) != m)
    return {kind.ID: imc.definition_checksum(kind) for kind in own}


def expand_any_transport(services: Iterable[Service]) -> list[Service]:
    """Services with each imc+any://NAME, which is for all transports, at each of them: imc+udp://127.0.0.1:6002/NAME."""
    each = list(services)
    transports = [service for service in each if service.scheme in ("imc+udp", "imc+tcp")]
    for everywhere in [service for service in each if service.scheme == ANY]:
        each.remove(everywhere)
        path = f"/{everywhere.address}{everywhere.path}".rstrip("/")
        each += [transport._replace(path=path) for transport in transports]
    return each


def loopback_services(offered: Iterable[tuple[Service, int]]) -> list[Service]:
    """The services for programs of this computer, of those with their `service_type`; 0.0.0.0 becomes 127.0.0.1."""
    return [
        service._replace(address=LOOPBACK) if service.address == EVERYWHERE else service
        for service, where in offered
        if where & LOCAL
    ]


def external_services(offered: Iterable[tuple[Service, int]], addresses: Iterable[str]) -> list[Service]:
    """The services for other computers; 0.0.0.0 becomes each of this computer's addresses in the network."""
    addresses = list(addresses)
    found: list[Service] = []
    for service, where in offered:
        if where & EXTERNAL and not is_loopback_address(service.address):
            places = addresses if service.address == EVERYWHERE else [service.address]
            found += [service._replace(address=address) for address in places]
    return found
