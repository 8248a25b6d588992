"""Joins the buses of several processes through zenoh; the key of a packet names its source."""

import atexit
import logging
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast
from urllib.parse import quote

import imc
from imc.addresses import UNKNOWN_SYSTEM
from imc.layout import LARGEST_PACKET
from runtime.zenoh.config import ZenohConfig, explain
from runtime.zenoh.meeting import MeetingPoint

if TYPE_CHECKING:
    import zenoh

PREFIX = "imc"
ENCODING = "application/octet-stream;imc/5.4.31"
SUBSCRIPTIONS = (f"{PREFIX}/**", f"{PREFIX}/*/@cmd/**")  # ** does not match chunks that begin with @
URGENT = frozenset({"Abort"})
LONGEST_CHUNK = 255

RING = 4096
MOST_PUBLISHERS = 4096
MOST_NUMBERS = 65536
CLOSING_TIME = 2.0  # s
REPORT_PERIOD = 10.0  # s

logger = logging.getLogger("shoal.zenoh")


def chunk(name: str) -> str:
    """A name as one chunk of a key, at most 255 characters long.

    Blanks become _, all characters except letters, digits and ._~- become %XX.
    """
    return quote("_".join(name.split()), safe="", errors="backslashreplace")[:LONGEST_CHUNK] or "_"


def key(message: str, source: str, entity: str, destination: str = "") -> str:
    """The key of a message (its abbreviation) from an entity (label or number) of a system.

    A message for all systems is at imc/<source>/<message>/<entity>, one for the system `destination` at
    imc/<destination>/@cmd/<message>/<source>.
    """
    if destination:
        return f"{PREFIX}/{chunk(destination)}/@cmd/{chunk(message)}/{chunk(source)}"
    return f"{PREFIX}/{chunk(source)}/{chunk(message)}/{chunk(entity)}"


class FaultCounter:
    """Counts one kind of fault; reports the first one, then at most once in REPORT_PERIOD seconds."""

    def __init__(self, what: str) -> None:
        self.total = 0
        self._what = what
        self._told = 0
        self._next = 0.0
        self._lock = threading.Lock()

    def count(self, detail: object, number: int = 1) -> None:
        with self._lock:
            self.total += number
            now = time.monotonic()
            if now < self._next:
                return
            self._next = now + REPORT_PERIOD
        self.tell(detail)

    def tell(self, detail: object = "") -> None:
        """Report what has not been reported yet."""
        if self.total > self._told:
            logger.warning("%d packets %s%s", self.total - self._told, self._what, f"; {detail}" if detail else "")
            self._told = self.total


class _Publisher:
    """A declared publisher that numbers its packets, so that receivers can count those they missed."""

    __slots__ = ("_number", "_put", "_source", "_stamp", "undeclare")

    def __init__(self, publisher: "zenoh.Publisher", stamp: "type[zenoh.SourceInfo]") -> None:
        self._put: Callable[..., object] = cast(Any, publisher).put
        self._source = publisher.id
        self._stamp = stamp
        self._number = 0
        self.undeclare: Callable[[], object] = cast(Any, publisher).undeclare

    def put(self, packet: bytes) -> None:
        self._number = (self._number + 1) & 0xFFFFFFFF
        self._put(packet, source_info=self._stamp(self._source, self._number))


class ZenohTransport:
    """A Transport between all processes of a bus, in whatever order they start.

    `system_name(id)` and `entity_label(system, entity)` give the names in keys; the number replaces an empty label.
    Counted: `lost`, packets of Shoal processes that did not arrive here (full queue, broken link); `oversize`, payloads
    larger than any packet; `unsent`, packets that zenoh refused.
    """

    def __init__(
        self, config: ZenohConfig, system_name: Callable[[int], str], entity_label: Callable[[int, int], str]
    ) -> None:
        self.config = config
        self.lost = FaultCounter("of other processes were lost on the way")
        self.oversize = FaultCounter("were too large for a packet and were dropped")
        self.unsent = FaultCounter("could not be sent")
        self._system_name = system_name
        self._entity_label = entity_label
        self._session: zenoh.Session | None = None
        self._meeting_point = MeetingPoint(config)
        self._listeners: list[tuple[zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]], threading.Thread]] = []
        self._publishers: dict[tuple[str, ...], _Publisher] = {}
        self._numbers: dict[tuple[zenoh.ZenohId, int], int] = {}

    def open(self, receive: Callable[[bytes], None]) -> None:
        """Join the bus; waits up to half a second for others.

        Raises ConnectionError if it cannot listen or, as a client, finds no router; ValueError for an invalid
        configuration file; ModuleNotFoundError without zenoh.
        """
        import zenoh

        self._meeting_point.open()
        try:
            self._session = session = zenoh.open(self.config.build()[0])
        except zenoh.ZError as error:
            self._meeting_point.close()
            raise ConnectionError(f"zenoh: {explain(error)}") from None
        atexit.register(self._abandon)  # an interpreter that ends while threads wait in zenoh aborts
        # Telemetry and commands have a ring and a thread each, so that a flood of telemetry does not displace commands.
        for expression in SUBSCRIPTIONS:
            ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(RING)
            subscriber = session.declare_subscriber(expression, ring, allowed_origin=zenoh.Locality.REMOTE)
            thread = threading.Thread(
                target=self._listen, args=(subscriber.handler, receive), name=expression, daemon=True
            )
            self._listeners.append((subscriber, thread))
            thread.start()

    def send(self, message: imc.Message, packet: bytes) -> None:
        """Publish a packet, which decodes to `message`. Drops it if a queue is full; never blocks, never raises."""
        session = self._session
        if session is None:
            return
        name = type(message).__name__ if not isinstance(message, imc.Unknown) else str(message.id)
        source = self._system_name(message.src)
        if message.dst == UNKNOWN_SYSTEM:
            names = (name, source, self._entity_label(message.src, message.src_ent) or str(message.src_ent))
        else:
            names = (name, source, "", self._system_name(message.dst))
        try:
            publisher = self._publishers.get(names) or self._declare(session, names)
            publisher.put(packet)
        except Exception as error:
            self.unsent.count(f"{name} of {source}: {error}")

    def close(self) -> None:
        """Leave the bus, within CLOSING_TIME seconds even if zenoh does not finish closing."""
        session, self._session = self._session, None
        if session is None:
            return
        atexit.unregister(self._abandon)
        closing = threading.Thread(target=self._leave, args=(session,), name="zenoh close", daemon=True)
        closing.start()
        closing.join(CLOSING_TIME)
        if closing.is_alive():
            logger.warning("zenoh did not close within %g s; not waiting for it", CLOSING_TIME)
        for tally in (self.lost, self.oversize, self.unsent):
            tally.tell()

    def _leave(self, session: "zenoh.Session") -> None:
        """Close the subscribers first: a session that closes before them may wait for them forever."""
        for subscriber, thread in self._listeners:
            cast(Any, subscriber).undeclare()
            thread.join(CLOSING_TIME / 4)
        self._listeners.clear()
        self._publishers.clear()
        cast(Any, session).close()
        self._meeting_point.close()

    def _abandon(self) -> None:
        session, self._session = self._session, None
        if session is not None:
            self._leave(session)

    def _declare(self, session: "zenoh.Session", names: tuple[str, ...]) -> _Publisher:
        import zenoh

        if len(self._publishers) >= MOST_PUBLISHERS:  # a relay can bring packets of ever more sources
            self._publishers.pop(next(iter(self._publishers))).undeclare()
        urgent = len(names) == 4 or names[0] in URGENT
        publisher = session.declare_publisher(
            key(*names),
            encoding=ENCODING,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME if urgent else zenoh.Priority.DATA,
        )
        return self._publishers.setdefault(names, _Publisher(publisher, zenoh.SourceInfo))

    def _listen(self, ring: "zenoh.handlers.Handler[zenoh.Sample]", receive: Callable[[bytes], None]) -> None:
        """Pass on packets until the subscriber is undeclared."""
        import zenoh

        while True:
            try:
                sample = ring.recv()
            except zenoh.ZError:
                return
            while sample is not None:
                if self._session is None:
                    return
                self._arrive(sample, receive)
                sample = ring.try_recv()

    def _arrive(self, sample: "zenoh.Sample", receive: Callable[[bytes], None]) -> None:
        if (source := sample.source_info) is not None:
            publisher = source.source_id.zid, source.source_id.eid
            number, last = source.source_sn, self._numbers.get(publisher)
            ahead = 1 if last is None else (number - last) & 0xFFFFFFFF
            if not 0 < ahead < 0x80000000:
                return  # a duplicate: two routers that both reach this process have both forwarded it
            if ahead > 1:
                self.lost.count(f"last at {sample.key_expr}", ahead - 1)
            if last is None and len(self._numbers) >= MOST_NUMBERS:
                self._numbers.clear()
            self._numbers[publisher] = number
        if len(sample.payload) > LARGEST_PACKET:
            self.oversize.count(f"last: {len(sample.payload)} bytes at {sample.key_expr}")
        else:
            receive(sample.payload.to_bytes())
