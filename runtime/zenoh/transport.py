"""Joins the buses of several processes through zenoh; the key of a packet names its source."""

import atexit
import logging
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import imc
from imc.addresses import UNKNOWN_SYSTEM
from imc.layout import LARGEST_PACKET
from runtime.zenoh.config import SESSIONS, Layout, ZenohConfig, explain
from runtime.zenoh.faults import FaultCounter
from runtime.zenoh.keys import PREFIX, key
from runtime.zenoh.meeting import MeetingPoint, is_held
from runtime.zenoh.presence import Part, Presence
from runtime.zenoh.scouting import Scout, hello

if TYPE_CHECKING:
    import zenoh

ENCODING = "application/octet-stream;imc/5.4.31"
SUBSCRIPTIONS = (f"{PREFIX}/**", f"{PREFIX}/*/@cmd/**")  # ** does not match chunks that begin with @
URGENT = frozenset({"Abort"})

RING = 4096
MOST_PUBLISHERS = 4096
MOST_NUMBERS = 65536
CLOSING_TIME = 2.0  # s
AT_ONCE = 64  # packets taken at a time, then a pause: the other threads of this process come to their turn
PAUSE = 0.002  # s

logger = logging.getLogger("shoal.zenoh")


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
    `part` is what of a vehicle runs here: another process that runs the same is refused, and packets in the name of the
    vehicle are taken only from processes that run its other parts. `tell` gets warnings, from any thread.
    Counted: `lost`, packets of Shoal processes that did not arrive here (full queue, broken link); `oversize`, payloads
    larger than any packet; `strange`, packets in the name of the vehicle from elsewhere; `unsent`, packets that zenoh
    refused.
    """

    def __init__(
        self,
        config: ZenohConfig,
        system_name: Callable[[int], str],
        entity_label: Callable[[int, int], str],
        *,
        part: Part | None = None,
        tell: Callable[[str], None] = logger.warning,
    ) -> None:
        self.config = config
        self.lost = FaultCounter("of other processes were lost on the way", tell)
        self.oversize = FaultCounter("were too large for a packet and were dropped", tell)
        self.strange = FaultCounter("in the name of this vehicle, but from other processes, were dropped", tell)
        self.unsent = FaultCounter("could not be sent", tell)
        self._part = part
        self._tell = tell
        self._system_name = system_name
        self._entity_label = entity_label
        self._session: zenoh.Session | None = None
        self._meeting_point = MeetingPoint(config)
        self._presence: Presence | None = None
        self._scout: Scout | None = None
        self._listeners: list[tuple[zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]], threading.Thread]] = []
        self._publishers: dict[tuple[str, ...], _Publisher] = {}
        self._numbers: dict[tuple[zenoh.ZenohId, int], int] = {}

    def open(self, receive: Callable[[bytes], None]) -> None:
        """Join the bus; waits up to a second for others.

        Raises ConnectionError if it cannot listen or, as a client, finds no router, or if the part already runs;
        ValueError for an invalid configuration file; ModuleNotFoundError without zenoh.
        """
        import zenoh

        self._meeting_point.open()
        try:
            self._session, layout = self._enter()
        except ConnectionError:
            self._meeting_point.close()
            raise
        session = self._session
        try:
            if self._part is not None:
                self._presence = Presence(session, self._part, self._tell)
                self._presence.confirm()
        except ConnectionError:
            self.close()
            raise
        for endpoint in layout.exposed:
            self._tell(
                f"zenoh: {endpoint} is open to others without certificates (mTLS) and access control: "
                "anyone who reaches it can listen to and command this vehicle; see docs/zenoh.md"
            )
        if layout.group:
            self._scout = Scout(layout.group, hello(str(session.info.zid()), layout.role, [layout.session]))
            self._scout.open()
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
        for tally in (self.lost, self.oversize, self.strange, self.unsent):
            tally.tell(report=logger.warning)  # the vehicle's log book has ended

    def _enter(self) -> tuple["zenoh.Session", Layout]:
        """A session at the first free of the ports where the sessions of this computer listen."""
        import zenoh

        for place in range(SESSIONS):
            layout = self.config.build(place)
            if layout.session and is_held(layout.session):
                continue
            try:
                return zenoh.open(layout.config), layout
            except zenoh.ZError as error:
                if not (layout.session and is_held(layout.session)):
                    raise ConnectionError(f"zenoh: {explain(error)}") from None
        raise ConnectionError(f"zenoh: all {SESSIONS} ports for the processes of this computer are in use")

    def _leave(self, session: "zenoh.Session") -> None:
        """Close the subscribers first: a session that closes before them may wait for them forever."""
        if self._scout is not None:
            self._scout.close()
        if self._presence is not None:
            self._presence.close()
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
            taken = 0
            while sample is not None:
                if self._session is None:
                    return
                self._arrive(sample, receive)
                taken += 1
                if taken % AT_ONCE == 0:
                    time.sleep(PAUSE)
                sample = ring.try_recv()

    def _arrive(self, sample: "zenoh.Sample", receive: Callable[[bytes], None]) -> None:
        source = sample.source_info
        if source is not None:
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
            return
        packet = sample.payload.to_bytes()
        if self._part is not None and _source(packet) == self._part.system and not self._is_sibling(source):
            self.strange.count(f"last at {sample.key_expr}")
            return
        receive(packet)

    def _is_sibling(self, source: "zenoh.SourceInfo | None") -> bool:
        siblings = self._presence.siblings if self._presence is not None else frozenset[str]()
        return source is not None and bool(siblings) and str(source.source_id.zid) in siblings


def _source(packet: bytes) -> int:
    """The system in the header of a packet."""
    return int.from_bytes(packet[14:16], "little" if packet[:1] == b"\x54" else "big")
