"""Publishes packets: telemetry without waiting, commands reliably, states also for those who join later."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from runtime.zenoh.key_expressions import Delivery, Publication

if TYPE_CHECKING:
    import zenoh

ENCODING = "application/octet-stream;imc/5.4.31"
URGENT = frozenset({"Abort"})
LATCHED = (
    "Announce",
    "EntityList",
    "EntityParameters",
    "LoggingControl",
    "OperationalLimits",
    "PlanControlState",
    "PlanDBState",
    "VehicleState",
)
"""States, of which a receiver wants the present one as soon as it joins."""
HEARTBEAT = 1.0  # s after which a receiver notices that it has missed the last state
SETTLING = 10.0  # s in which a new publisher learns who receives its packets, also over a slow link

MOST_PUBLISHERS = 4096


@dataclass(slots=True)
class Publisher:
    """One declared publisher, and its last packet; a `reliable` one may wait for a receiver."""

    put: Callable[[bytes], object]
    undeclare: Callable[[], object] = lambda: None
    reliable: bool = False
    last: bytes = b""


class NumberedPublisher:
    """Numbers the packets of a publisher, so that receivers can count those they missed.

    Packets without receivers are numbered, but not put: each would hand the interpreter to other threads. A new
    publisher puts all, since zenoh may not have found its receivers yet. With `always` receivers are not checked.
    """

    __slots__ = ("_has_receivers", "_listener", "_number", "_put", "_source", "_stamp", "_trusted")

    def __init__(self, publisher: "zenoh.Publisher", *, always: bool = False) -> None:
        import zenoh

        self._put: Callable[..., object] = cast(Any, publisher).put
        self._source = publisher.id
        self._stamp = zenoh.SourceInfo
        self._number = 0
        self._has_receivers = always
        self._trusted = time.monotonic() + SETTLING
        if not always:
            listen: Any = publisher.declare_matching_listener
            self._listener = listen(zenoh.handlers.Callback(self._note, indirect=False))

    def put(self, packet: bytes) -> None:
        self._number = (self._number + 1) & 0xFFFFFFFF
        if self._has_receivers or time.monotonic() < self._trusted:
            self._put(packet, source_info=self._stamp(self._source, self._number))

    def _note(self, status: "zenoh.MatchingStatus") -> None:
        """Note whether the packets have receivers; called from zenoh's thread."""
        self._has_receivers = status.matching


class Publishers:
    """The publishers of a session. The states of `vehicle` have zenoh's advanced publishers."""

    def __init__(self, session: "zenoh.Session", vehicle: str) -> None:
        self._session = session
        self._vehicle = vehicle
        self._declared: dict[Publication, Publisher] = {}
        self._states: dict[Publication, Publisher] = {}

    def __len__(self) -> int:
        return len(self._declared) + len(self._states)

    def get(self, publication: Publication) -> Publisher:
        """The publisher of these packets. Raises zenoh.ZError if it cannot be declared."""
        return self._declared.get(publication) or self._states.get(publication) or self._declare(publication)

    def last_packets(self) -> list[tuple[Publication, bytes]]:
        """The last packet for all of each message, source and entity. Called from any thread."""
        declared = {**self._states.copy(), **self._declared.copy()}
        return [
            (publication, publisher.last)
            for publication, publisher in declared.items()
            if publication.delivery is Delivery.BROADCAST and publisher.last
        ]

    def close(self) -> None:
        """Undeclare the publishers but those of states, which end with the session.

        zenoh waits for their heartbeat task without releasing the interpreter, which other tasks may be waiting for.
        """
        for publisher in self._declared.values():
            publisher.undeclare()
        self._declared.clear()

    def _declare(self, publication: Publication) -> Publisher:
        broadcast = publication.delivery is Delivery.BROADCAST
        if broadcast and publication.message in LATCHED and publication.source == self._vehicle:
            return self._states.setdefault(publication, self._state(publication))
        if len(self._declared) >= MOST_PUBLISHERS:  # a relay can bring packets of ever more sources
            self._declared.pop(next(iter(self._declared))).undeclare()
        return self._declared.setdefault(publication, self._numbered(publication))

    def _numbered(self, publication: Publication) -> Publisher:
        import zenoh

        urgent = publication.delivery is Delivery.ADDRESSED or publication.message in URGENT
        publisher = self._session.declare_publisher(
            publication.key,
            encoding=ENCODING,
            congestion_control=zenoh.CongestionControl.BLOCK if urgent else zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME if urgent else zenoh.Priority.DATA,
            allowed_destination=zenoh.Locality.REMOTE,
        )
        return Publisher(NumberedPublisher(publisher, always=urgent).put, cast(Any, publisher).undeclare, urgent)

    def _state(self, publication: Publication) -> Publisher:
        """Keeps its last packet for those who join later or have missed it; zenoh numbers the packets."""
        import zenoh.ext

        publisher: Any = zenoh.ext.declare_advanced_publisher(
            self._session,
            publication.key,
            encoding=ENCODING,
            congestion_control=zenoh.CongestionControl.DROP,
            cache=zenoh.ext.CacheConfig(1),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=HEARTBEAT),
            publisher_detection=True,
        )
        return Publisher(publisher.put)
