"""Packets from other processes that wait for the kernel: bounded for each source, and served in turn."""

import struct
from collections import Counter, deque
from collections.abc import Callable
from threading import Lock

from imc import Abort
from imc.layout import LITTLE_ENDIAN, SMALLEST_PACKET
from imc.reserved_ids import ANNOUNCED, UNKNOWN_SYSTEM
from runtime.bus.drop_counter import DropCounter

MOST_OF_ONE = 1024  # packets of one source
MOST_SOURCES = 64  # with packets waiting; all further ones share a queue
MOST_BYTES = 1 << 24  # of all
MOST_BYTES_OF_ONE = 1 << 20

LITTLE, BIG = (struct.Struct(order + "2xH10xHxH").unpack_from for order in "<>")  # id, source, destination
ABORT = Abort.ID
TO_ALL = (UNKNOWN_SYSTEM, ANNOUNCED)

Place = tuple[int, bool]


class Request(bytes):
    """A packet whose sender waits for what becomes of it.

    `handled` is called in the kernel's thread, with True just before the handlers of the message run, and with False
    after the last one; not at all if the packet is dropped.
    """

    handled: Callable[[bool], object]

    def with_packet(self, packet: bytes) -> "Request":
        """The same request with another packet: this one without the bytes after its end."""
        other = Request(packet)
        other.handled = self.handled
        return other


class _Queue:
    """The packets of one source that wait, and how many bytes they have."""

    __slots__ = ("packets", "size")

    def __init__(self) -> None:
        self.packets: deque[bytes] = deque()
        self.size = 0


class PacketInbox:
    """Takes packets from any thread; a source that sends too much loses its own packets only.

    A source is a system as its packets name it; its commands (what is addressed to one system, or to BROADCAST) and
    Abort wait apart from what it publishes. Counted: `dropped`.
    """

    def __init__(self) -> None:
        self.dropped: DropCounter[int] = DropCounter(UNKNOWN_SYSTEM)
        self._queues: dict[Place, _Queue] = {}
        self._turns: deque[_Queue] = deque()  # those that are not empty, in the order in which they are served
        self._size = 0
        self._asked = False
        self._lock = Lock()

    def drain_dropped(self) -> Counter[int]:
        """Counts of packets dropped since the last call, by source."""
        with self._lock:
            return self.dropped.drain()

    def __len__(self) -> int:
        with self._lock:
            return sum(len(queue.packets) for queue in self._turns)

    def put(self, packet: bytes) -> bool:
        """Keep a packet, or drop and count it; whether somebody has to come and take."""
        place, size = packet_queue_key(packet), len(packet)
        with self._lock:
            queue = self._queues.get(place) or self._begin(place)
            packets = queue.packets
            if len(packets) >= MOST_OF_ONE or queue.size + size > MOST_BYTES_OF_ONE or self._size + size > MOST_BYTES:
                self.dropped.count(place[0])
                return False
            if not packets:
                self._turns.append(queue)
            packets.append(packet)
            queue.size += size
            self._size += size
            asked, self._asked = self._asked, True
            return not asked

    def take_packets(self, most: int, size: int = MOST_BYTES) -> list[bytes]:
        """The next packets, at most so many, and no further one after so many bytes; the sources take turns."""
        taken: list[bytes] = []
        turns = self._turns
        with self._lock:
            enough = self._size - size
            while turns and len(taken) < most and self._size > enough:
                queue = turns.popleft()
                packet = queue.packets.popleft()
                queue.size -= len(packet)
                self._size -= len(packet)
                taken.append(packet)
                if queue.packets:
                    turns.append(queue)
        return taken

    def has_more(self) -> bool:
        """Whether more packets wait; if not, the next `put` returns that a reader has to come."""
        with self._lock:
            self._asked = bool(self._turns)
            return self._asked

    def _begin(self, place: Place) -> _Queue:
        """The queue for a further source; those of sources of which nothing waits make room for it."""
        if len(self._queues) >= MOST_SOURCES > len(self._turns):
            self._queues = {source: queue for source, queue in self._queues.items() if queue.packets}
        if len(self._queues) >= MOST_SOURCES:
            place = UNKNOWN_SYSTEM, place[1]
        return self._queues.setdefault(place, _Queue())


def packet_queue_key(packet: bytes) -> Place:
    """Source of the packet, and whether it is a command or an Abort; what is no packet has no source."""
    if len(packet) < SMALLEST_PACKET:
        return UNKNOWN_SYSTEM, False
    kind, source, destination = (LITTLE if packet[0] == LITTLE_ENDIAN else BIG)(packet)
    return source, destination not in TO_ALL or kind == ABORT
