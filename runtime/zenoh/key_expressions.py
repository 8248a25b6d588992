"""The keys of packets: system, message, entity or destination."""

from enum import Enum
from typing import NamedTuple
from urllib.parse import quote

from imc.reserved_ids import BROADCAST

PREFIX = "imc"
LONGEST_CHUNK = 255
ALL_SYSTEMS = f"0x{BROADCAST:04X}"
"""The name of the system that a message for all is addressed to, if it is not simply published."""
HEARD = "@heard"
"""Part of keys, below the name of a vehicle, for what it has received that is for all, over UDP for example."""


def key_chunk(name: str) -> str:
    """A name as one chunk of a key, at most 255 characters long.

    Blanks become _, all characters except letters, digits and ._~- become %XX.
    """
    return quote("_".join(name.split()), safe="", errors="backslashreplace")[:LONGEST_CHUNK] or "_"


class Delivery(Enum):
    """The receivers of packets, which decide the reliability."""

    BROADCAST = "for all systems"
    ADDRESSED = "for one system"
    RELAYED = "for the other processes of a vehicle, which has received it from elsewhere"


class Publication(NamedTuple):
    """The packets that one publisher sends: of a message (its abbreviation) from a system.

    Those for all are from one entity (label or number); the others name the system that they are for.
    """

    delivery: Delivery
    message: str
    source: str
    entity: str = ""
    destination: str = ""

    @property
    def key(self) -> str:
        """See `message_key`."""
        way = HEARD if self.delivery is Delivery.RELAYED else "@cmd"
        return message_key(self.message, self.source, self.entity, self.destination, way)


def message_key(message: str, source: str, entity: str, destination: str = "", way: str = "@cmd") -> str:
    """The key of a message (its abbreviation) from an entity (label or number) of a system.

    A message for all systems is at imc/<source>/<message>/<entity>, one for the system `destination` at
    imc/<destination>/@cmd/<message>/<source>, one for all that `destination` has received elsewhere at @heard instead.
    """
    if destination:
        return f"{PREFIX}/{key_chunk(destination)}/{way}/{key_chunk(message)}/{key_chunk(source)}"
    return f"{PREFIX}/{key_chunk(source)}/{key_chunk(message)}/{key_chunk(entity)}"


def subscription_keys(vehicle: str, messages: tuple[str, ...] | None) -> tuple[list[str], list[str]]:
    """Expressions of what a vehicle receives, published for all and as commands; see `hear` of ZenohConfig."""
    if messages is None:
        return [f"{PREFIX}/**"], [f"{PREFIX}/*/@cmd/**"]  # ** does not match chunks that begin with @
    for_all = [f"{PREFIX}/{key_chunk(vehicle)}/**", *(f"{PREFIX}/*/{key_chunk(message)}/*" for message in messages)]
    return for_all, [f"{PREFIX}/{key_chunk(system)}/@cmd/**" for system in (vehicle, ALL_SYSTEMS)]


def relayed_messages_expression(vehicle: str) -> str:
    """The expression of what other processes of a vehicle have received from systems that are not on the bus."""
    return f"{PREFIX}/{key_chunk(vehicle)}/{HEARD}/**"


def query_key(message: str, source: str, entity: str = "") -> str:
    """The key at which the last message of a type is asked for: of one entity, or the last of all of them."""
    last = f"/{key_chunk(entity)}" if entity else ""
    return f"{PREFIX}/{key_chunk(source)}/@q/{key_chunk(message)}{last}"


def alive_key(vehicle: str, system: int, process: str) -> str:
    """The liveliness token of a process of a vehicle that runs; "*" for all processes."""
    return f"{PREFIX}/{key_chunk(vehicle)}/@alive/{system:04x}/{process if process == '*' else key_chunk(process)}"
