"""Packets from other processes that wait for the kernel: bounded for each source, and served in turn."""

from collections import Counter, OrderedDict, deque
from threading import Lock

from imc import Abort
from imc.addresses import UNKNOWN_SYSTEM
from runtime.bus.excess import Excess

MOST_OF_ONE = 1024  # packets of one source
MOST_SOURCES = 64  # with packets waiting; all further ones share a queue
MOST_BYTES = 1 << 24  # of all
MOST_BYTES_OF_ONE = 1 << 20

LITTLE_ENDIAN = 0x54  # first byte of a packet
ABORT = Abort.ID


class Inbox:
    """Takes packets from any thread; a source that sends too much loses its own packets only.

    A source is a system as its packets name it; what it sends to one system, and Abort, waits apart from what it sends
    to all. Counted: `dropped`.
    """

    def __init__(self) -> None:
        self.dropped = Excess()
        self._queues: OrderedDict[tuple[int, bool], deque[bytes]] = OrderedDict()
        self._bytes: Counter[tuple[int, bool]] = Counter()
        self._all_bytes = 0
        self._length = 0
        self._asked = False
        self._lock = Lock()

    def __len__(self) -> int:
        return self._length

    def put(self, packet: bytes) -> bool:
        """Keep a packet, or drop and count it; whether somebody has to come and take."""
        source, apart = place_of(packet)
        with self._lock:
            place = source, apart
            queue = self._queues.get(place)
            if queue is None:
                if len(self._queues) >= MOST_SOURCES:
                    place = UNKNOWN_SYSTEM, apart
                queue = self._queues.setdefault(place, deque())
            size = len(packet)
            if (
                len(queue) >= MOST_OF_ONE
                or self._bytes[place] + size > MOST_BYTES_OF_ONE
                or self._all_bytes + size > MOST_BYTES
            ):
                self.dropped.count(source)
                return False
            queue.append(packet)
            self._bytes[place] += size
            self._all_bytes += size
            self._length += 1
            asked, self._asked = self._asked, True
            return not asked

    def take(self) -> bytes | None:
        """The next packet; the sources take turns."""
        with self._lock:
            if not self._queues:
                return None
            place, queue = self._queues.popitem(last=False)
            packet = queue.popleft()
            if queue:
                self._queues[place] = queue
                self._bytes[place] -= len(packet)
            else:
                del self._bytes[place]
            self._all_bytes -= len(packet)
            self._length -= 1
            return packet

    def rest(self) -> bool:
        """Whether there is more; if not, the next `put` says that somebody has to come."""
        with self._lock:
            self._asked = bool(self._queues)
            return self._asked


def place_of(packet: bytes) -> tuple[int, bool]:
    """Whose packet it is, and whether it is for one system, or an Abort; what is no packet has no source."""
    if len(packet) < 20:
        return UNKNOWN_SYSTEM, False
    order = "little" if packet[0] == LITTLE_ENDIAN else "big"
    source = int.from_bytes(packet[14:16], order)
    for_one = packet[17:19] not in (b"\xff\xff", b"\0\0") or int.from_bytes(packet[2:4], order) == ABORT
    return source, for_one
