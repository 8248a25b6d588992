"""Joins the buses of several processes through zenoh; the key of a packet names its source."""

import atexit
import logging
import threading
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import imc
from imc.console_acl import ConsoleAcl
from imc.reserved_ids import ANNOUNCED, BROADCAST, UNKNOWN_SYSTEM
from runtime.zenoh.camera_frames import ZenohFrames
from runtime.zenoh.config import SESSIONS, SessionConfig, ZenohConfig, error_text
from runtime.zenoh.error_counter import ErrorCounter
from runtime.zenoh.key_expressions import Delivery, Publication
from runtime.zenoh.last_value_cache import LastValueCache
from runtime.zenoh.listen_endpoint_failover import ListenEndpointFailover, is_in_use
from runtime.zenoh.live_systems import LiveSystems
from runtime.zenoh.loopback_discovery import HelloSender, hello_message
from runtime.zenoh.packet_authorization import PacketAuthorizer
from runtime.zenoh.presence import Presence, ProcessPart
from runtime.zenoh.publishers import Publisher, Publishers
from runtime.zenoh.queryables import Queryables
from runtime.zenoh.reliable_queue import ReliableQueue
from runtime.zenoh.session_factory import SessionFactory
from runtime.zenoh.subscribers import Subscribers
from runtime.zenoh.unlisted_consoles import ANYBODY, UnlistedConsoles

if TYPE_CHECKING:
    import zenoh

CLOSING_TIME = 2.0  # s
TO_ALL = UNKNOWN_SYSTEM, ANNOUNCED

logger: logging.Logger = logging.getLogger("shoal.zenoh")


class ZenohTransport:
    """A Transport between all processes of a bus, in any order of starts.

    `system_name(id)` and `entity_label(system, entity)` give the names in keys; the number replaces an empty label.
    `system_id(name)` gives the id of a system that the profile lists, None for others.
    `part` is the part of a vehicle that runs here: another process of it is rejected, and packets in the name of the
    vehicle are taken only from processes that run its other parts. `concerns` returns whether the tasks that answer a
    request run here, or raises LookupError with the reason; `speaks_for` returns whether the last messages
    of an entity are this process's to publish. `consoles` may command. `note` gets the name of another process of the
    vehicle, and whether it has appeared or gone; `warn` gets warnings; both from any thread. `frames` carries those of
    the vehicle.
    Counted: in `subscribers`, `lost` packets of Shoal processes that did not arrive here (full queue, broken link),
    `oversize` payloads larger than any packet, and `rejected` packets that their senders may not send, see
    PacketAuthorizer; `unsent`, packets that zenoh rejected; in `consoles`, `rejected` orders of those not listed.
    """

    def __init__(
        self,
        config: ZenohConfig,
        system_name: Callable[[int], str],
        entity_label: Callable[[int, int], str],
        *,
        system_id: Callable[[str], int | None] = lambda _: None,
        part: ProcessPart | None = None,
        concerns: Callable[[imc.Message], bool] = lambda _: True,
        speaks_for: Callable[[int], bool] = lambda _: True,
        consoles: ConsoleAcl = ANYBODY,
        note: Callable[[str, bool], None] | None = None,
        warn: Callable[[str], None] = logger.warning,
    ) -> None:
        self.config = config
        self._live_systems = LiveSystems()
        vehicles, ids = config.security.vehicles or (), lambda: self._live_systems.ids
        self.consoles: UnlistedConsoles = UnlistedConsoles(consoles, part, warn, self._send_refusal)
        gate = None
        if part is not None:
            gate = PacketAuthorizer(
                part, vehicles, ids, system_name, self._is_sibling, system_id, consoles=self.consoles
            )
        self.subscribers: Subscribers = Subscribers(self._take, gate, warn)
        self.unsent: ErrorCounter = ErrorCounter("could not be sent", warn)
        self._part = part
        self._concerns = concerns
        self._speaks_for = speaks_for
        self._note = note
        self._warn = warn
        self._system_name = system_name
        self._entity_label = entity_label
        self._session: zenoh.Session | None = None
        self._session_factory = SessionFactory(warn)
        self._rendezvous = ListenEndpointFailover(config, self._session_factory)
        self._presence: Presence | None = None
        self._hello_sender: HelloSender | None = None
        self._publishers: Publishers | None = None
        self._reliable_queue = ReliableQueue(self.unsent)
        self._queryables: Queryables | None = None
        self._short: dict[tuple[type, int, int, int], Publisher] = {}
        self.frames: ZenohFrames | None = None if part is None else ZenohFrames(part.vehicle, self._is_sibling, warn)
        self._receive: Callable[[bytes], None] = lambda _: None

    def open(self, receive: Callable[[bytes], None]) -> None:
        """Join the bus; waits half a second for others, and some seconds for those that do not answer.

        Raises ConnectionError if it cannot listen or, as a client, finds no router, or if the part already runs;
        ValueError for an invalid configuration file; ModuleNotFoundError without zenoh.
        """
        self._receive = receive
        self._rendezvous.open()
        try:
            self._session, layout, neighbors = self._enter()
        except ConnectionError:
            self._session_factory.stop_link_timeout()
            self._rendezvous.close()
            raise
        session = self._session
        try:
            if self._part is not None:
                self._presence = Presence(session, self._part, self._warn, self._note)
                self._presence.check_unique(neighbors)
        except ConnectionError:
            self.close()
            raise
        for endpoint in layout.exposed:
            self._warn(
                f"zenoh: {endpoint} is open to others without certificates (mTLS) and access control: "
                "anyone who reaches it can listen to and command this vehicle; see docs/zenoh.md"
            )
        for doubt in self.config.security.warnings(layout.listen, layout.connect):
            self._warn(f"[Zenoh] {doubt}")
        if layout.group:
            self._hello_sender = HelloSender(
                layout.group, hello_message(str(session.info.zid()), layout.role, [layout.session])
            )
            self._hello_sender.open()
        atexit.register(self._abandon)  # an interpreter that ends while threads wait in zenoh aborts
        self._reliable_queue.open()
        self._publishers = Publishers(session, self.config.vehicle)
        last = LastValueCache(str(session.info.zid()), self._publishers.last_packets, self._speaks_for)
        self._live_systems.open(session)
        self._queryables = Queryables(
            session, self._part, self._reliable_queue, last, self._take, self._concerns, self.consoles
        )
        self.subscribers.open(session, self.config.vehicle, self.config.hear)
        if self.frames is not None:
            self.frames.open(session, shares_memory=self._session_factory.shares)

    @property
    def systems(self) -> frozenset[int]:
        """The vehicles that are on this bus themselves."""
        return self._live_systems.systems

    def send(self, message: imc.Message, packet: bytes) -> None:
        """Publish a packet, which decodes to `message`. Drops it if a queue is full; never blocks, never raises.

        What another vehicle on this bus has sent here by another way is not published again. What another system has
        sent here that is for all goes to the other processes of this vehicle only: other vehicles receive it
        themselves.
        """
        if self._session is None or self._queryables is None:
            return
        place = type(message), message.src, message.src_ent, message.dst
        if self._queryables.is_handling and isinstance(message, imc.LogBookEntry):
            self._queryables.add_remark(message)
        try:
            publisher = self._short.get(place)
            if publisher is None:
                if message.src in self._live_systems.systems and not self._is_own(message.src):
                    return
                publisher = self._publisher(message, place)
            publisher.last = packet
            if publisher.reliable:
                self._queryables.forward_reply(message, packet)
                self._reliable_queue.put(type(message).__name__, partial(publisher.put, packet))
            else:
                publisher.put(packet)
        except Exception as error:
            self._short.pop(place, None)
            self.unsent.count(f"{type(message).__name__} of {self._system_name(message.src)}: {error}")

    def _send_refusal(self, system: int, packet: bytes) -> None:
        """Send a console the reason why its order is not obeyed."""
        if self._part is not None and self._publishers is not None:
            place = Publication(
                Delivery.ADDRESSED, "LogBookEntry", self._part.vehicle, destination=self._system_name(system)
            )
            self._reliable_queue.put(f"refusal to {place.destination}", partial(self._put, place, packet))

    def _put(self, place: Publication, packet: bytes) -> None:
        if self._publishers is not None:
            self._publishers.get(place).put(packet)

    def _publisher(self, message: imc.Message, place: tuple[type, int, int, int]) -> Publisher:
        """The publisher of a message by its names; the way to it is remembered if these do not change any more."""
        assert self._publishers is not None
        name = type(message).__name__ if not isinstance(message, imc.Unknown) else str(message.id)
        source = self._system_name(message.src)
        own = self._is_own(message.src)
        if self._part is not None and not own and message.dst in (*TO_ALL, BROADCAST):
            return self._publishers.get(Publication(Delivery.RELAYED, name, source, destination=self._part.vehicle))
        if message.dst not in TO_ALL:
            return self._publishers.get(
                Publication(Delivery.ADDRESSED, name, source, destination=self._system_name(message.dst))
            )
        label = self._entity_label(message.src, message.src_ent)
        publisher = self._publishers.get(Publication(Delivery.BROADCAST, name, source, label or str(message.src_ent)))
        if own and label and not isinstance(message, imc.Unknown):
            self._short[place] = publisher
        return publisher

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
        for tally in (self.subscribers.lost, self.subscribers.oversize, self.subscribers.rejected, self.unsent):
            tally.report_final(self._whose, logger.warning)  # the vehicle's log book has ended
        if self.consoles.rejected:
            logger.warning("%s: %d orders rejected, see [General] Consoles", self._whose, self.consoles.rejected)
        if self.consoles.dropped:
            text = "%s: %d messages of other vehicles dropped, see [General] Consoles"
            logger.warning(text, self._whose, self.consoles.dropped)

    def _enter(self) -> tuple["zenoh.Session", SessionConfig, list[str]]:
        """A session at the first free of the ports where the sessions of this computer listen, and those that do."""
        import zenoh

        held: list[str] = []
        for place in range(SESSIONS):
            layout = self.config.build(place)
            if layout.session and is_in_use(layout.session):
                held.append(layout.session)
                continue
            try:
                return self._session_factory.open(layout.config), layout, held
            except zenoh.ZError as error:
                if not (layout.session and is_in_use(layout.session)):
                    where = f" cannot listen at {', '.join(layout.listen)}" if layout.listen else ""
                    raise ConnectionError(f"zenoh{where}: {error_text(error)}") from None
        raise ConnectionError(f"zenoh: all {SESSIONS} ports for the processes of this computer are in use")

    def _leave(self, session: "zenoh.Session") -> None:
        """Undeclare, then close: a session that closes before its subscribers may wait for them forever."""
        if self._hello_sender is not None:
            self._hello_sender.close()
        self._session_factory.stop_link_timeout()
        self._reliable_queue.close()
        declared = self._presence, self._live_systems, self._queryables, self.frames, self.subscribers, self._publishers
        for part in declared:
            if part is not None:
                part.close()
        cast(Any, session).close()
        self._rendezvous.close()

    def _abandon(self) -> None:
        session, self._session = self._session, None
        if session is not None:
            self._leave(session)

    @property
    def _whose(self) -> str:
        if self._part is None:
            return "zenoh"
        process = f", process {self._part.process}" if self._part.process != "main" else ""
        return f"{self._part.vehicle}{process}"

    def _take(self, packet: bytes) -> None:
        if self._session is not None:
            self._receive(packet)

    def _is_own(self, system: int) -> bool:
        return self._part is not None and system == self._part.system

    def _is_sibling(self, zid: str) -> bool:
        return self._presence is not None and zid in self._presence.siblings
