"""The last message of each type and entity, as replies to zenoh queries."""

import struct
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from imc.layout import OFFSETS
from runtime.zenoh.key_expressions import Publication, query_key

if TYPE_CHECKING:
    import zenoh

LATEST = float(0xFFFFFFFF)  # s since 1970: zenoh's times have 32 bits for them


class CachedPacket(NamedTuple):
    """A packet, and its time: of the answers of several processes at one key zenoh shows the newest."""

    packet: bytes
    stamp: "zenoh.Timestamp | None" = None


class LastValueCache:
    """The last messages that a session (zenoh id) has published, by the keys at which it is asked for.

    `packets` are the last ones by message, source and entity; `speaks_for` returns whether messages of an entity are
    this process's to publish.
    """

    def __init__(
        self,
        session: str,
        packets: Callable[[], Iterable[tuple[Publication, bytes]]],
        speaks_for: Callable[[int], bool],
    ) -> None:
        self._id = bytes.fromhex(session.zfill(32))[::-1]
        self._packets = packets
        self._speaks_for = speaks_for

    def answers(self, asked: "zenoh.KeyExpr") -> dict[str, CachedPacket]:
        """Last values by key: of each entity where the query names one, else the last of all of them."""
        found: dict[str, bytes] = {}
        latest: dict[str, tuple[float, bytes]] = {}
        for publication, packet in self._packets():
            message, source = publication.message, publication.source
            if not self._speaks_for(packet[OFFSETS["src_ent"]]):
                continue
            if asked.intersects(place := cast(Any, query_key(message, source, publication.entity))):
                found[place] = packet
            elif asked.intersects(place := cast(Any, query_key(message, source))):
                latest[place] = max(latest.get(place, (0.0, b"")), (packet_time(packet), packet))
        found.update((place, packet) for place, (_, packet) in latest.items())
        return {place: CachedPacket(packet, self._stamp(packet_time(packet))) for place, packet in found.items()}

    def _stamp(self, seconds: float) -> "zenoh.Timestamp | None":
        import zenoh

        if not 0.0 <= seconds <= LATEST:
            return None
        return zenoh.Timestamp(datetime.fromtimestamp(seconds, UTC), self._id)


def packet_time(packet: bytes) -> float:
    """The time stamp in the header of a packet, in s since 1970."""
    return struct.unpack_from("<d" if packet[:1] == b"\x54" else ">d", packet, OFFSETS["timestamp"])[0]
