"""Receives packets: each once, those that were missed counted, and none that its sender may not send."""

import contextlib
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from imc.layout import LARGEST_PACKET, SMALLEST_PACKET
from runtime.zenoh.error_counter import ErrorCounter
from runtime.zenoh.key_expressions import PREFIX, key_chunk, relayed_messages_expression, subscription_keys
from runtime.zenoh.packet_authorization import PacketAuthorizer
from runtime.zenoh.publishers import LATCHED
from support.duplicate_filter import DuplicateFilter

if TYPE_CHECKING:
    import zenoh

RING = 4096
MOST_PUBLISHERS = 65536
AT_ONCE = 256  # packets taken at a time, then as long a pause: the other threads of this process come to their turn
LONGEST_PAUSE = 0.005  # s; a process that was halted resumes at once
SETTLING = 0.05  # s in which a present state arrives by itself, in order; what is missing then is taken from the past
AGAIN = 0.5  # s; copies of one packet come within milliseconds
ENDING = 0.5  # s


@dataclass(slots=True)
class _Last:
    """The number of a publisher's last packet, and the zenoh id of its session."""

    number: int
    session: str


class Subscribers:
    """The subscribers of a session, and the threads that read them.

    `receive` gets the packets that `gate` lets pass; None lets all pass.
    """

    def __init__(
        self,
        receive: Callable[[bytes], None],
        gate: PacketAuthorizer | None,
        warn: Callable[[str], None],
    ) -> None:
        self.lost: ErrorCounter = ErrorCounter("of other processes were lost on the way", warn)
        self.oversize: ErrorCounter = ErrorCounter("were too large for a packet and were dropped", warn)
        self.rejected: ErrorCounter = ErrorCounter("of others that may not send them were dropped", warn)
        self._receive = receive
        self._gate = gate
        self._last: dict[tuple[zenoh.ZenohId, int], _Last] = {}
        self._latest = DuplicateFilter(64, AGAIN)
        self._lock = threading.Lock()
        self._own = ""  # the zenoh id of this session
        self._closed = threading.Event()
        self._states: queue.Queue[zenoh.Sample | None] = queue.Queue(RING)
        self._subscribers: list[Any] = []
        self._threads: list[threading.Thread] = []

    def open(self, session: "zenoh.Session", vehicle: str, messages: tuple[str, ...] | None) -> None:
        """Subscribe to what concerns a vehicle, and to `messages` of other systems, None for all.

        Telemetry and commands have a ring and a thread each, so that a flood of telemetry does not displace commands.
        """
        import zenoh
        import zenoh.ext

        self._own = str(session.info.zid())
        for_all, commands = subscription_keys(vehicle, messages)
        of_siblings = [] if self._gate is None else [relayed_messages_expression(vehicle)]
        for expression in (*for_all, *commands, *of_siblings):
            ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(RING)
            subscriber = session.declare_subscriber(expression, ring, allowed_origin=zenoh.Locality.REMOTE)
            self._subscribers.append(subscriber)
            self._begin(expression, self._read, subscriber.handler)
        for message in LATCHED:
            whose = "*" if messages is None or message in messages else key_chunk(vehicle)
            self._subscribers.append(
                zenoh.ext.declare_advanced_subscriber(
                    session,
                    f"{PREFIX}/{whose}/{message}/*",
                    zenoh.handlers.Callback(self._note_state, indirect=False),
                    allowed_origin=zenoh.Locality.REMOTE,
                    history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
                    recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
                )
            )
        self._begin("zenoh states", self._read_states)

    def close(self) -> None:
        """Undeclare the subscribers, and wait for the threads."""
        self._closed.set()
        for subscriber in self._subscribers:
            subscriber.undeclare()
        with contextlib.suppress(queue.Full):
            self._states.put_nowait(None)
        for thread in self._threads:
            thread.join(ENDING)
        self._subscribers.clear()

    def receive(self, sample: "zenoh.Sample") -> None:
        """Pass on the packet of a sample, unless it has arrived before, is too large, or not its sender's to send."""
        source, name, place = sample.source_info, "", str(sample.key_expr)
        if source is not None:
            whose, number = source.source_id, source.source_sn
            publisher = whose.zid, whose.eid
            with self._lock:
                last = self._last.get(publisher)
                if last is None:
                    last = self._meet(publisher, number)
                ahead = (number - last.number) & 0xFFFFFFFF
                if not 0 < ahead < 0x80000000:
                    return  # a duplicate: of a state, or two routers that both reach this process have forwarded it
                last.number, name = number, last.session
            if name == self._own:
                return  # a state of our own: behind a router that has started again we look like a late publisher
            if ahead > 1:
                self.lost.count(f"last at {place}", ahead - 1)
        payload = sample.payload
        if len(payload) > LARGEST_PACKET:
            self.oversize.count(f"last: {len(payload)} bytes at {place}")
            return
        packet = payload.to_bytes()
        gate = self._gate if len(packet) >= SMALLEST_PACKET else None
        if gate is not None and (why := gate.reject_reason(place, packet, name)):
            self.rejected.count(f"last at {place}: {why}")
            return
        if gate is not None and gate.is_of_unlisted_console(place, packet, name):
            return
        if "*" in place and not self._is_new(packet):
            return  # a key with wildcards reaches several subscribers
        self._receive(packet)

    def _is_new(self, packet: bytes) -> bool:
        """Whether a packet has not just come; the same one may be sent again later."""
        with self._lock:
            return not self._latest.is_duplicate(packet, time.monotonic())

    def _meet(self, publisher: "tuple[zenoh.ZenohId, int]", number: int) -> "_Last":
        if len(self._last) >= MOST_PUBLISHERS:
            self._last.clear()
        last = self._last[publisher] = _Last((number - 1) & 0xFFFFFFFF, str(publisher[0]))
        return last

    def _begin(self, name: str, function: Callable[..., None], *arguments: object) -> None:
        thread = threading.Thread(target=function, args=arguments, name=name, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _read(self, ring: "zenoh.handlers.Handler[zenoh.Sample]") -> None:
        """Pass on packets until the subscriber is undeclared."""
        import zenoh

        with contextlib.suppress(zenoh.ZError):
            while True:
                sample, taken, began = ring.recv(), 0, time.perf_counter()
                while sample is not None:
                    if self._closed.is_set():
                        return
                    self.receive(sample)
                    taken += 1
                    if taken % AT_ONCE == 0:
                        time.sleep(min(LONGEST_PAUSE, time.perf_counter() - began))
                        began = time.perf_counter()
                    sample = ring.try_recv()

    def _note_state(self, sample: "zenoh.Sample") -> None:
        """Called from zenoh's thread; it must not wait. What does not fit comes again with the next heartbeat."""
        with contextlib.suppress(queue.Full):
            self._states.put_nowait(sample)

    def _read_states(self) -> None:
        """Pass on states that have not arrived otherwise: those published before we joined, and those missed."""
        while (sample := self._states.get()) is not None and not self._closed.wait(SETTLING):
            self.receive(sample)
            for _ in range(self._states.qsize()):
                if (sample := self._states.get()) is None:
                    return
                self.receive(sample)
